#pragma once

#include <vector>

#include <glm/glm.hpp>

#include "rcs/gbuffer.h"

namespace rcs::test {

/// 20 x 20 points (x, z) of a floor of 4 m by 4 m around the origin.
inline std::vector<glm::vec2> even_floor()
{
    std::vector<glm::vec2> floor;
    for (int i = 0; i < 400; ++i)
        floor.emplace_back(-1.9f + 0.2f * static_cast<float>(i / 20), -1.9f + 0.2f * static_cast<float>(i % 20));
    return floor;
}

/// Visible points (x, z) on a floor at y = 0 that is instance 0 and faces up, without a camera or any GL.
inline GBuffer points_on_floor(const std::vector<glm::vec2>& xz)
{
    GBuffer g;
    g.width = static_cast<int>(xz.size());
    g.height = 1;
    for (const glm::vec2 p : xz) {
        g.position_x.push_back(p.x);
        g.position_y.push_back(0.0f);
        g.position_z.push_back(p.y);
        g.normal_x.push_back(0.0f);
        g.normal_y.push_back(1.0f);
        g.normal_z.push_back(0.0f);
        g.geometric_normal.emplace_back(0.0f, 1.0f, 0.0f);
        g.footprint.push_back(0.01f);
        g.position_error.push_back(1e-5f);  // about what surface_at() says for corners 10 m away
        g.instance.push_back(0);
        g.primitive.push_back(0);
    }
    g.albedo.assign(xz.size(), glm::vec3(0.5f));
    g.emission.assign(xz.size(), glm::vec3(0.0f));
    return g;
}

}  // namespace rcs::test
