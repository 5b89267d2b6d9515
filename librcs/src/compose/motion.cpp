#include "compose/motion.h"

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <string>

namespace rcs {
namespace {

const Mesh& mesh_of(const Scene& scene, std::size_t instance)
{
    return scene.meshes[static_cast<std::size_t>(scene.instances[instance].mesh)];
}

std::map<std::string, std::vector<int>> by_name(const Scene& scene)
{
    std::map<std::string, std::vector<int>> numbers;
    for (std::size_t i = 0; i < scene.instances.size(); ++i)
        numbers[scene.instances[i].name].push_back(static_cast<int>(i));
    return numbers;
}

/// Instances of one name follow each other in the same order in every pose, but a pose leaves out those that are scaled
/// to nothing: where their number differs, none is taken for another.
std::vector<int> same_instances(const Scene& here, const Scene& there)
{
    std::vector<int> found(here.instances.size(), -1);
    if (&here == &there) {
        std::iota(found.begin(), found.end(), 0);
        return found;
    }
    const std::map<std::string, std::vector<int>> others = by_name(there);
    for (const auto& [name, numbers] : by_name(here)) {
        const auto other = others.find(name);
        if (other == others.end() || other->second.size() != numbers.size()) continue;
        for (std::size_t k = 0; k < numbers.size(); ++k) {
            const auto i = static_cast<std::size_t>(numbers[k]), j = static_cast<std::size_t>(other->second[k]);
            if (mesh_of(here, i).positions.size() == mesh_of(there, j).positions.size()) found[i] = other->second[k];
        }
    }
    return found;
}

/// A triangle's corners in scene space. @param corners  of the mesh's positions
std::array<glm::dvec3, 3> place(const Scene& scene, std::size_t instance, glm::uvec3 corners)
{
    const glm::dmat4& matrix = scene.instances[instance].world_from_object;
    const std::vector<glm::vec3>& positions = mesh_of(scene, instance).positions;
    const auto at = [&](unsigned corner) { return glm::dvec3(matrix * glm::dvec4(positions[corner], 1.0)); };
    return {at(corners.x), at(corners.y), at(corners.z)};
}

/// Barycentric weights of the second and third corner at the triangle's point nearest to `p`, or about so.
glm::dvec2 weights_at(const std::array<glm::dvec3, 3>& c, glm::dvec3 p)
{
    const glm::dvec3 e1 = c[1] - c[0], e2 = c[2] - c[0], q = p - c[0];
    const glm::dvec3 n = glm::cross(e1, e2);
    const double nn = std::max(glm::dot(n, n), 1e-300);
    const double u = std::clamp(glm::dot(glm::cross(q, e2), n) / nn, 0.0, 1.0);
    return {u, std::clamp(glm::dot(glm::cross(e1, q), n) / nn, 0.0, 1.0 - u)};
}

glm::dvec3 point_at(const std::array<glm::dvec3, 3>& c, glm::dvec2 weights)
{
    return c[0] + weights.x * (c[1] - c[0]) + weights.y * (c[2] - c[0]);
}

// What moves farther lay in the other camera's plane, as good as behind it [px].
constexpr double kFarthest = 1e6;

/// From one place in the image to another; image rows count downwards, motion upwards.
std::optional<glm::dvec2> between(const std::optional<glm::dvec2>& then, const std::optional<glm::dvec2>& now)
{
    if (!then || !now) return std::nullopt;
    const glm::dvec2 moved(now->x - then->x, then->y - now->y);
    // Written so that NaN fails, too.
    return glm::length(moved) <= kFarthest ? std::optional(moved) : std::nullopt;
}

}  // namespace

Motion::Motion(const Scene& scene, const MotionFrom& from)
    : here_(scene), from_(from), instance_there_(same_instances(scene, other()))
{
}

Motion::Images Motion::images_of(const View& view) const
{
    const Camera& seen_by = pinhole_ ? *pinhole_ : view.camera;
    return {CameraRays(view), ImageProjection(view, seen_by), ImageProjection(view, from_.camera),
            camera_position(seen_by), camera_position(from_.camera)};
}

std::optional<glm::dvec2> Motion::of_surface(const GBuffer& g, const Images& images, std::size_t pixel) const
{
    const std::size_t instance = g.instance[pixel];
    if (instance_there_[instance] < 0) return std::nullopt;
    // By the numbers of the corners: a pose leaves out the triangles that are flat in it.
    const glm::uvec3 triangle = mesh_of(here_, instance).triangles[g.primitive[pixel]];
    const std::array<glm::dvec3, 3> here = place(here_, instance, triangle);
    const glm::dvec2 weights = weights_at(here, g.camera_position + glm::dvec3(g.position(pixel)));
    const std::array<glm::dvec3, 3> there =
        place(other(), static_cast<std::size_t>(instance_there_[instance]), triangle);
    // Both from the same arithmetic: what does not move does so by exactly 0.
    const auto now = images.now.position(point_at(here, weights) - images.eye_now);
    const auto then = images.then.position(point_at(there, weights) - images.eye_then);
    return between(then, now);
}

std::optional<glm::dvec2> Motion::of_sky(const Images& images, glm::dvec2 image_point)
{
    if (!images.rays.is_perspective() || !images.then.is_perspective()) return std::nullopt;
    const glm::dvec3 direction = images.rays.through(image_point.x, image_point.y).direction;
    return between(images.then.position(direction), images.now.position(direction));
}

}  // namespace rcs
