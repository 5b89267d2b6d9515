#include "records/hemisphere.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "util/color.h"
#include "util/multiversion.h"

namespace rcs {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

// The two-dimensional rank-1 lattice of the plastic number (Roberts 2018): 1/g and 1/g^2 with g^3 = g + 1.
constexpr double kLatticeTheta = 0.7548776662466927;
constexpr double kLatticePhi = 0.5698402909980532;

// Cells within 10 degrees of the tangent plane say nothing about how near the next surface is: on a
// tessellated curve they always hit its neighbour facets. cos 80 degrees.
constexpr float kGrazingCosine = 0.1736f;

RCS_ALWAYS_INLINE float fraction(float x)
{
    return x - std::floor(x);
}

/// sin(2 pi t) for t in [-0.25, 0.25]: Taylor series to t^11, error below 6e-8.
RCS_ALWAYS_INLINE float sine_of_quarter_turns(float t)
{
    const float x = t * (2.0f * kPi);
    const float x2 = x * x;
    return x * (1.0f + x2 * (-1.0f / 6.0f +
                             x2 * (1.0f / 120.0f +
                                   x2 * (-1.0f / 5040.0f + x2 * (1.0f / 362880.0f - x2 * (1.0f / 39916800.0f))))));
}

/// sin(2 pi t) for t in [-0.5, 1.5): fold to the nearest zero crossing, turn the sign every half turn.
RCS_ALWAYS_INLINE float sine_of_turns(float t)
{
    const float half_turns = std::floor(2.0f * t + 0.5f);
    const float folded = t - 0.5f * half_turns;
    const float sign = 1.0f - 2.0f * std::abs(half_turns - 2.0f * std::floor(0.5f * half_turns));
    return sign * sine_of_quarter_turns(folded);
}

}  // namespace

HemisphereGrid make_hemisphere_grid(int rays)
{
    HemisphereGrid g;
    g.rings = std::max(2, static_cast<int>(std::lround(std::sqrt(static_cast<double>(rays) / std::numbers::pi))));
    g.azimuths = std::max(4, static_cast<int>(std::lround(static_cast<double>(rays) / g.rings)));
    g.cells = g.rings * g.azimuths;
    for (int c = 0; c < g.cells; ++c) {
        g.lattice_theta.push_back(static_cast<float>(std::fmod(kLatticeTheta * c, 1.0)));
        g.lattice_phi.push_back(static_cast<float>(std::fmod(kLatticePhi * c, 1.0)));
    }
    for (int j = 0; j < g.rings; ++j) {
        const double lower = static_cast<double>(j) / g.rings;
        const double upper = static_cast<double>(j + 1) / g.rings;
        const double middle = 0.5 * (lower + upper);
        g.tan_middle.push_back(static_cast<float>(std::sqrt(middle / (1.0 - middle))));
        const double azimuth_width = 2.0 * std::numbers::pi / g.azimuths;
        g.ring_wall.push_back(static_cast<float>(azimuth_width * std::sqrt(lower) * (1.0 - lower)));
        const double height = std::sqrt(1.0 - lower) - std::sqrt(1.0 - upper);
        g.azimuth_wall.push_back(static_cast<float>(std::sqrt((1.0 - middle) / middle) * height));
    }
    for (int k = 0; k < g.azimuths; ++k) {
        const double bound = 2.0 * std::numbers::pi * k / g.azimuths;
        const double middle = 2.0 * std::numbers::pi * (k + 0.5) / g.azimuths;
        g.cos_middle.push_back(static_cast<float>(std::cos(middle)));
        g.sin_middle_phi.push_back(static_cast<float>(std::sin(middle)));
        g.cos_bound.push_back(static_cast<float>(std::cos(bound)));
        g.sin_bound.push_back(static_cast<float>(std::sin(bound)));
    }
    return g;
}

Frame make_frame(glm::vec3 n, float turn)
{
    // Duff et al. 2017, "Building an orthonormal basis, revisited".
    const float sign = std::copysign(1.0f, n.z);
    const float a = -1.0f / (sign + n.z);
    const float b = n.x * n.y * a;
    const glm::vec3 x(1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x);
    const glm::vec3 y(b, sign + n.y * n.y * a, -n.y);
    const float c = std::cos(2.0f * kPi * turn);
    const float s = std::sin(2.0f * kPi * turn);
    return {c * x + s * y, c * y - s * x, n};
}

RCS_MULTIVERSION
void hemisphere_directions(const HemisphereGrid& grid, glm::vec2 shift, float* x, float* y, float* z)
{
    const float inverse_rings = 1.0f / static_cast<float>(grid.rings);
    const float inverse_azimuths = 1.0f / static_cast<float>(grid.azimuths);
    for (int j = 0; j < grid.rings; ++j) {
        const int first = j * grid.azimuths;
        const float* lattice_theta = grid.lattice_theta.data() + first;
        const float* lattice_phi = grid.lattice_phi.data() + first;
        const float ring = static_cast<float>(j);
        for (int k = 0; k < grid.azimuths; ++k) {
            const float sin2 = (ring + fraction(lattice_theta[k] + shift.x)) * inverse_rings;
            const float turns = (static_cast<float>(k) + fraction(lattice_phi[k] + shift.y)) * inverse_azimuths;
            const float sin_theta = std::sqrt(sin2);
            x[first + k] = sin_theta * sine_of_turns(turns + 0.25f);
            y[first + k] = sin_theta * sine_of_turns(turns);
            // Never exactly in the tangent plane, where a ray would skim its own surface.
            const float cos2 = 1.0f - sin2;
            z[first + k] = std::sqrt(cos2 > 1e-6f ? cos2 : 1e-6f);
        }
    }
}

