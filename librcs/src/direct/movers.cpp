#include "direct/movers.h"

#include <algorithm>
#include <cmath>

namespace rcs {
namespace {

// Of more pairs of a thing and a lamp, one or the other lies behind anything, and to look takes as long as shadow rays.
constexpr std::size_t kMostPairs = 256;
// Spheres are larger than what they are around by far more than rounding, also that of the points seen from there.
constexpr float kRim = 1e-3f;
constexpr std::size_t kParts = 8;

}  // namespace

Movers::Movers(std::span<const Bounds> boxes, const Lights& lights, bool sky_has_peaks)
{
    if (boxes.empty()) return;
    everywhere_ = sky_has_peaks || !lights.punctual.empty() || boxes.size() * lights.triangles.size() > kMostPairs;
    for (const EmissiveTriangle& t : lights.triangles) {
        const glm::vec3 centre = (t.corner[0] + t.corner[1] + t.corner[2]) / 3.0f;
        float radius = 0.0f;
        for (const glm::vec3& corner : t.corner) radius = std::max(radius, glm::length(corner - centre));
        lamps_.push_back({centre, (1.0f + kRim) * radius});
    }
    for (const Bounds& box : boxes) {
        if (!(box.min.x <= box.max.x)) continue;
        const glm::vec3 middle(0.5 * (box.min + box.max)), half(0.5 * (box.max - box.min));
        const float radius = (1.0f + kRim) * glm::length(half);
        things_.push_back({middle, radius});
        for (std::size_t part = 0; part < kParts; ++part) {
            const glm::vec3 side((part & 1u) != 0u ? 0.5f : -0.5f, (part & 2u) != 0u ? 0.5f : -0.5f,
                                 (part & 4u) != 0u ? 0.5f : -0.5f);
            things_.push_back({middle + side * half, 0.5f * radius});
        }
    }
}

/// Whether a thing meets the hull of a point and a lamp: the spheres along the line between them that grow from the one
/// to the other.
bool Movers::lies_between(glm::vec3 point, const Sphere& lamp, const Sphere& thing)
{
    const glm::vec3 way = lamp.centre - point, to_thing = thing.centre - point;
    const float length = glm::length(way), rim = kRim * length;
    const float slope = lamp.radius / std::max(length, 1e-30f);
    if (slope >= 1.0f) return true;  // within the lamp's sphere
    const float along = glm::dot(to_thing, way) / length;
    const float across = std::sqrt(std::max(0.0f, glm::dot(to_thing, to_thing) - along * along));
    // Where along the line the distance to the growing sphere is least.
    const float nearest = std::clamp(along + across * slope / std::sqrt(1.0f - slope * slope), 0.0f, length);
    return std::hypot(along - nearest, across) <= thing.radius + slope * nearest + rim;
}

bool Movers::touch(glm::vec3 point) const
{
    if (everywhere_) return true;
    for (std::size_t thing = 0; thing < things_.size(); thing += 1 + kParts) {
        for (const Sphere& lamp : lamps_) {
            if (!lies_between(point, lamp, things_[thing])) continue;
            for (std::size_t part = 1; part <= kParts; ++part)
                if (lies_between(point, lamp, things_[thing + part])) return true;
        }
    }
    return false;
}

}  // namespace rcs
