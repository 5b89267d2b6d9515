#include "records/aimed_rays.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "util/color.h"
#include "util/random.h"
#include "util/turns.h"

namespace rcs {
namespace {

// Rays nearer to the tangent plane than that cosine would skim their own surface.
constexpr float kLeastCosine = 1e-3f;

float luminance_of(const HemisphereSamples& s, std::size_t cell)
{
    return luminance({s.red[cell], s.green[cell], s.blue[cell]});
}

/// [W m^-2]
glm::vec3 mixed_irradiance(const GatherSize& size, const GatherWorkspace& w)
{
    glm::dvec3 sum(0.0);
    const HemisphereSamples& s = w.samples;
    for (const PacketCells& cells : w.cells)
        for (std::size_t c = cells.first; c < cells.first + static_cast<std::size_t>(cells.count); ++c)
            sum += static_cast<double>(w.aimed.scale[c]) * glm::dvec3(s.red[c], s.green[c], s.blue[c]);
    return glm::vec3(sum * (std::numbers::pi / size.grid.cells));
}

/// The cells' colours become what their own rays are left with.
void scale_colors(const GatherSize& size, GatherWorkspace& w)
{
    AimedRays& a = w.aimed;
    for (std::size_t c = 0; c < static_cast<std::size_t>(size.grid.cells); ++c) {
        a.colors.red[c] = a.scale[c] * w.samples.red[c];
        a.colors.green[c] = a.scale[c] * w.samples.green[c];
        a.colors.blue[c] = a.scale[c] * w.samples.blue[c];
    }
}

/// Adds what aimed rays bring to the cells that they went to, which makes means of them.
/// @param w  holds scaled colours
void add_aimed_colors(const GatherSize& size, GatherWorkspace& w)
{
    AimedRays& a = w.aimed;
    const HemisphereGrid& g = size.grid;
    const float rings = static_cast<float>(g.rings), azimuths = static_cast<float>(g.azimuths);
    for (int cell = size.first_aimed(); cell < size.cells(); ++cell) {
        const auto i = static_cast<std::size_t>(cell);
        if (!(w.z[i] > 0.0f)) continue;
        const int ring = std::min(static_cast<int>((1.0f - w.z[i] * w.z[i]) * rings), g.rings - 1);
        const int azimuth = std::min(static_cast<int>(turns_of(w.x[i], w.y[i]) * azimuths), g.azimuths - 1);
        const auto c = static_cast<std::size_t>(ring * g.azimuths + azimuth);
        a.colors.red[c] += a.scale[i] * w.samples.red[i];
        a.colors.green[c] += a.scale[i] * w.samples.green[i];
        a.colors.blue[c] += a.scale[i] * w.samples.blue[i];
    }
}

/// Standard error of the irradiance's luminance [W m^-2], of strata: as differences between neighbours tell.
/// @param w  holds scaled colours
float error_of_mixed(const GatherSize& size, const GatherWorkspace& w)
{
    double squares = 0.0;
    const auto brought = [&](int cell) {
        const auto c = static_cast<std::size_t>(cell);
        return static_cast<double>(w.aimed.scale[c] * luminance_of(w.samples, c));
    };
    for (int cell = size.first_aimed() + 1; cell < size.cells(); ++cell) {
        const double change = brought(cell) - brought(cell - 1);
        squares += 0.5 * change * change;
    }
    const float of_aimed =
        std::numbers::pi_v<float> / static_cast<float>(size.grid.cells) * static_cast<float>(std::sqrt(squares));
    return std::hypot(standard_error(size.grid, w.aimed.colors), of_aimed);
}

}  // namespace

void note_bins(const GatherSize& size, GatherWorkspace& w)
{
    w.aimed.bins.resize(static_cast<std::size_t>(size.cells()));
    ArrivalMap::bins_of(w.frame, w.x.data(), w.y.data(), w.z.data(),
                        std::span(w.aimed.bins).first(static_cast<std::size_t>(size.grid.cells)));
}

void aim_by_map(const ArrivalMap& map, const Birth& birth, const GatherSize& size, GatherWorkspace& w)
{
    AimedRays& a = w.aimed;
    a.chances.resize(ArrivalMap::kBins);
    map.weigh(map.cells(birth.position, birth.normal), birth.normal, a.chances);
    a.scale.assign(static_cast<std::size_t>(size.cells()), 0.0f);
    const auto hemisphere = static_cast<float>(size.grid.cells), aimed = static_cast<float>(size.aimed);
    const auto scale = [&](float cosine, float density) {
        const float evenly = hemisphere * cosine / std::numbers::pi_v<float>;
        return evenly / (evenly + aimed * density);
    };
    for (std::size_t c = 0; c < static_cast<std::size_t>(size.grid.cells); ++c)
        a.scale[c] = scale(w.z[c], ArrivalMap::density(a.chances, a.bins[c]));
    RandomStream random(mix64(birth.key + 4));
    std::size_t bin = 0;
    for (int k = 0; k < size.aimed; ++k) {
        const float at = (static_cast<float>(k) + random.next()) / aimed * a.chances.back();
        const float u = random.next();
        const ArrivalMap::Choice c = ArrivalMap::choose(a.chances, at, {u, random.next()}, bin);
        const float cosine = glm::dot(c.direction, birth.normal);
        const bool is_above = cosine > kLeastCosine;
        const std::size_t cell = static_cast<std::size_t>(size.first_aimed() + k);
        w.x[cell] = is_above ? glm::dot(c.direction, w.frame.x) : 0.0f;
        w.y[cell] = is_above ? glm::dot(c.direction, w.frame.y) : 0.0f;
        w.z[cell] = is_above ? cosine : -1.0f;  // which no ray is shot for
        a.bins[cell] = c.bin;
        if (is_above) a.scale[cell] = scale(cosine, ArrivalMap::density(a.chances, c.bin));
    }
}

HemisphereIntegrals integrate_mixed(const GatherSize& size, GatherWorkspace& w)
{
    scale_colors(size, w);
    const float error = error_of_mixed(size, w);
    add_aimed_colors(size, w);
    HemisphereIntegrals integrals = integrate(size.grid, w.samples, w.aimed.colors);
    integrals.irradiance = mixed_irradiance(size, w);
    integrals.standard_error = error;
    return integrals;
}

void note_arrivals(const ArrivalMap& map, const Birth& birth, GatherWorkspace& w)
{
    const std::size_t first = w.aimed.arrived.size();
    for (const PacketCells& cells : w.cells)
        for (int i = 0; i < cells.count; ++i) {
            if (!cells.is_active(i)) continue;
            const std::size_t cell = cells.first + static_cast<std::size_t>(i);
            w.aimed.arrived.push_back({w.aimed.bins[cell], luminance_of(w.samples, cell)});
        }
    w.aimed.gathers.push_back({map.cells(birth.position, birth.normal), static_cast<std::uint32_t>(first),
                               static_cast<std::uint32_t>(w.aimed.arrived.size() - first)});
}

}  // namespace rcs
