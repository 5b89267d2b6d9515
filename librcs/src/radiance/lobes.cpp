#include "radiance/lobes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "util/color.h"

namespace rcs {
namespace {

constexpr int kAxes = kBands;
constexpr int kWeights = kBands * kAxes;  // of P_l about axis j, number l kAxes + j
constexpr int kAlphas = RCS_LOBE_ALPHAS, kCosines = RCS_LOBE_COSINES;
constexpr float kLeastCosine = static_cast<float>(RCS_LOBE_LEAST_COSINE);
static_assert(RCS_LOBE_BANDS == kBands);

constexpr int kRings = 32, kSpokes = 64;  // directions of a fit

double axis_angle(int j) { return j * std::numbers::pi / kAxes; }

/// Legendre polynomials 0 .. kBands - 1.
std::array<double, kBands> legendre(double x)
{
    std::array<double, kBands> p{1.0, x};
    for (int l = 2; l < kBands; ++l)
        p[static_cast<std::size_t>(l)] =
            ((2 * l - 1) * x * p[static_cast<std::size_t>(l - 1)] - (l - 1) * p[static_cast<std::size_t>(l - 2)]) / l;
    return p;
}

using Weights = std::array<double, kWeights>;
using NormalMatrix = std::array<Weights, kWeights>;

/// Upper hemisphere about z in equal solid angles, and the zonal harmonics there.
struct Directions {
    std::vector<glm::dvec3> direction;
    std::vector<Weights> basis;
    double solid_angle = 2.0 * std::numbers::pi / (kRings * kSpokes);
};

Directions make_directions()
{
    Directions d;
    for (int ring = 0; ring < kRings; ++ring) {
        for (int spoke = 0; spoke < kSpokes; ++spoke) {
            const double z = (ring + 0.5) / kRings, phi = (spoke + 0.5) / kSpokes * 2.0 * std::numbers::pi;
            const double r = std::sqrt(1.0 - z * z);
            const glm::dvec3 w(r * std::cos(phi), r * std::sin(phi), z);
            Weights basis;
            for (int j = 0; j < kAxes; ++j) {
                const std::array<double, kBands> p =
                    legendre(w.x * std::sin(axis_angle(j)) + w.z * std::cos(axis_angle(j)));
                for (int l = 0; l < kBands; ++l)
                    basis[static_cast<std::size_t>(l * kAxes + j)] =
                        (2 * l + 1) / (4.0 * std::numbers::pi) * p[static_cast<std::size_t>(l)];
            }
            d.direction.push_back(w);
            d.basis.push_back(basis);
        }
    }
    return d;
}

/// Cholesky factor of the fits' normal equations. Zonal harmonics about six axes are more than a band needs: the
/// small multiple of the identity picks the least weights, which also amplify the records' noise least.
NormalMatrix factorise(const Directions& d)
{
    NormalMatrix m{};
    double trace = 0.0;
    for (std::size_t n = 0; n < d.direction.size(); ++n)
        for (std::size_t a = 0; a < kWeights; ++a)
            for (std::size_t b = 0; b <= a; ++b)
                m[a][b] += d.direction[n].z * d.solid_angle * d.basis[n][a] * d.basis[n][b];
    for (std::size_t a = 0; a < kWeights; ++a) trace += m[a][a];
    for (std::size_t a = 0; a < kWeights; ++a) {
        m[a][a] += 1e-3 * trace / kWeights;
        for (std::size_t b = 0; b <= a; ++b) {
            double sum = m[a][b];
            for (std::size_t k = 0; k < b; ++k) sum -= m[a][k] * m[b][k];
            m[a][b] = a == b ? std::sqrt(sum) : sum / m[b][b];
        }
    }
    return m;
}

Weights solve(const NormalMatrix& factor, Weights x)
{
    for (std::size_t a = 0; a < kWeights; ++a) {
        for (std::size_t k = 0; k < a; ++k) x[a] -= factor[a][k] * x[k];
        x[a] /= factor[a][a];
    }
    for (std::size_t a = kWeights; a-- > 0;) {
        for (std::size_t k = a + 1; k < kWeights; ++k) x[a] -= factor[k][a] * x[k];
        x[a] /= factor[a][a];
    }
    return x;
}

struct FittedLobe {
    float weights[kWeights];
    float albedo;  // integral of f cos
};

/// Lobes for Fresnel 1 (grey) and for Schlick's grazing term alone, of which every f0 and f90 is a mixture.
struct LobeTable {
    FittedLobe grey[kAlphas][kCosines], grazing[kAlphas][kCosines];
};

FittedLobe fit_lobe(const Directions& d, const NormalMatrix& factor, float alpha, float cosine, float f0)
{
    Bsdf bsdf;
    bsdf.add(make_lobe<Specular>(glm::vec3(f0), 1.0f, alpha));
    const glm::vec3 outgoing(std::sqrt(1.0f - cosine * cosine), 0.0f, cosine);
    Weights right{};
    double albedo = 0.0;
    for (std::size_t n = 0; n < d.direction.size(); ++n) {
        const double value = static_cast<double>(evaluate(bsdf, outgoing, glm::vec3(d.direction[n])).g);
        const double weight = value * d.direction[n].z * d.solid_angle;
        albedo += weight;
        for (std::size_t a = 0; a < kWeights; ++a) right[a] += weight * d.basis[n][a];
    }
    const Weights fit = solve(factor, right);
    // A uniform sky has to be reflected exactly.
    double reflected = 0.0;
    for (std::size_t n = 0; n < d.direction.size(); ++n)
        for (std::size_t a = 0; a < kWeights; ++a)
            reflected += fit[a] * d.basis[n][a] * d.direction[n].z * d.solid_angle;
    FittedLobe lobe;
    for (std::size_t a = 0; a < kWeights; ++a) lobe.weights[a] = static_cast<float>(fit[a] * albedo / reflected);
    lobe.albedo = static_cast<float>(albedo);
    return lobe;
}

LobeTable make_table()
{
    const Directions directions = make_directions();
    const NormalMatrix factor = factorise(directions);
    LobeTable table;
    for (int i = 0; i < kAlphas; ++i) {
        const float alpha = kLeastRecordAlpha + (1.0f - kLeastRecordAlpha) * static_cast<float>(i) / (kAlphas - 1);
        for (int j = 0; j < kCosines; ++j) {
            const float cosine = kLeastCosine + (1.0f - kLeastCosine) * static_cast<float>(j) / (kCosines - 1);
            table.grey[i][j] = fit_lobe(directions, factor, alpha, cosine, 1.0f);
            table.grazing[i][j] = fit_lobe(directions, factor, alpha, cosine, 0.0f);
        }
    }
    return table;
}

const LobeTable& table()
{
    static const LobeTable lobes = make_table();
    return lobes;
}

/// Roughness over the range of the fits.
float roughness_in_fits(const Lobe& lobe) { return (lobe.alpha - kLeastRecordAlpha) / (1.0f - kLeastRecordAlpha); }

/// Weights of the lobe at one pixel, divided by its albedo.
void look_up(const Lobe& lobe, float cosine, float* weights, std::size_t stride)
{
    const LobeTable& t = table();
    const auto node = [](float x, int nodes, float& fraction) {
        const float at = std::clamp(x, 0.0f, 1.0f) * static_cast<float>(nodes - 1);
        const int i = std::min(static_cast<int>(at), nodes - 2);
        fraction = at - static_cast<float>(i);
        return i;
    };
    float s, c;
    const int i = node(roughness_in_fits(lobe), kAlphas, s);
    const int j = node((cosine - kLeastCosine) / (1.0f - kLeastCosine), kCosines, c);
    const float f0 = luminance(lobe.color);
    // f0 (grey - grazing) + f90 grazing, both of them with what multiple scattering gives back.
    const float of_grey = f0, of_grazing = lobe.level - f0;
    const float share[4] = {(1.0f - s) * (1.0f - c), (1.0f - s) * c, s * (1.0f - c), s * c};
    const FittedLobe* grey[4] = {&t.grey[i][j], &t.grey[i][j + 1], &t.grey[i + 1][j], &t.grey[i + 1][j + 1]};
    const FittedLobe* grazing[4] = {&t.grazing[i][j], &t.grazing[i][j + 1], &t.grazing[i + 1][j],
                                    &t.grazing[i + 1][j + 1]};
    float albedo = 0.0f;
    for (int k = 0; k < 4; ++k) albedo += share[k] * (of_grey * grey[k]->albedo + of_grazing * grazing[k]->albedo);
    const float scale = albedo > 0.0f ? 1.0f / albedo : 0.0f;
    for (std::size_t w = 0; w < kWeights; ++w) {
        float sum = 0.0f;
        for (int k = 0; k < 4; ++k)
            sum += share[k] * (of_grey * grey[k]->weights[w] + of_grazing * grazing[k]->weights[w]);
        weights[w * stride] = scale * sum;
    }
}

RCS_MULTIVERSION
void add_axis(const detail::HarmonicFactors& factors, int axis, const float* x, const float* y, const float* z,
              const float (*weights)[kHarmonicLanes], HarmonicLanes& sum)
{
    HarmonicLanes y_lm;
    evaluate_harmonics(factors, x, y, z, y_lm);
    for (int l = 0; l < kBands; ++l)
        for (int m = l * l; m < (l + 1) * (l + 1); ++m)
            for (int i = 0; i < kHarmonicLanes; ++i) sum[m][i] += weights[l * kAxes + axis][i] * y_lm[m][i];
}

}  // namespace

void evaluate_lobes(const Lobe* const* lobes, const glm::vec3* normals, const glm::vec3* outgoing,
                    HarmonicLanes& coefficients)
{
    alignas(64) float weights[kWeights][kHarmonicLanes] = {};
    glm::vec3 normal[kHarmonicLanes], tangent[kHarmonicLanes];
    for (int i = 0; i < kHarmonicLanes; ++i) {
        normal[i] = {0.0f, 0.0f, 1.0f};
        tangent[i] = {1.0f, 0.0f, 0.0f};
        if (!lobes[i]) continue;
        normal[i] = normals[i];
        const float cosine = glm::dot(normal[i], outgoing[i]);
        const glm::vec3 across = outgoing[i] - cosine * normal[i];
        const float length2 = glm::dot(across, across);
        // Seen squarely, the lobe is round: any tangent does.
        const glm::vec3 other = std::abs(normal[i].x) < 0.5f ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0);
        tangent[i] = length2 > 1e-12f ? across / std::sqrt(length2) : glm::normalize(glm::cross(normal[i], other));
        look_up(*lobes[i], cosine, &weights[0][i], kHarmonicLanes);
    }
    for (auto& lanes : coefficients) std::fill(lanes, lanes + kHarmonicLanes, 0.0f);
    for (int j = 0; j < kAxes; ++j) {
        const float sine = static_cast<float>(std::sin(axis_angle(j))),
                    cosine = static_cast<float>(std::cos(axis_angle(j)));
        float x[kHarmonicLanes], y[kHarmonicLanes], z[kHarmonicLanes];
        for (int i = 0; i < kHarmonicLanes; ++i) {
            const glm::vec3 axis = sine * tangent[i] + cosine * normal[i];
            x[i] = axis.x;
            y[i] = axis.y;
            z[i] = axis.z;
        }
        add_axis(detail::harmonic_factors(), j, x, y, z, weights, coefficients);
    }
}

