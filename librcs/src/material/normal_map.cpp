#include "material/normal_map.h"

#include <algorithm>
#include <cmath>

namespace rcs {

TangentPair tangents_from_uvs(const std::array<glm::vec3, 3>& corners, const std::array<glm::vec2, 3>& uvs)
{
    const glm::dvec3 e1 = glm::dvec3(corners[1]) - glm::dvec3(corners[0]);
    const glm::dvec3 e2 = glm::dvec3(corners[2]) - glm::dvec3(corners[0]);
    const glm::dvec2 d1 = glm::dvec2(uvs[1]) - glm::dvec2(uvs[0]), d2 = glm::dvec2(uvs[2]) - glm::dvec2(uvs[0]);
    const double area = d1.x * d2.y - d1.y * d2.x;
    if (!(area != 0.0)) return {};
    const double sign = area < 0.0 ? -1.0 : 1.0;
    return {glm::vec3(sign * (d2.y * e1 - d1.y * e2)), glm::vec3(-sign * (d1.x * e2 - d2.x * e1))};
}

namespace {

/// Makes the frame orthonormal to `normal`. @return whether it can be
bool make_orthonormal(glm::vec3 normal, TangentPair& frame)
{
    const glm::vec3 along = frame.tangent - glm::dot(frame.tangent, normal) * normal;
    const float length = glm::length(along);
    if (!(length > 1e-6f * glm::length(frame.tangent))) return false;
    frame.tangent = along / length;
    const glm::vec3 upwards = glm::cross(normal, frame.tangent);
    frame.bitangent = glm::dot(upwards, frame.bitangent) < 0.0f ? -upwards : upwards;
    return true;
}

}  // namespace

glm::vec3 mapped_direction(glm::vec3 normal, TangentPair frame, glm::vec2 direction)
{
    return make_orthonormal(normal, frame) ? direction.x * frame.tangent + direction.y * frame.bitangent
                                           : glm::vec3(0.0f);
}

glm::vec3 mapped_normal(glm::vec3 normal, TangentPair frame, glm::vec3 texel, float scale)
{
    if (!make_orthonormal(normal, frame)) return normal;
    const glm::vec3 n = 2.0f * texel - 1.0f;
    const glm::vec3 bent = scale * n.x * frame.tangent + scale * n.y * frame.bitangent + std::max(n.z, 0.0f) * normal;
    const float bent_length = glm::length(bent);
    return bent_length > 1e-6f ? bent / bent_length : normal;
}

glm::vec3 keep_mirror_above(glm::vec3 shading, glm::vec3 geometric, glm::vec3 outgoing)
{
    // The mirrored ray leaves the surface by at least this elevation (sine), or by the viewer's own.
    constexpr float kLeastElevation = 0.01f;
    const float least = std::min(kLeastElevation, 0.9f * glm::dot(outgoing, geometric));
    const glm::vec3 mirrored = 2.0f * glm::dot(shading, outgoing) * shading - outgoing;
    const float elevation = glm::dot(mirrored, geometric);
    if (elevation >= least) return shading;
    // The nearest direction at that elevation; the normal is half way between it and the viewer.
    const glm::vec3 level = mirrored - elevation * geometric;
    const float length2 = glm::dot(level, level);
    if (!(length2 > 1e-12f)) return geometric;
    const glm::vec3 lifted = least * geometric + std::sqrt((1.0f - least * least) / length2) * level;
    const glm::vec3 half = lifted + outgoing;
    const float half_length = glm::length(half);
    return half_length > 1e-6f ? half / half_length : geometric;
}

}  // namespace rcs
