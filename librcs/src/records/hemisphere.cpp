#include "records/hemisphere.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "util/color.h"
#include "util/fraction.h"
#include "util/multiversion.h"
#include "util/turns.h"

namespace rcs {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

// The two-dimensional rank-1 lattice of the plastic number (Roberts 2018): 1/g and 1/g^2 with g^3 = g + 1.
constexpr double kLatticeTheta = 0.7548776662466927;
constexpr double kLatticePhi = 0.5698402909980532;

// Cells within 10 degrees of the tangent plane say nothing about how near the next surface is: on a
// tessellated curve they always hit its neighbour facets. cos 80 degrees.
constexpr float kGrazingCosine = 0.1736f;

constexpr int kMostAzimuths = 512;  // of kMostHemisphereRays: 454

}  // namespace

HemisphereGrid make_hemisphere_grid(int rays)
{
    HemisphereGrid g;
    g.rings = std::max(2, static_cast<int>(std::lround(std::sqrt(static_cast<double>(rays) / std::numbers::pi))));
    g.azimuths = std::max(4, static_cast<int>(std::lround(static_cast<double>(rays) / g.rings)));
    g.cells = g.rings * g.azimuths;
    for (int c = 0; c < g.cells; ++c) {
        g.lattice_theta.push_back(static_cast<float>(fraction(kLatticeTheta * c)));
        g.lattice_phi.push_back(static_cast<float>(fraction(kLatticePhi * c)));
    }
    // Integral of tan(theta) over sin^2(theta) from 0 to s.
    const auto tangent_integral = [](double s) { return std::asin(std::sqrt(s)) - std::sqrt(s * (1.0 - s)); };
    for (int j = 0; j < g.rings; ++j) {
        const double lower = static_cast<double>(j) / g.rings;
        const double upper = static_cast<double>(j + 1) / g.rings;
        const double middle = 0.5 * (lower + upper);
        g.sin_lower.push_back(static_cast<float>(std::sqrt(lower)));
        g.cos_lower.push_back(static_cast<float>(std::sqrt(1.0 - lower)));
        g.sin_middle.push_back(static_cast<float>(std::sqrt(middle)));
        g.cos_middle.push_back(static_cast<float>(std::sqrt(1.0 - middle)));
        // Exact means over the ring: at its middle, the last ring's tangent is a third too small.
        g.tangent.push_back(static_cast<float>(g.rings * (tangent_integral(upper) - tangent_integral(lower))));
        const double azimuth_width = 2.0 * std::numbers::pi / g.azimuths;
        g.ring_wall.push_back(static_cast<float>(azimuth_width * std::sqrt(lower) * (1.0 - lower)));
        g.azimuth_wall.push_back(static_cast<float>(std::sqrt(upper) - std::sqrt(lower)));
    }
    for (int k = 0; k < g.azimuths; ++k) {
        const double bound = 2.0 * std::numbers::pi * k / g.azimuths;
        const double middle = 2.0 * std::numbers::pi * (k + 0.5) / g.azimuths;
        g.cos_phi.push_back(static_cast<float>(std::cos(middle)));
        g.sin_phi.push_back(static_cast<float>(std::sin(middle)));
        g.cos_bound.push_back(static_cast<float>(std::cos(bound)));
        g.sin_bound.push_back(static_cast<float>(std::sin(bound)));
    }
    return g;
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

/// How fast each wall between two cells moves when the record does, times the wall's length. The nearer hit is
/// the one that occludes; what moves is the plane it lies on, where that crosses the wall: a wall or floor that
/// runs on to the horizon does not move there, however near it was hit (a plain minimum of the two distances
/// gives ten times the gradient beside a lit wall).
struct WallSpeeds {
    std::vector<float> ring;  // between cell (j, k) and (j - 1, k); 0 for j = 0
    std::vector<float> side;  // between cell (j, k) and (j, k - 1)

    explicit WallSpeeds(int cells) : ring(static_cast<std::size_t>(cells)), side(ring) {}
};

/// One wall's inverse distance along its direction (x, y, z): of the plane of the nearer of two hits.
RCS_ALWAYS_INLINE float wall_inverse(const HemisphereSamples& s, int a, int b, float x, float y, float z)
{
    const std::size_t ia = static_cast<std::size_t>(a), ib = static_cast<std::size_t>(b);
    const float inverse_a = s.inverse_distance[ia], inverse_b = s.inverse_distance[ib];
    const float plane_a = s.plane_x[ia] * x + s.plane_y[ia] * y + s.plane_z[ia] * z;
    const float plane_b = s.plane_x[ib] * x + s.plane_y[ib] * y + s.plane_z[ib] * z;
    const float nearer = inverse_a > inverse_b ? inverse_a : inverse_b;
    const float plane = inverse_a > inverse_b ? plane_a : plane_b;
    const float positive = plane > 0.0f ? plane : 0.0f;
    return positive < nearer ? positive : nearer;
}

RCS_MULTIVERSION
void wall_speeds(const HemisphereGrid& g, const HemisphereSamples& s, WallSpeeds& walls)
{
    const int n = g.azimuths;
    for (int j = 0; j < g.rings; ++j) {
        const std::size_t jj = static_cast<std::size_t>(j);
        const int row = j * n;
        const float sin_middle = g.sin_middle[jj], cos_middle = g.cos_middle[jj], side_length = g.azimuth_wall[jj];
        float* side = walls.side.data() + row;
        for (int k = 1; k < n; ++k)
            side[k] = side_length * wall_inverse(s, row + k, row + k - 1,
                                                 sin_middle * g.cos_bound[static_cast<std::size_t>(k)],
                                                 sin_middle * g.sin_bound[static_cast<std::size_t>(k)], cos_middle);
        side[0] = side_length * wall_inverse(s, row, row + n - 1, sin_middle, 0.0f, cos_middle);
        if (j == 0) continue;
        const float sin_lower = g.sin_lower[jj], cos_lower = g.cos_lower[jj], ring_length = g.ring_wall[jj];
        float* ring = walls.ring.data() + row;
        for (int k = 0; k < n; ++k)
            ring[k] =
                ring_length * wall_inverse(s, row + k, row + k - n, sin_lower * g.cos_phi[static_cast<std::size_t>(k)],
                                           sin_lower * g.sin_phi[static_cast<std::size_t>(k)], cos_lower);
    }
}

/// Krivanek et al. 2005 / Ward and Heckbert 1992, stratified-cell form.
RCS_MULTIVERSION
ColorGradients color_gradients(const HemisphereGrid& g, const WallSpeeds& walls, const float* radiance)
{
    float across_rings[kMostAzimuths] = {};     // per azimuth, along u_k
    float across_azimuths[kMostAzimuths] = {};  // along the tangent at the wall between k-1 and k
    float rotation[kMostAzimuths] = {};
    const int n = g.azimuths;
    for (int j = 0; j < g.rings; ++j) {
        const float* l = radiance + j * n;
        const float* side = walls.side.data() + j * n;
        const float* ring = walls.ring.data() + j * n;
        const float tangent = g.tangent[static_cast<std::size_t>(j)];
        for (int k = 0; k < n; ++k) rotation[k] += tangent * l[k];
        for (int k = 1; k < n; ++k) across_azimuths[k] += side[k] * (l[k] - l[k - 1]);
        across_azimuths[0] += side[0] * (l[0] - l[n - 1]);
        if (j == 0) continue;
        for (int k = 0; k < n; ++k) across_rings[k] += ring[k] * (l[k] - l[k - n]);
    }
    ColorGradients sum;
    for (int k = 0; k < n; ++k) {
        const std::size_t kk = static_cast<std::size_t>(k);
        // Tangents at azimuth + 90 degrees: (-sin, cos).
        sum.translation_x += g.cos_phi[kk] * across_rings[k] - g.sin_bound[kk] * across_azimuths[k];
        sum.translation_y += g.sin_phi[kk] * across_rings[k] + g.cos_bound[kk] * across_azimuths[k];
        sum.rotation_x -= g.sin_phi[kk] * rotation[k];
        sum.rotation_y += g.cos_phi[kk] * rotation[k];
    }
    const float scale = kPi / static_cast<float>(g.cells);
    sum.rotation_x *= scale;
    sum.rotation_y *= scale;
    return sum;
}

/// Variance of the mean of stratified cells, from differences between neighbours: what differs between cells
/// is at least what differs inside one.
RCS_MULTIVERSION
float error_of_cells(const HemisphereGrid& g, const HemisphereSamples& s)
{
    const int n = g.azimuths;
    thread_local std::vector<float> luminances;
    luminances.resize(static_cast<std::size_t>(g.cells));
    float* l = luminances.data();
    for (std::size_t c = 0; c < luminances.size(); ++c) l[c] = luminance({s.red[c], s.green[c], s.blue[c]});
    float squares[kMostAzimuths] = {};  // per azimuth: no sum crosses the lanes of a vector
    for (int j = 0; j < g.rings; ++j) {
        const float* row = l + j * n;
        const float* below = j + 1 < g.rings ? row + n : row;
        for (int k = 0; k < n; ++k) squares[k] += (row[k] - below[k]) * (row[k] - below[k]);
        for (int k = 1; k < n; ++k) squares[k] += (row[k] - row[k - 1]) * (row[k] - row[k - 1]);
        squares[0] += (row[0] - row[n - 1]) * (row[0] - row[n - 1]);
    }
    double sum = 0.0;
    for (int k = 0; k < n; ++k) sum += squares[k];
    return kPi * static_cast<float>(0.5 * std::sqrt(sum) / g.cells);
}

}  // namespace

