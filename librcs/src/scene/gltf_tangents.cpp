#include "scene/gltf_tangents.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <tuple>
#include <vector>

#include "scene/mikktspace.h"

namespace rcs {
namespace {

/// Calls apply(array) for every attribute that the mesh has.
template <class Apply>
void for_each_attribute(Mesh& mesh, const Apply& apply)
{
    const auto unless_empty = [&](auto& array) {
        if (!array.empty()) apply(array);
    };
    unless_empty(mesh.positions);
    unless_empty(mesh.normals);
    unless_empty(mesh.uvs);
    unless_empty(mesh.uvs1);
    unless_empty(mesh.colors);
    unless_empty(mesh.tangents);
}

void give_face_normals(Mesh& mesh)
{
    for_each_attribute(mesh, [&](auto& array) {
        std::remove_reference_t<decltype(array)> corners;
        corners.reserve(3 * mesh.triangles.size());
        for (const glm::uvec3 triangle : mesh.triangles) {
            for (int i = 0; i < 3; ++i) corners.push_back(array[triangle[i]]);
        }
        array = std::move(corners);
    });
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        mesh.triangles[i] = {3 * i, 3 * i + 1, 3 * i + 2};
        const glm::dvec3 a = mesh.positions[3 * i];
        const glm::dvec3 normal =
            glm::cross(glm::dvec3(mesh.positions[3 * i + 1]) - a, glm::dvec3(mesh.positions[3 * i + 2]) - a);
        mesh.normals.insert(mesh.normals.end(), 3, glm::vec3(glm::normalize(normal)));
    }
}

/// Gives each corner a vertex that has its tangent: the one it had, or a copy.
void split_vertices(Mesh& mesh, const std::vector<glm::vec4>& tangents)
{
    const auto vertex_of = [&](std::uint32_t corner) -> std::uint32_t& {
        return mesh.triangles[corner / 3][static_cast<int>(corner % 3)];
    };
    const auto less = [](glm::vec4 a, glm::vec4 b) {
        return std::tie(a.x, a.y, a.z, a.w) < std::tie(b.x, b.y, b.z, b.w);
    };
    std::vector<std::uint32_t> corners(tangents.size());
    std::iota(corners.begin(), corners.end(), 0u);
    std::sort(corners.begin(), corners.end(), [&](std::uint32_t a, std::uint32_t b) {
        if (vertex_of(a) != vertex_of(b)) return vertex_of(a) < vertex_of(b);
        return tangents[a] != tangents[b] ? less(tangents[a], tangents[b]) : a < b;
    });
    std::vector<glm::vec4> given(mesh.positions.size(), glm::vec4(0.0f));  // 0: to a vertex without a triangle
    std::uint32_t last = 0, current = 0;  // the vertex of the corner before, and what became of it
    for (std::size_t i = 0; i < corners.size(); ++i) {
        std::uint32_t& vertex = vertex_of(corners[i]);
        if (i == 0 || vertex != last) {
            last = current = vertex;
        } else if (tangents[corners[i]] != given[current]) {
            current = static_cast<std::uint32_t>(given.size());
            given.emplace_back(0.0f);
            for_each_attribute(mesh, [&](auto& array) {
                const auto copy = array[last];
                array.push_back(copy);
            });
        }
        given[current] = tangents[corners[i]];
        vertex = current;
    }
    mesh.tangents = std::move(given);
}

}  // namespace

glm::dvec3 any_tangent(glm::dvec3 normal)
{
    const glm::dvec3 axis = std::fabs(normal.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    return glm::normalize(axis - normal * glm::dot(normal, axis));
}

void make_tangents(Mesh& mesh, int uv_set, const glm::mat3x2& texture_from_uv)
{
    if (mesh.normals.empty()) give_face_normals(mesh);
    std::vector<glm::vec2> uvs = uv_set == 0 ? mesh.uvs : mesh.uvs1;
    for (glm::vec2& uv : uvs) {
        uv = texture_from_uv * glm::vec3(uv, 1.0f);
        uv.y = -uv.y;  // glTF's v points down
    }
    mesh.tangents.clear();
    split_vertices(mesh, mikktspace(mesh, uvs));
    for (std::size_t i = 0; i < mesh.tangents.size(); ++i) {
        const glm::vec4 made = mesh.tangents[i];
        const glm::dvec3 tangent = glm::vec3(made) != glm::vec3(0.0f) ? glm::dvec3(made) : any_tangent(mesh.normals[i]);
        mesh.tangents[i] = glm::vec4(glm::vec3(glm::normalize(tangent)), made.w < 0.0f ? -1.0f : 1.0f);
    }
}

}  // namespace rcs
