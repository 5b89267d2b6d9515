#include "lamps/movers.h"

#include <algorithm>
#include <cmath>

namespace rcs {
namespace {

// Of more pairs of a thing and a lamp, one or the other lies behind anything, and to look takes as long as shadow rays.
constexpr std::size_t kMostPairs = 256;
// Spheres and boxes are larger than what they are around by far more than rounding, also that of the points seen from
// there.
constexpr float kRim = 1e-3f;

/// Whether, along an axis, four points all lie on one side of a box around 0.
bool separates(glm::vec3 axis, const glm::vec3 (&points)[4], glm::vec3 half)
{
    const float box = glm::dot(glm::abs(axis), half);
    const float a = glm::dot(axis, points[0]), b = glm::dot(axis, points[1]), c = glm::dot(axis, points[2]),
                d = glm::dot(axis, points[3]);
    return std::max(std::max(a, b), std::max(c, d)) < -box || std::min(std::min(a, b), std::min(c, d)) > box;
}

}  // namespace

Movers::Movers(std::span<const Bounds> boxes, const Lights& lights, bool sky_has_peaks)
{
    if (boxes.empty()) return;
    everywhere_ = sky_has_peaks || !lights.punctual.empty() || boxes.size() * lights.triangles.size() > kMostPairs;
    for (const EmissiveTriangle& t : lights.triangles) {
        const glm::vec3 centre = (t.corner[0] + t.corner[1] + t.corner[2]) / 3.0f;
        float radius = 0.0f;
        for (const glm::vec3& corner : t.corner) radius = std::max(radius, glm::length(corner - centre));
        lamps_.push_back({{t.corner[0], t.corner[1], t.corner[2]}, {centre, (1.0f + kRim) * radius}});
    }
    for (const Bounds& box : boxes) {
        if (!(box.min.x <= box.max.x)) continue;
        const glm::vec3 middle(0.5 * (box.min + box.max)), half(0.5 * (box.max - box.min));
        things_.push_back({half, {middle, (1.0f + kRim) * glm::length(half)}});
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

/// Whether a box meets the tetrahedron of a point and a lamp: no axis separates them (Gottschalk, Lin and Manocha
/// 1996).
bool Movers::meets_hull(glm::vec3 point, const Lamp& lamp, const Thing& thing)
{
    const glm::vec3 centre = thing.around.centre;
    const glm::vec3 hull[4] = {point - centre, lamp.corner[0] - centre, lamp.corner[1] - centre,
                               lamp.corner[2] - centre};
    const glm::vec3 half = thing.half + kRim * (thing.around.radius + glm::length(lamp.around.centre - point));
    const glm::vec3 unit[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (const glm::vec3& axis : unit)
        if (separates(axis, hull, half)) return false;
    glm::vec3 edge[6];
    for (int k = 0; k < 3; ++k) edge[k] = hull[k + 1] - hull[0], edge[k + 3] = hull[(k + 1) % 3 + 1] - hull[k + 1];
    for (int k = 0; k < 3; ++k)
        if (separates(glm::cross(edge[k], edge[(k + 1) % 3]), hull, half)) return false;
    if (separates(glm::cross(edge[3], edge[4]), hull, half)) return false;
    for (const glm::vec3& along : edge)
        for (const glm::vec3& axis : unit)
            if (separates(glm::cross(along, axis), hull, half)) return false;
    return true;
}

bool Movers::touch(glm::vec3 point) const
{
    if (everywhere_) return true;
    for (const Thing& thing : things_)
        for (const Lamp& lamp : lamps_)
            if (lies_between(point, lamp.around, thing.around) && meets_hull(point, lamp, thing)) return true;
    return false;
}

}  // namespace rcs