float standard_error(const HemisphereGrid& g, const HemisphereSamples& s) { return error_of_cells(g, s); }

HemisphereIntegrals integrate(const HemisphereGrid& g, const HemisphereSamples& s, const HemisphereSamples& means)
{
    HemisphereIntegrals result{};
    glm::dvec3 radiance(0.0);
    double inverse_sum = 0.0;
    float nearest_inverse = 0.0f;
    for (std::size_t c = 0; c < static_cast<std::size_t>(g.cells); ++c) {
        radiance += glm::dvec3(s.red[c], s.green[c], s.blue[c]);
        inverse_sum += s.inverse_distance[c];
        if (s.cosine[c] > kGrazingCosine) nearest_inverse = std::max(nearest_inverse, s.inverse_distance[c]);
    }
    result.irradiance = glm::vec3(radiance * (std::numbers::pi / g.cells));
    result.harmonic_mean_distance =
        inverse_sum > 0.0 ? static_cast<float>(g.cells / inverse_sum) : std::numeric_limits<float>::infinity();
    result.minimum_distance = nearest_inverse > 0.0f ? 1.0f / nearest_inverse : std::numeric_limits<float>::infinity();
    thread_local WallSpeeds walls(0);
    if (walls.ring.size() != static_cast<std::size_t>(g.cells)) walls = WallSpeeds(g.cells);
    wall_speeds(g, s, walls);
    const float* colors[3] = {means.red.data(), means.green.data(), means.blue.data()};
    for (int i = 0; i < 3; ++i) {
        const ColorGradients gradients = color_gradients(g, walls, colors[i]);
        result.rotation_gradient[i] = {gradients.rotation_x, gradients.rotation_y, 0.0f};
        result.translation_gradient[i] = {gradients.translation_x, gradients.translation_y, 0.0f};
    }
    result.standard_error = standard_error(g, s);
    return result;
}

}  // namespace rcs
