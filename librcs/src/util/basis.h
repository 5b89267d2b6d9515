#pragma once

#include <cmath>
#include <numbers>

#include <glm/glm.hpp>

namespace rcs {

/// Right-handed orthonormal axes about a unit vector (Duff et al. 2017, "Building an orthonormal basis, revisited").
struct Basis {
    glm::vec3 x, y, z;

    /// @param n  unit
    explicit Basis(glm::vec3 n) : z(n)
    {
        const float sign = std::copysign(1.0f, n.z);
        const float a = -1.0f / (sign + n.z);
        const float b = n.x * n.y * a;
        x = {1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x};
        y = {b, sign + n.y * n.y * a, -n.y};
    }

    /// The same, turned about n. @param turn  in full turns, [0, 1)
    Basis(glm::vec3 n, float turn) : Basis(n)
    {
        const float c = std::cos(2.0f * std::numbers::pi_v<float> * turn);
        const float s = std::sin(2.0f * std::numbers::pi_v<float> * turn);
        const glm::vec3 before = x;
        x = c * x + s * y;
        y = c * y - s * before;
    }

    glm::vec3 to_local(glm::vec3 v) const { return {glm::dot(v, x), glm::dot(v, y), glm::dot(v, z)}; }
    glm::vec3 from_local(glm::vec3 v) const { return v.x * x + v.y * y + v.z * z; }
};

/// Direction with density cosine / pi about the normal (Malley's method). @param u  in [0, 1)^2
inline glm::vec3 cosine_direction(glm::vec3 normal, glm::vec2 u)
{
    const Basis turned(normal, u.y);
    return std::sqrt(u.x) * turned.x + std::sqrt(1.0f - u.x) * turned.z;
}

}  // namespace rcs
