#include "scene/gltf_tangents.h"

#include <algorithm>
#include <cmath>
#include <vector>

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

/// How one triangle maps the texture.
struct Mapping {
    glm::dvec3 tangent{0.0};  ///< along u, of any length; 0 if the mapping has no area
    double w = 0.0;           ///< 0 if the mapping has no area
};

std::vector<Mapping> mappings_of(const Mesh& mesh, const std::vector<glm::vec2>& uvs,
                                 const glm::mat3x2& texture_from_uv)
{
    const glm::dmat3x2 matrix(texture_from_uv);
    std::vector<Mapping> mappings(mesh.triangles.size());
    for (std::size_t i = 0; i < mappings.size(); ++i) {
        const glm::uvec3 triangle = mesh.triangles[i];
        const auto edge = [&](int k) {
            return glm::dvec3(mesh.positions[triangle[k]]) - glm::dvec3(mesh.positions[triangle[0]]);
        };
        const auto uv_edge = [&](int k) {
            return matrix * glm::dvec3(glm::dvec2(uvs[triangle[k]]) - glm::dvec2(uvs[triangle[0]]), 0.0);
        };
        const glm::dvec2 d1 = uv_edge(1);
        const glm::dvec2 d2 = uv_edge(2);
        const double area = d1.x * d2.y - d2.x * d1.y;
        if (!(std::fabs(area) > 0.0) || !std::isfinite(area)) continue;
        mappings[i] = {(edge(1) * d2.y - edge(2) * d1.y) * (area < 0.0 ? -1.0 : 1.0), area < 0.0 ? 1.0 : -1.0};
    }
    return mappings;
}

/// Gives triangles of w = -1 vertices of their own where others have w = 1.
void split_vertices(Mesh& mesh, const std::vector<Mapping>& mappings)
{
    std::vector<bool> upright(mesh.positions.size(), false);
    for (std::size_t i = 0; i < mappings.size(); ++i) {
        if (mappings[i].w < 0.0) continue;
        for (int k = 0; k < 3; ++k) upright[mesh.triangles[i][k]] = true;
    }
    std::vector<std::uint32_t> twins(mesh.positions.size(), 0);  // 0: none, as 0 cannot be a new vertex
    for (std::size_t i = 0; i < mappings.size(); ++i) {
        if (mappings[i].w >= 0.0) continue;
        for (int k = 0; k < 3; ++k) {
            std::uint32_t& vertex = mesh.triangles[i][k];
            if (!upright[vertex]) continue;
            if (twins[vertex] == 0) {
                twins[vertex] = static_cast<std::uint32_t>(mesh.positions.size());
                for_each_attribute(mesh, [&](auto& array) {
                    const auto copy = array[vertex];
                    array.push_back(copy);
                });
            }
            vertex = twins[vertex];
        }
    }
}

double corner_angle(const Mesh& mesh, glm::uvec3 triangle, int corner)
{
    const glm::dvec3 p = mesh.positions[triangle[corner]];
    const glm::dvec3 a = glm::dvec3(mesh.positions[triangle[(corner + 1) % 3]]) - p;
    const glm::dvec3 b = glm::dvec3(mesh.positions[triangle[(corner + 2) % 3]]) - p;
    return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
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
    const std::vector<Mapping> mappings = mappings_of(mesh, uv_set == 0 ? mesh.uvs : mesh.uvs1, texture_from_uv);
    split_vertices(mesh, mappings);

    // Weighted by angle, each projected to the vertex's plane first, as MikkTSpace does.
    std::vector<glm::dvec3> sums(mesh.positions.size(), glm::dvec3(0.0));
    std::vector<float> signs(mesh.positions.size(), 1.0f);
    for (std::size_t i = 0; i < mappings.size(); ++i) {
        if (mappings[i].w == 0.0) continue;
        for (int k = 0; k < 3; ++k) {
            const std::uint32_t vertex = mesh.triangles[i][k];
            const glm::dvec3 normal = mesh.normals[vertex];
            const glm::dvec3 tangent = mappings[i].tangent - normal * glm::dot(normal, mappings[i].tangent);
            signs[vertex] = static_cast<float>(mappings[i].w);
            const double length = glm::length(tangent);
            if (length > 0.0) sums[vertex] += tangent * (corner_angle(mesh, mesh.triangles[i], k) / length);
        }
    }
    mesh.tangents.resize(mesh.positions.size());
    for (std::size_t i = 0; i < sums.size(); ++i) {
        const double length = glm::length(sums[i]);
        // Opposite tangents cancel down to rounding.
        const glm::dvec3 tangent = length > 1e-9 ? sums[i] / length : any_tangent(mesh.normals[i]);
        mesh.tangents[i] = glm::vec4(glm::vec3(tangent), signs[i]);
    }
}

}  // namespace rcs
