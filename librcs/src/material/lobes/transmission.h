#pragma once

#include "material/ggx_lobe.h"
#include "material/material_point.h"

namespace rcs {

/// Transmission through a thin wall (KHR_materials_transmission): the specular lobe mirrored to the other side, times
/// the colour. A narrow one shows what is straight behind. `color`: of what passes.
struct Transmission {
    static constexpr bool transmits = true, passes_rays = true, is_diffuse = false, is_recordable = false,
                          is_diffuse_behind = false, keeps_tails = true;
    static constexpr bool covers = false;

    template <typename Range>
    static bool may_be(const Material& m, const Range& range)
    {
        return m.transmission > 0.0f && m.transmission * range(m.transmission_texture, 0).most > 0.0f;
    }
    template <typename Channel>
    static float width(const Material& m, const Channel& channel)
    {
        return base_width(m, channel);
    }
    template <typename Lookup, typename Add>
    static void make(MaterialPoint<Lookup>& p, const Add& add)
    {
        if (!p.lets_rays_pass || !(p.material.transmission > 0.0f)) return;
        const float through = p.material.transmission * p.look_up(p.material.transmission_texture).r;
        const glm::vec3 color = p.base_color * p.take(through);
        if (color != glm::vec3(0.0f)) add(color, 1.0f, p.alpha);
    }

    static glm::vec3 reflectance(const Lobe&) { return glm::vec3(0.0f); }
    static void see(LobeView& v)
    {
        see_ggx(glm::vec3(0.0f), 0.0f, v);
        v.albedo = v.lobe->color;
    }
    static glm::vec3 leaves(const LobeView&) { return glm::vec3(1.0f); }
    static void add(const LobeView& v, const ScatterPair& pair, Scattering& s)
    {
        const GgxValue g = ggx_value(v, pair);
        s.value += v.albedo * (v.inverse_total * g.value);
        s.density += v.share * g.density;
    }
    static glm::vec3 sample(const LobeView& v, glm::vec3 outgoing, glm::vec2 u) { return sample_ggx(v, outgoing, u); }
};

}  // namespace rcs