namespace {

/// One colour's gradient sums over all cell walls.
struct ColorGradients {
    float rotation_x = 0.0f, rotation_y = 0.0f;
    float translation_x = 0.0f, translation_y = 0.0f;
};

/// Krivanek et al. 2005 / Ward and Heckbert 1992, stratified-cell form: each wall between two cells moves with
/// the nearer of the two hits when the record moves.
RCS_MULTIVERSION
ColorGradients color_gradients(const HemisphereGrid& g, const float* radiance, const float* inverse_distance)
{
    constexpr int kMostAzimuths = 512;  // of 65536 rays: 454
    float across_rings[kMostAzimuths] = {};     // per azimuth, along u_k
    float across_azimuths[kMostAzimuths] = {};  // along the tangent at the wall between k-1 and k
    float rotation[kMostAzimuths] = {};
    const int n = g.azimuths;
    for (int j = 0; j < g.rings; ++j) {
        const float* l = radiance + j * n;
        const float* r = inverse_distance + j * n;
        const float tangent = g.tan_middle[static_cast<std::size_t>(j)];
        const float wall = g.azimuth_wall[static_cast<std::size_t>(j)];
        for (int k = 0; k < n; ++k)
            rotation[k] += tangent * l[k];
        for (int k = 1; k < n; ++k)
            across_azimuths[k] += wall * (r[k] > r[k - 1] ? r[k] : r[k - 1]) * (l[k] - l[k - 1]);
        across_azimuths[0] += wall * std::max(r[0], r[n - 1]) * (l[0] - l[n - 1]);
        if (j == 0)
            continue;
        const float ring = g.ring_wall[static_cast<std::size_t>(j)];
        for (int k = 0; k < n; ++k)
            across_rings[k] += ring * (r[k] > r[k - n] ? r[k] : r[k - n]) * (l[k] - l[k - n]);
    }
    ColorGradients sum;
    for (int k = 0; k < n; ++k) {
        const std::size_t kk = static_cast<std::size_t>(k);
        // Tangents at azimuth + 90 degrees: (-sin, cos).
        sum.translation_x += g.cos_middle[kk] * across_rings[k] - g.sin_bound[kk] * across_azimuths[k];
        sum.translation_y += g.sin_middle_phi[kk] * across_rings[k] + g.cos_bound[kk] * across_azimuths[k];
        sum.rotation_x -= g.sin_middle_phi[kk] * rotation[k];
        sum.rotation_y += g.cos_middle[kk] * rotation[k];
    }
    const float scale = kPi / static_cast<float>(g.cells);
    sum.rotation_x *= scale;
    sum.rotation_y *= scale;
    return sum;
}

/// Variance of the mean of stratified cells, from differences between neighbours: what differs between cells
/// is at least what differs inside one.
float standard_error(const HemisphereGrid& g, const HemisphereSamples& s)
{
    double squares = 0.0;
    for (int j = 0; j < g.rings; ++j) {
        for (int k = 0; k < g.azimuths; ++k) {
            const auto at = [&](int ring, int azimuth) {
                const std::size_t c = static_cast<std::size_t>(ring * g.azimuths + azimuth);
                return luminance({s.red[c], s.green[c], s.blue[c]});
            };
            const float here = at(j, k);
            const float beside = at(j, k + 1 < g.azimuths ? k + 1 : 0);
            const float below = j + 1 < g.rings ? at(j + 1, k) : here;
            squares += 0.25 * (static_cast<double>(here - beside) * (here - beside) +
                               static_cast<double>(here - below) * (here - below));
        }
    }
    return kPi * static_cast<float>(std::sqrt(squares) / g.cells);
}

}  // namespace

HemisphereIntegrals integrate(const HemisphereGrid& g, const HemisphereSamples& s)
{
    HemisphereIntegrals result{};
    glm::dvec3 radiance(0.0);
    double inverse_sum = 0.0;
    float nearest_inverse = 0.0f;
    for (std::size_t c = 0; c < static_cast<std::size_t>(g.cells); ++c) {
        radiance += glm::dvec3(s.red[c], s.green[c], s.blue[c]);
        inverse_sum += s.inverse_distance[c];
        if (s.cosine[c] > kGrazingCosine)
            nearest_inverse = std::max(nearest_inverse, s.inverse_distance[c]);
    }
    result.irradiance = glm::vec3(radiance * (std::numbers::pi / g.cells));
    result.harmonic_mean_distance = inverse_sum > 0.0 ? static_cast<float>(g.cells / inverse_sum)
                                                      : std::numeric_limits<float>::infinity();
    result.minimum_distance =
        nearest_inverse > 0.0f ? 1.0f / nearest_inverse : std::numeric_limits<float>::infinity();
    const float* colors[3] = {s.red.data(), s.green.data(), s.blue.data()};
    for (int i = 0; i < 3; ++i) {
        const ColorGradients gradients = color_gradients(g, colors[i], s.inverse_distance.data());
        result.rotation_gradient[i] = {gradients.rotation_x, gradients.rotation_y, 0.0f};
        result.translation_gradient[i] = {gradients.translation_x, gradients.translation_y, 0.0f};
    }
    result.standard_error = standard_error(g, s);
    return result;
}

}  // namespace rcs
