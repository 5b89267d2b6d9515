#include "rcs/scene.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>

#include <glm/gtc/constants.hpp>

#include "rcs/error.h"
#include "rcs/suggestion.h"
#include "scene/material_fields.h"
#include "scene/scene_parts.h"
#include "util/text.h"

namespace rcs {
namespace {

bool is_finite(glm::dvec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }
bool is_finite(const glm::dmat4& m)
{
    return is_finite(glm::dvec3(m[0])) && is_finite(glm::dvec3(m[1])) && is_finite(glm::dvec3(m[2])) &&
           is_finite(glm::dvec3(m[3]));
}
bool is_light(glm::vec3 v) { return is_finite(v) && v.x >= 0.0f && v.y >= 0.0f && v.z >= 0.0f; }
bool is_unit(glm::dvec3 v) { return std::fabs(glm::dot(v, v) - 1.0) < 1e-3; }  // floats, a few times rounded

/// "scene: material 3 'glass' ..."
struct Element {
    const Scene& scene;
    const char* kind;
    std::size_t index;
    const std::string& name;

    void expect(bool holds, const char* what) const
    {
        if (holds) return;
        throw Error(ErrorCode::bad_file,
                    "scene '" + scene.name + "': " + kind + " " + std::to_string(index) + " '" + name + "' " + what);
    }
};

template <class Elements>
bool is_index(int index, const Elements& elements)
{
    return index >= 0 && static_cast<std::size_t>(index) < elements.size();
}

void check(const Element& element, const Texture& texture)
{
    element.expect(!texture.levels.empty(), "has no texels");
    for (const Texture::Level& level : texture.levels) {
        element.expect(
            level.width > 0 && level.height > 0 &&
                level.texels.size() == static_cast<std::size_t>(level.width) * static_cast<std::size_t>(level.height),
            "has a level whose size is not its width x height");
    }
    element.expect(texture.levels.back().texels.size() == 1, "lacks its 1 x 1 level");
}

bool is_fraction(float value) { return value >= 0.0f && value <= 1.0f; }  // false for NaN

void check(const Element& element, const TextureSlot& slot)
{
    element.expect(slot.texture == -1 || is_index(slot.texture, element.scene.textures),
                   "names a texture that does not exist");
    element.expect(slot.uv_set == 0 || slot.uv_set == 1, "uses texture coordinates other than sets 0 and 1");
    for (int i = 0; i < 3; ++i) {
        element.expect(std::isfinite(slot.texture_from_uv[i].x) && std::isfinite(slot.texture_from_uv[i].y),
                       "has a texture transform that is not finite");
    }
}

void check(const Element& element, const Material& material)
{
    const auto has = [](const char* name, const std::string& what) { return std::string("has ") + name + " " + what; };
    for (const MaterialFactor& f : kMaterialFactors) {
        const double value = static_cast<double>(material.*f.value);
        if (f.most == 1.0)
            element.expect(value >= f.least && value <= 1.0, has(f.name, "outside [0, 1]").c_str());
        else
            element.expect(value >= f.least && std::isfinite(value),
                           has(f.name, std::isfinite(f.least) ? "below " + text("%g", f.least) + " or not finite"
                                                              : "that is not finite")
                               .c_str());
    }
    for (const MaterialColor& c : kMaterialColors) {
        const glm::vec3 color = material.*c.value;
        if (c.most == 1.0)
            element.expect(is_fraction(color.r) && is_fraction(color.g) && is_fraction(color.b),
                           has(c.name, "outside [0, 1]").c_str());
        else
            element.expect(is_light(color), has(c.name, "that is negative or not finite").c_str());
    }
    for (const MaterialTexture& t : kMaterialTextures) check(element, material.*t.slot);
}

void check_uvs(const Element& element, const std::vector<glm::vec2>& uvs, std::size_t vertices)
{
    element.expect(uvs.empty() || uvs.size() == vertices, "has not one uv per position");
    for (const glm::vec2& uv : uvs) {
        element.expect(std::isfinite(uv.x) && std::isfinite(uv.y), "has a uv that is not finite");
    }
}

void check(const Element& element, const Mesh& mesh)
{
    const std::size_t vertices = mesh.positions.size();
    element.expect(is_index(mesh.material, element.scene.materials), "names a material that does not exist");
    for (const glm::vec3& position : mesh.positions) {
        element.expect(is_finite(position), "has a position that is not finite");
    }
    element.expect(mesh.normals.empty() || mesh.normals.size() == vertices, "has not one normal per position");
    for (const glm::vec3& normal : mesh.normals) element.expect(is_unit(normal), "has a normal that is no unit vector");
    check_uvs(element, mesh.uvs, vertices);
    check_uvs(element, mesh.uvs1, vertices);
    element.expect(mesh.colors.empty() || mesh.colors.size() == vertices, "has not one colour per position");
    for (const glm::vec4& color : mesh.colors) {
        element.expect(is_fraction(color.r) && is_fraction(color.g) && is_fraction(color.b) && is_fraction(color.a),
                       "has a vertex colour outside [0, 1]");
    }
    element.expect(mesh.tangents.empty() || mesh.tangents.size() == vertices, "has not one tangent per position");
    for (const glm::vec4& tangent : mesh.tangents) {
        element.expect(is_unit(glm::vec3(tangent)) && std::fabs(tangent.w) == 1.0f,
                       "has a tangent that is no unit vector with w = -1 or 1");
    }
    for (const glm::uvec3& triangle : mesh.triangles) {
        element.expect(triangle.x < vertices && triangle.y < vertices && triangle.z < vertices,
                       "has a triangle that names a vertex that does not exist");
    }
}

void check(const Element& element, const Instance& instance)
{
    element.expect(is_index(instance.mesh, element.scene.meshes), "names a mesh that does not exist");
    element.expect(is_finite(instance.world_from_object), "has a matrix that is not finite");
}

void check(const Element& element, const PunctualLight& light)
{
    element.expect(is_light(light.intensity), "has an intensity that is negative or not finite");
    element.expect(is_finite(light.position), "has a position that is not finite");
    element.expect(is_unit(light.direction), "has a direction that is no unit vector");
    element.expect(light.range > 0.0f, "has a range that is not above 0");
    element.expect(light.kind != LightKind::spot ||
                       (light.inner_cone >= 0.0f && light.inner_cone < light.outer_cone &&
                        light.outer_cone <= glm::half_pi<float>() + 1e-6f),  // pi/2 as the nearest float
                   "has cone angles that are not 0 <= inner < outer <= pi/2");
}

void check(const Element& element, const Camera& camera)
{
    const glm::dmat4& matrix = camera.world_from_view;
    element.expect(is_finite(matrix), "has a matrix that is not finite");
    element.expect(is_unit(glm::dvec3(matrix[0])) && is_unit(glm::dvec3(matrix[1])) && is_unit(glm::dvec3(matrix[2])),
                   "has a matrix that scales");
    if (camera.projection == Projection::perspective) {
        element.expect(camera.yfov > 0.0 && camera.yfov < glm::pi<double>(), "has a yfov outside (0, pi)");
    } else {
        element.expect(camera.ymag > 0.0 && std::isfinite(camera.ymag), "has a ymag that is not above 0");
    }
    const glm::dvec2 shift = glm::abs(camera.lens_shift);
    element.expect(shift.x <= kMostLensShift && shift.y <= kMostLensShift, "has a lens_shift outside [-10, 10]");
}

void check(const Scene& scene, const EnvironmentImage& image)
{
    const auto expect = [&](bool holds, const char* what) {
        if (!holds)
            throw Error(ErrorCode::bad_file, "scene '" + scene.name + "': environment '" + image.name + "' " + what);
    };
    if (image.empty()) return;
    expect(image.width > 0 && image.height > 0 &&
               image.radiance.size() == static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height),
           "has a size that is not its width x height");
    expect(std::all_of(image.radiance.begin(), image.radiance.end(), is_light),
           "has a radiance that is negative or not finite");
    expect(std::isfinite(image.rotation), "has a rotation that is not finite");
}

template <class Elements>
void check_all(const Scene& scene, const char* kind, const Elements& elements)
{
    for (std::size_t i = 0; i < elements.size(); ++i) {
        check(Element{scene, kind, i, elements[i].name}, elements[i]);
    }
}

}  // namespace

