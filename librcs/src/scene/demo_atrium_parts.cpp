#include "scene/demo_atrium_parts.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <glm/gtc/constants.hpp>

#include "scene/demo_shapes.h"

namespace rcs {

void scale_uvs(Mesh& mesh, float repeats_per_metre)
{
    for (glm::vec2& uv : mesh.uvs) uv *= repeats_per_metre;
}

Mesh column_mesh(float radius, float height)
{
    const float r = radius;
    const std::array<glm::vec2, 12> profile = {{{1.32f * r, 0.14f},
                                                {1.42f * r, 0.18f},
                                                {1.42f * r, 0.23f},
                                                {1.22f * r, 0.28f},
                                                {1.10f * r, 0.30f},
                                                {1.00f * r, 0.36f},
                                                {0.97f * r, 0.40f * height},
                                                {0.86f * r, height - 0.42f},
                                                {1.02f * r, height - 0.40f},
                                                {1.02f * r, height - 0.35f},
                                                {0.92f * r, height - 0.33f},
                                                {1.45f * r, height - 0.12f}}};
    Mesh mesh;
    add_lathe(mesh, profile, 16);
    const float plinth = 1.5f * r;
    add_box(mesh, {-plinth, 0.0f, -plinth}, {plinth, 0.14f, plinth});
    add_box(mesh, {-plinth, height - 0.12f, -plinth}, {plinth, height, plinth});
    return mesh;
}

Mesh arch_mesh(const Storey& storey)
{
    constexpr int kSegments = 14;
    constexpr float kArchRadius = 1.2f;
    constexpr float kHalfThickness = 0.26f;
    const float half = 0.5f * kBay;
    const float z = kHalfThickness;
    const float top = storey.top;
    Mesh mesh;
    const auto on_arch = [&](float t, float depth) {
        const float angle = glm::pi<float>() * (1.0f - t);
        return glm::vec3(kArchRadius * std::cos(angle), storey.spring + kArchRadius * std::sin(angle), depth);
    };
    add_grid(mesh, kSegments, 1, [&](float s, float t) { return on_arch(s, z * (2.0f * t - 1.0f)); });
    for (int i = 0; i < kSegments; ++i) {
        const float t0 = static_cast<float>(i) / kSegments;
        const float t1 = static_cast<float>(i + 1) / kSegments;
        const glm::vec3 a = on_arch(t0, z);
        const glm::vec3 b = on_arch(t1, z);
        const glm::vec3 back(0.0f, 0.0f, -2.0f * z);
        add_quad(mesh, a, b, {b.x, top, z}, {a.x, top, z});
        add_quad(mesh, b + back, a + back, {a.x, top, -z}, {b.x, top, -z});
    }
    for (const float side : {-1.0f, 1.0f}) {  // what stands on the columns, beside the arch
        const float inner = side * kArchRadius;
        add_box(mesh, {std::min(inner, side * half), storey.spring, -z}, {std::max(inner, side * half), top, z});
    }
    scale_uvs(mesh, 0.5f);
    return mesh;
}

Mesh balustrade_mesh()
{
    constexpr int kBalusters = 6;
    const std::array<glm::vec2, 5> profile = {
        {{0.045f, 0.10f}, {0.075f, 0.28f}, {0.035f, 0.52f}, {0.05f, 0.60f}, {0.05f, 0.78f}}};
    Mesh baluster;
    add_lathe(baluster, profile, 6);
    Mesh mesh;
    const float half = 0.5f * kBay - 0.18f;
    add_box(mesh, {-half, 0.0f, -0.10f}, {half, 0.10f, 0.10f});
    add_box(mesh, {-half, 0.78f, -0.11f}, {half, 0.90f, 0.11f});
    for (int i = 0; i < kBalusters; ++i) {
        const auto first = static_cast<unsigned>(mesh.positions.size());
        const float x = half * (2.0f * (static_cast<float>(i) + 0.5f) / kBalusters - 1.0f);
        for (const glm::vec3& p : baluster.positions) mesh.positions.push_back(p + glm::vec3(x, 0.0f, 0.0f));
        mesh.normals.insert(mesh.normals.end(), baluster.normals.begin(), baluster.normals.end());
        mesh.uvs.insert(mesh.uvs.end(), baluster.uvs.begin(), baluster.uvs.end());
        for (const glm::uvec3& triangle : baluster.triangles) mesh.triangles.push_back(triangle + first);
    }
    return mesh;
}

Mesh banner_mesh()
{
    constexpr float kWidth = 0.95f;
    constexpr float kLength = 2.6f;
    Mesh mesh;
    add_grid(mesh, 12, 8, [](float s, float t) {
        const float down = 1.0f - t;  // rows run upwards, so that the front faces +Z
        const float point = 0.30f * (1.0f - std::fabs(2.0f * s - 1.0f)) * down;
        const float fold = 0.07f * down * std::sin(11.0f * s + 2.0f * down) + 0.05f * std::sin(3.0f * down);
        return glm::vec3(kWidth * (s - 0.5f), -(kLength + point) * down, fold);
    });
    return mesh;
}

}  // namespace rcs
