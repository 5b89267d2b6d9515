#pragma once

#include <span>
#include <string>

#include <glm/glm.hpp>

#include "rcs/scene.h"

namespace rcs {

// Shapes of the scenes made in code. Each appends to a mesh that has normals and uvs; uvs are metres
// along the surface (of flat shapes: along the two axes that the normal is farthest from).

/// Corners counter-clockwise as seen from the front.
void add_quad(Mesh& mesh, glm::vec3 a, glm::vec3 b, glm::vec3 c, glm::vec3 d);

/// Faces outwards.
void add_box(Mesh& mesh, glm::vec3 min, glm::vec3 max);

/// Turns a profile of (radius, height) points, from bottom to top, about the Y axis. Smooth around the
/// axis, sharp from one piece of the profile to the next.
void add_lathe(Mesh& mesh, std::span<const glm::vec2> profile, int segments);

/// A sphere about the origin from an icosahedron, each triangle split in four `levels` times, its
/// vertices on the sphere. @param outwards  which way it faces
void add_sphere(Mesh& mesh, float radius, int levels, bool outwards);

/// A surface p(s, t), s and t in [0, 1], with smooth normals; its front is where dp/ds x dp/dt points.
template <class Point>
void add_grid(Mesh& mesh, int columns, int rows, const Point& point)
{
    const auto first = static_cast<unsigned>(mesh.positions.size());
    constexpr float kStep = 1e-3f;  // of the differences that give the normal
    for (int j = 0; j <= rows; ++j) {
        for (int i = 0; i <= columns; ++i) {
            const float s = static_cast<float>(i) / static_cast<float>(columns);
            const float t = static_cast<float>(j) / static_cast<float>(rows);
            const glm::vec3 ds = point(s + kStep, t) - point(s - kStep, t);
            const glm::vec3 dt = point(s, t + kStep) - point(s, t - kStep);
            mesh.positions.push_back(point(s, t));
            mesh.normals.push_back(glm::normalize(glm::cross(ds, dt)));
            mesh.uvs.push_back({s, t});
        }
    }
    const auto stride = static_cast<unsigned>(columns) + 1;
    for (unsigned j = 0; j < static_cast<unsigned>(rows); ++j) {
        for (unsigned i = 0; i < static_cast<unsigned>(columns); ++i) {
            const unsigned at = first + j * stride + i;
            mesh.triangles.push_back({at, at + 1, at + stride + 1});
            mesh.triangles.push_back({at, at + stride + 1, at + stride});
        }
    }
}

/// @return its index
int add_material(Scene& scene, const std::string& name, glm::vec3 base_color, glm::vec3 emission = glm::vec3(0.0f));
int add_mesh(Scene& scene, const std::string& name, int material, Mesh mesh);
void add_instance(Scene& scene, const std::string& name, int mesh,
                  const glm::dmat4& world_from_object = glm::dmat4(1.0));

/// A mesh that stands where it was made, with one instance.
void add_object(Scene& scene, const std::string& name, int material, Mesh mesh);

}  // namespace rcs