const Camera& find_camera(const Scene& scene, const std::string& name_or_number)
{
    if (name_or_number.empty() && !scene.cameras.empty()) return scene.cameras.front();
    for (const Camera& camera : scene.cameras) {
        if (camera.name == name_or_number) return camera;
    }
    std::size_t number = 0;
    const char* end = name_or_number.data() + name_or_number.size();
    const auto [rest, problem] = std::from_chars(name_or_number.data(), end, number);
    if (problem == std::errc() && rest == end && number < scene.cameras.size()) return scene.cameras[number];

    std::string list;
    std::vector<std::string> names;
    for (const Camera& camera : scene.cameras) {
        list += (list.empty() ? "" : ", ") + camera.name;
        names.push_back(camera.name);
    }
    throw Error(ErrorCode::not_found, "camera '" + name_or_number + "' does not exist in scene '" + scene.name +
                                          "'; it has " + (list.empty() ? "none" : list) +
                                          did_you_mean(name_or_number, names));
}

void validate(const Scene& scene)
{
    check_all(scene, "texture", scene.textures);
    check_all(scene, "material", scene.materials);
    check_all(scene, "mesh", scene.meshes);
    check_all(scene, "instance", scene.instances);
    check_all(scene, "light", scene.lights);
    check_all(scene, "camera", scene.cameras);
    check(scene, scene.environment);
    if (!is_light(scene.sky_radiance)) {
        throw Error(ErrorCode::bad_file, "scene '" + scene.name + "': its sky radiance is negative or not finite");
    }
}