namespace {

gpu::GpuLobeFits make_device_fits()
{
    gpu::GpuLobeFits all{};
    const detail::HarmonicFactors& factors = detail::harmonic_factors();
    for (int l = 0; l < kBands; ++l) {
        all.start[l] = factors.start[l];
        for (int m = 0; m < kBands; ++m) {
            all.a[l * kBands + m] = factors.a[l][m];
            all.b[l * kBands + m] = factors.b[l][m];
        }
    }
    gpu::GpuFittedLobe* to = all.fits;
    for (const auto* of_alphas : {table().grey, table().grazing})
        for (int i = 0; i < kAlphas; ++i)
            for (int j = 0; j < kCosines; ++j, ++to) {
                const FittedLobe& from = of_alphas[i][j];
                for (int w = 0; w < kWeights; ++w) to->weights[w / 4][w % 4] = from.weights[w];
                to->albedo = glm::vec4(from.albedo, 0.0f, 0.0f, 0.0f);
            }
    return all;
}

}  // namespace

const gpu::GpuLobeFits& device_lobe_fits()
{
    static const gpu::GpuLobeFits fits = make_device_fits();
    return fits;
}

glm::vec4 device_lobe(const Lobe* lobe)
{
    if (!lobe) return glm::vec4(0.0f);
    const float f0 = luminance(lobe->color);
    return {roughness_in_fits(*lobe), f0, lobe->level - f0, 1.0f};
}

}  // namespace rcs
