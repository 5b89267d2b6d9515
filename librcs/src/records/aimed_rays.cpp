#include "records/aimed_rays.h"

#include <cmath>
#include <numbers>

#include "util/color.h"
#include "util/random.h"

namespace rcs {
namespace {

// Rays nearer to the tangent plane than that cosine would skim their own surface.
constexpr float kLeastCosine = 1e-3f;

float luminance_of(const HemisphereSamples& s, std::size_t cell)
{
    return luminance({s.red[cell], s.green[cell], s.blue[cell]});
}

}  // namespace

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
    for (std::size_t c = 0; c < static_cast<std::size_t>(size.grid.cells); ++c) {
        const glm::vec3 direction = w.x[c] * w.frame.x + w.y[c] * w.frame.y + w.z[c] * w.frame.z;
        a.scale[c] = scale(w.z[c], ArrivalMap::density(a.chances, direction));
    }
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
        if (is_above) a.scale[cell] = scale(cosine, c.density);
    }
}

glm::vec3 mixed_irradiance(const GatherSize& size, const GatherWorkspace& w)
{
    glm::dvec3 sum(0.0);
    const HemisphereSamples& s = w.samples;
    for (const PacketCells& cells : w.cells)
        for (std::size_t c = cells.first; c < cells.first + static_cast<std::size_t>(cells.count); ++c)
            sum += static_cast<double>(w.aimed.scale[c]) * glm::dvec3(s.red[c], s.green[c], s.blue[c]);
    return glm::vec3(sum * (std::numbers::pi / size.grid.cells));
}

float error_of_mixed(const GatherSize& size, GatherWorkspace& w)
{
    AimedRays& a = w.aimed;
    for (std::size_t c = 0; c < static_cast<std::size_t>(size.grid.cells); ++c) {
        a.scaled.red[c] = a.scale[c] * w.samples.red[c];
        a.scaled.green[c] = a.scale[c] * w.samples.green[c];
        a.scaled.blue[c] = a.scale[c] * w.samples.blue[c];
    }
    // Of strata, as differences between neighbours tell.
    double squares = 0.0;
    const auto brought = [&](int cell) {
        const auto c = static_cast<std::size_t>(cell);
        return static_cast<double>(a.scale[c] * luminance_of(w.samples, c));
    };
    for (int cell = size.first_aimed() + 1; cell < size.cells(); ++cell) {
        const double change = brought(cell) - brought(cell - 1);
        squares += 0.5 * change * change;
    }
    const float of_aimed =
        std::numbers::pi_v<float> / static_cast<float>(size.grid.cells) * static_cast<float>(std::sqrt(squares));
    return std::hypot(standard_error(size.grid, a.scaled), of_aimed);
}

void note_arrivals(const ArrivalMap& map, const Birth& birth, GatherWorkspace& w)
{
    const std::size_t first = w.aimed.arrived.size();
    for (const PacketCells& cells : w.cells)
        for (int i = 0; i < cells.count; ++i) {
            if (!cells.is_active(i)) continue;
            const glm::vec3 direction = ray_direction(w.packets[cells.first / RayPacket::kWidth].ray, i);
            w.aimed.arrived.push_back(
                {ArrivalMap::bin_of(direction), luminance_of(w.samples, cells.first + static_cast<std::size_t>(i))});
        }
    w.aimed.gathers.push_back({map.cells(birth.position, birth.normal), static_cast<std::uint32_t>(first),
                               static_cast<std::uint32_t>(w.aimed.arrived.size() - first)});
}

}  // namespace rcs
