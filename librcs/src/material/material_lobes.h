#pragma once

#include <glm/glm.hpp>

#include "material/bsdf.h"
#include "material/material_point.h"
#include "rcs/scene.h"

namespace rcs {

/// Whether a material can have nothing but diffuse reflection and emission, textures or not.
inline bool is_lambertian(const Material& m)
{
    return !any_kind([&](auto kind) { return !kind.is_diffuse && kind.may_be(m, any_channel); });
}

/// Adds the lobes of a material. @param base_color  in [0, 1], looked up   @param look_up  as of MaterialPoint
/// @param lets_rays_pass  whether lobes are made through which rays go straight on
template <typename Lookup>
void make_lobes(const Material& m, glm::vec3 base_color, const Lookup& look_up, bool lets_rays_pass, Bsdf& bsdf)
{
    if (is_lambertian(m)) {
        bsdf.add(make_lobe<Diffuse>(base_color));
        return;
    }
    MaterialPoint<Lookup> point(m, look_up, base_color, lets_rays_pass);
    for_each_kind([&](auto kind) {
        kind.make(point, [&](glm::vec3 color, float level, float alpha, LobeDirection direction = {}) {
            Lobe lobe = make_lobe<decltype(kind)>(color, level, alpha);
            if (direction.stretch > 0.0f) lobe.set_direction(direction.stretch, direction.turn);
            bsdf.add(lobe);
        });
    });
}

}  // namespace rcs