Bounds bounds_of(const Scene& scene, std::size_t instance)
{
    const glm::dmat4& matrix = scene.instances[instance].world_from_object;
    const Mesh& mesh = scene.meshes[static_cast<std::size_t>(scene.instances[instance].mesh)];
    Bounds bounds;
    // By triangles, as a vertex that none uses is not there to be seen.
    for (const glm::uvec3 triangle : mesh.triangles) {
        for (int i = 0; i < 3; ++i) {
            const glm::dvec3 p = matrix * glm::dvec4(mesh.positions[triangle[i]], 1.0);
            bounds.min = glm::min(bounds.min, p);
            bounds.max = glm::max(bounds.max, p);
        }
    }
    return bounds;
}

Bounds bounds_of(const Scene& scene)
{
    Bounds bounds;
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        const Bounds of_one = bounds_of(scene, i);
        bounds.min = glm::min(bounds.min, of_one.min);
        bounds.max = glm::max(bounds.max, of_one.max);
    }
    return bounds;
}

void move_origin(Scene& scene)
{
    constexpr double kFar = 16.0;  // diagonals; costs four bits of the 24 that a float has
    const Bounds bounds = bounds_of(scene);
    if (bounds.min.x > bounds.max.x) return;
    const glm::dvec3 centre = 0.5 * (bounds.min + bounds.max);
    if (glm::length(centre) <= kFar * glm::length(bounds.max - bounds.min)) return;
    scene.origin += centre;
    const auto move = [&](glm::dmat4& matrix) { matrix[3] -= glm::dvec4(centre, 0.0); };
    for (Instance& instance : scene.instances) move(instance.world_from_object);
    for (Camera& camera : scene.cameras) move(camera.world_from_view);
    for (PunctualLight& light : scene.lights) light.position -= centre;
}

}  // namespace rcs
