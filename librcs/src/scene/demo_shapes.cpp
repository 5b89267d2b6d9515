#include "scene/demo_shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <glm/gtc/constants.hpp>

namespace rcs {
namespace {

glm::vec2 planar_uv(glm::vec3 p, glm::vec3 normal)
{
    const glm::vec3 n = glm::abs(normal);
    if (n.y >= n.x && n.y >= n.z) return {p.x, p.z};
    // v grows downwards, as a picture's rows do.
    return n.x >= n.z ? glm::vec2(p.z, -p.y) : glm::vec2(p.x, -p.y);
}

unsigned add_vertex(Mesh& mesh, glm::vec3 position, glm::vec3 normal, glm::vec2 uv)
{
    mesh.positions.push_back(position);
    mesh.normals.push_back(normal);
    mesh.uvs.push_back(uv);
    return static_cast<unsigned>(mesh.positions.size() - 1);
}

struct Triangle {
    glm::vec3 a, b, c;  ///< on the unit sphere
};

std::vector<Triangle> icosahedron()
{
    const float g = 0.5f * (1.0f + std::sqrt(5.0f));  // golden ratio: corners (0, +-1, +-g) and their turns
    const std::array<glm::vec3, 12> p = {{{-1, g, 0},
                                          {1, g, 0},
                                          {-1, -g, 0},
                                          {1, -g, 0},
                                          {0, -1, g},
                                          {0, 1, g},
                                          {0, -1, -g},
                                          {0, 1, -g},
                                          {g, 0, -1},
                                          {g, 0, 1},
                                          {-g, 0, -1},
                                          {-g, 0, 1}}};
    constexpr std::array<std::array<int, 3>, 20> faces = {{{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                                           {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                                           {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                                           {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}}};
    std::vector<Triangle> triangles;
    for (const auto& face : faces) {
        const auto corner = [&](std::size_t i) { return glm::normalize(p[static_cast<std::size_t>(face[i])]); };
        triangles.push_back({corner(0), corner(1), corner(2)});
    }
    return triangles;
}

std::vector<Triangle> split_in_four(const std::vector<Triangle>& triangles)
{
    std::vector<Triangle> finer;
    finer.reserve(4 * triangles.size());
    for (const Triangle& t : triangles) {
        const glm::vec3 ab = glm::normalize(t.a + t.b);
        const glm::vec3 bc = glm::normalize(t.b + t.c);
        const glm::vec3 ca = glm::normalize(t.c + t.a);
        finer.insert(finer.end(), {{t.a, ab, ca}, {ab, t.b, bc}, {ca, bc, t.c}, {ab, bc, ca}});
    }
    return finer;
}

}  // namespace

void add_quad(Mesh& mesh, glm::vec3 a, glm::vec3 b, glm::vec3 c, glm::vec3 d)
{
    const glm::vec3 normal = glm::normalize(glm::cross(c - a, d - b));
    const unsigned first = add_vertex(mesh, a, normal, planar_uv(a, normal));
    for (const glm::vec3 p : {b, c, d}) add_vertex(mesh, p, normal, planar_uv(p, normal));
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 3});
}

void add_box(Mesh& mesh, glm::vec3 min, glm::vec3 max)
{
    const auto at = [&](int x, int y, int z) {
        return glm::vec3(x ? max.x : min.x, y ? max.y : min.y, z ? max.z : min.z);
    };
    add_quad(mesh, at(0, 0, 1), at(1, 0, 1), at(1, 1, 1), at(0, 1, 1));
    add_quad(mesh, at(1, 0, 0), at(0, 0, 0), at(0, 1, 0), at(1, 1, 0));
    add_quad(mesh, at(1, 0, 1), at(1, 0, 0), at(1, 1, 0), at(1, 1, 1));
    add_quad(mesh, at(0, 0, 0), at(0, 0, 1), at(0, 1, 1), at(0, 1, 0));
    add_quad(mesh, at(0, 1, 1), at(1, 1, 1), at(1, 1, 0), at(0, 1, 0));
    add_quad(mesh, at(0, 0, 0), at(1, 0, 0), at(1, 0, 1), at(0, 0, 1));
}

void add_lathe(Mesh& mesh, std::span<const glm::vec2> profile, int segments)
{
    for (std::size_t piece = 0; piece + 1 < profile.size(); ++piece) {
        const glm::vec2 low = profile[piece];
        const glm::vec2 high = profile[piece + 1];
        const glm::vec2 outwards = glm::normalize(glm::vec2(high.y - low.y, low.x - high.x));
        const auto first = static_cast<unsigned>(mesh.positions.size());
        for (int i = 0; i <= segments; ++i) {
            const float angle = glm::two_pi<float>() * static_cast<float>(i) / static_cast<float>(segments);
            // The last ring of vertices is the first again, bit by bit.
            const float c = i == segments ? 1.0f : std::cos(angle);
            const float s = i == segments ? 0.0f : std::sin(angle);
            const glm::vec3 normal(outwards.x * c, outwards.y, -outwards.x * s);
            const float around = angle * std::max(low.x, high.x);
            add_vertex(mesh, {low.x * c, low.y, -low.x * s}, normal, {around, -low.y});
            add_vertex(mesh, {high.x * c, high.y, -high.x * s}, normal, {around, -high.y});
        }
        for (unsigned i = 0; i < static_cast<unsigned>(segments); ++i) {
            const unsigned at = first + 2 * i;
            if (low.x > 0.0f) mesh.triangles.push_back({at, at + 2, at + 3});
            if (high.x > 0.0f) mesh.triangles.push_back({at, at + 3, at + 1});
        }
    }
}

void add_sphere(Mesh& mesh, float radius, int levels, bool outwards)
{
    std::vector<Triangle> triangles = icosahedron();
    for (int level = 0; level < levels; ++level) triangles = split_in_four(triangles);
    for (const Triangle& t : triangles) {
        const auto vertex = [&](glm::vec3 direction) {
            return add_vertex(mesh, radius * direction, outwards ? direction : -direction, {0.0f, 0.0f});
        };
        const unsigned a = vertex(t.a);
        const unsigned b = vertex(outwards ? t.b : t.c);
        const unsigned c = vertex(outwards ? t.c : t.b);
        mesh.triangles.push_back({a, b, c});
    }
}

int add_material(Scene& scene, const std::string& name, glm::vec3 base_color, glm::vec3 emission)
{
    Material material;
    material.name = name;
    material.base_color = base_color;
    material.emission = emission;
    scene.materials.push_back(std::move(material));
    return static_cast<int>(scene.materials.size() - 1);
}

int add_mesh(Scene& scene, const std::string& name, int material, Mesh mesh)
{
    mesh.name = name;
    mesh.material = material;
    scene.meshes.push_back(std::move(mesh));
    return static_cast<int>(scene.meshes.size() - 1);
}

void add_instance(Scene& scene, const std::string& name, int mesh, const glm::dmat4& world_from_object)
{
    scene.instances.push_back({name, mesh, world_from_object});
}

void add_object(Scene& scene, const std::string& name, int material, Mesh mesh)
{
    add_instance(scene, name, add_mesh(scene, name, material, std::move(mesh)));
}

}  // namespace rcs
