#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <glm/glm.hpp>

#include "rcs/camera.h"
#include "rcs/scene.h"

/// Small scenes built by hand, whose light can be computed with pencil and paper.
namespace rcs::stability {

/// @return its index
inline int add_material(Scene& scene, glm::vec3 albedo, glm::vec3 emission = glm::vec3(0.0f), bool double_sided = false)
{
    Material material;
    material.name = "material " + std::to_string(scene.materials.size());
    material.base_color = albedo;
    material.emission = emission;
    material.double_sided = double_sided;
    scene.materials.push_back(material);
    return static_cast<int>(scene.materials.size()) - 1;
}

/// Metal, or a dielectric of index 1.5, seen from both sides.
inline Material glossy(float metallic, float roughness, glm::vec3 color)
{
    Material material;
    material.base_color = color;
    material.metallic = metallic;
    material.roughness = roughness;
    material.specular = 1.0f;
    material.double_sided = true;
    return material;
}

inline int add_material(Scene& scene, const Material& material)
{
    scene.materials.push_back(material);
    return static_cast<int>(scene.materials.size()) - 1;
}

/// Adds the mesh with one instance of it.
inline void add_mesh(Scene& scene, Mesh mesh, const glm::dmat4& world_from_object = glm::dmat4(1.0))
{
    Instance instance;
    instance.name = mesh.name;
    instance.mesh = static_cast<int>(scene.meshes.size());
    instance.world_from_object = world_from_object;
    scene.meshes.push_back(std::move(mesh));
    scene.instances.push_back(instance);
}

/// Two triangles; the front is where cross(edge_u, edge_v) points.
inline Mesh quad(glm::vec3 corner, glm::vec3 edge_u, glm::vec3 edge_v, int material)
{
    Mesh mesh;
    mesh.name = "quad";
    mesh.positions = {corner, corner + edge_u, corner + edge_u + edge_v, corner + edge_v};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    mesh.material = material;
    return mesh;
}

/// Appends b's triangles to a.
inline void merge(Mesh& a, const Mesh& b)
{
    const auto first = static_cast<std::uint32_t>(a.positions.size());
    a.positions.insert(a.positions.end(), b.positions.begin(), b.positions.end());
    a.normals.insert(a.normals.end(), b.normals.begin(), b.normals.end());
    for (const glm::uvec3 t : b.triangles) a.triangles.push_back(t + glm::uvec3(first));
}

enum class Facing { outwards, inwards };

/// The six faces of a box, flat shaded.
inline Mesh box(glm::vec3 low, glm::vec3 high, int material, Facing facing = Facing::outwards)
{
    Mesh mesh;
    for (int axis = 0; axis < 3; ++axis) {
        glm::vec3 u(0.0f), v(0.0f);
        const int i = (axis + 1) % 3;
        const int j = (axis + 2) % 3;
        u[i] = high[i] - low[i];
        v[j] = high[j] - low[j];
        if (facing == Facing::inwards) std::swap(u, v);
        glm::vec3 far_corner = low;
        far_corner[axis] = high[axis];
        merge(mesh, quad(far_corner, u, v, material));  // cross(e_i, e_j) = e_axis
        merge(mesh, quad(low, v, u, material));
    }
    mesh.name = "box";
    mesh.material = material;
    return mesh;
}

/// A sphere of 20 x 4^subdivisions triangles, its corners on the sphere; smooth shaded.
/// Radii of the facets fall short of `radius` by 1.3 % at 2 subdivisions, 0.09 % at 4 (largest).
inline Mesh icosphere(glm::vec3 centre, float radius, int subdivisions, int material, Facing facing = Facing::outwards)
{
    const float g = 0.5f * (1.0f + std::sqrt(5.0f));  // golden ratio
    Mesh mesh;
    mesh.name = "icosphere";
    mesh.material = material;
    mesh.normals = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                    {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
    for (glm::vec3& n : mesh.normals) n = glm::normalize(n);
    mesh.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                      {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                      {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
    for (int level = 0; level < subdivisions; ++level) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [entry, is_new] =
                middles.try_emplace({std::min(a, b), std::max(a, b)}, static_cast<std::uint32_t>(mesh.normals.size()));
            if (is_new) mesh.normals.push_back(glm::normalize(mesh.normals[a] + mesh.normals[b]));
            return entry->second;
        };
        std::vector<glm::uvec3> finer;
        for (const glm::uvec3 t : mesh.triangles) {
            const std::uint32_t ab = middle(t.x, t.y);
            const std::uint32_t bc = middle(t.y, t.z);
            const std::uint32_t ca = middle(t.z, t.x);
            finer.insert(finer.end(), {{t.x, ab, ca}, {t.y, bc, ab}, {t.z, ca, bc}, {ab, bc, ca}});
        }
        mesh.triangles = std::move(finer);
    }
    for (const glm::vec3 n : mesh.normals) mesh.positions.push_back(centre + radius * n);
    if (facing == Facing::inwards) {
        for (glm::uvec3& t : mesh.triangles) std::swap(t.y, t.z);
        for (glm::vec3& n : mesh.normals) n = -n;
    }
    return mesh;
}

inline PunctualLight point_light(glm::dvec3 position, glm::vec3 intensity)
{
    PunctualLight light;
    light.name = "point";
    light.intensity = intensity;
    light.position = position;
    return light;
}

inline View view_of(const Camera& camera, int width, int height)
{
    View view;
    view.camera = camera;
    view.width = width;
    view.height = height;
    return view;
}

/// A convex body under a constant sky (stability catalogue A1): irradiance pi L everywhere.
inline Scene furnace(float albedo, float sky)
{
    Scene scene;
    add_mesh(scene, icosphere(glm::vec3(0.0f), 1.0f, 4, add_material(scene, glm::vec3(albedo))));
    scene.sky_radiance = glm::vec3(sky);
    scene.cameras = {look_at_camera("camera", {0.0, 0.0, 3.0}, {0.0, 0.0, 0.0}, 0.8)};
    return scene;
}

/// A closed room whose walls all emit and reflect (A2); the camera stands inside, off centre.
inline Scene emissive_box(float albedo, float emission)
{
    Scene scene;
    const int wall = add_material(scene, glm::vec3(albedo), glm::vec3(emission));
    add_mesh(scene, box({-1.0f, -0.75f, -1.5f}, {1.0f, 0.75f, 1.5f}, wall, Facing::inwards));
    scene.cameras = {look_at_camera("camera", {0.3, -0.2, 1.1}, {-0.2, 0.1, -1.0}, 1.4)};
    return scene;
}

/// A closed sphere of radius 2 with a point light of intensity 1 W/sr at its centre (A3).
inline Scene lit_sphere(float albedo)
{
    Scene scene;
    const int wall = add_material(scene, glm::vec3(albedo));
    add_mesh(scene, icosphere(glm::vec3(0.0f), 2.0f, 5, wall, Facing::inwards));
    scene.lights = {point_light({0.0, 0.0, 0.0}, glm::vec3(1.0f))};
    scene.cameras = {look_at_camera("camera", {0.4, 0.3, 0.5}, {0.0, 0.0, -2.0}, 1.2)};
    return scene;
}

/// A floor of albedo 1 at y = 0 under a parallel square lamp of side 2 and radiance 1 at height 1 (A4),
/// seen by an orthographic camera just below the lamp: the image spans x and z in [-1, 1].
inline Scene square_lamp()
{
    Scene scene;
    const int floor = add_material(scene, glm::vec3(1.0f));
    const int lamp = add_material(scene, glm::vec3(0.0f), glm::vec3(1.0f));
    add_mesh(scene, quad({-4.0f, 0.0f, -4.0f}, {0.0f, 0.0f, 8.0f}, {8.0f, 0.0f, 0.0f}, floor));
    add_mesh(scene, quad({-1.0f, 1.0f, -1.0f}, {2.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 2.0f}, lamp));
    Camera camera = look_at_camera("camera", {0.0, 0.9, 0.0}, {0.0, 0.0, 0.0}, 0.8, {0.0, 0.0, -1.0});
    camera.projection = Projection::orthographic;
    camera.ymag = 1.0;
    scene.cameras = {camera};
    return scene;
}

/// Irradiance from a parallel rectangle of radiance 1 that spans [x0, x1] x [z0, z1] at height h over
/// the point: the closed form of Lambert's integral for a corner, four times.
inline double rectangle_irradiance(double x0, double x1, double z0, double z1, double h)
{
    const auto corner = [h](double a, double b) {
        const double ra = std::hypot(a, h);
        const double rb = std::hypot(b, h);
        return 0.5 * (a / ra * std::atan(b / ra) + b / rb * std::atan(a / rb));
    };
    return corner(x1, z1) - corner(x0, z1) - corner(x1, z0) + corner(x0, z0);
}

/// Irradiance at distance d from the corner between a floor and a wall of radiance 1, of height h and
/// far longer than h: Lambert's pi (1 - cos(elevation of the wall's top)) / 2.
inline double wall_irradiance(double d, double h) { return 0.5 * std::numbers::pi * (1.0 - d / std::hypot(d, h)); }

/// Floor and wall at a right angle (A5). The wall, 2 m high and 400 m long, is lit by a sun so low
/// that the floor gets nothing of it, and reflects radiance 1. Its own back and the floor's are dark.
/// An orthographic camera sees the floor from the corner to 2 m away: x is the distance to the wall.
inline Scene lit_corner()
{
    Scene scene;
    const int floor = add_material(scene, glm::vec3(0.5f));
    const int wall = add_material(scene, glm::vec3(0.5f));
    add_mesh(scene, quad({0.0f, 0.0f, -200.0f}, {0.0f, 0.0f, 400.0f}, {100.0f, 0.0f, 0.0f}, floor));
    add_mesh(scene, quad({0.0f, 0.0f, -200.0f}, {0.0f, 2.0f, 0.0f}, {0.0f, 0.0f, 400.0f}, wall));
    PunctualLight sun;
    sun.name = "sun";
    sun.kind = LightKind::directional;
    sun.direction = {-1.0, 0.0, 0.0};
    sun.intensity = glm::vec3(2.0f * std::numbers::pi_v<float>);  // albedo / pi * E = 1
    scene.lights = {sun};
    Camera camera = look_at_camera("camera", {1.0, 1.5, 0.0}, {1.0, 0.0, 0.0}, 0.8, {0.0, 0.0, -1.0});
    camera.projection = Projection::orthographic;
    camera.ymag = 1.0;
    scene.cameras = {camera};
    return scene;
}

/// A room with shadows and colours: a box on the floor of another, a square lamp and a point light.
inline Scene furnished_room()
{
    Scene scene;
    const int wall = add_material(scene, {0.7f, 0.6f, 0.5f});
    const int block = add_material(scene, {0.3f, 0.5f, 0.8f});
    const int lamp = add_material(scene, glm::vec3(0.0f), {6.0f, 5.0f, 4.0f});
    add_mesh(scene, box({-2, 0, -2}, {2, 3, 2}, wall, Facing::inwards));
    add_mesh(scene, box({-0.8f, 0.0f, -0.9f}, {0.2f, 1.2f, 0.3f}, block));
    add_mesh(scene, quad({-0.5f, 2.9f, -0.5f}, {1, 0, 0}, {0, 0, 1}, lamp));
    scene.lights = {point_light({1.2, 2.2, 0.8}, {0.5f, 0.5f, 1.0f})};
    scene.cameras = {look_at_camera("camera", {1.2, 1.6, 1.8}, {-0.3, 0.8, -0.5}, 1.1)};
    return scene;
}

}  // namespace rcs::stability
