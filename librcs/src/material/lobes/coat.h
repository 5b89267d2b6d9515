#pragma once

#include "material/ggx_lobe.h"
#include "material/material_point.h"

namespace rcs {

/// Clear coat (KHR_materials_clearcoat): a dielectric GGX layer above all else. `level`: its strength.
struct Coat {
    static constexpr bool transmits = false, passes_rays = false, is_diffuse = false, is_recordable = false,
                          is_diffuse_behind = false, keeps_tails = true;
    static constexpr bool covers = true;
    /// The coat's index of refraction is 1.5.
    static constexpr float kF0 = 0.04f;

    template <typename Range>
    static bool may_be(const Material& m, const Range& range)
    {
        return m.clearcoat > 0.0f && m.clearcoat * range(m.clearcoat_texture, 0).most > 0.0f;
    }
    template <typename Channel>
    static float width(const Material& m, const Channel& channel)
    {
        return ggx_width(m.clearcoat_roughness * channel(m.clearcoat_roughness_texture, 1));
    }
    template <typename Lookup, typename Add>
    static void make(MaterialPoint<Lookup>& p, const Add& add)
    {
        const float strength = p.material.clearcoat * p.look_up(p.material.clearcoat_texture).r;
        if (strength > 0.0f) add(glm::vec3(kF0), strength, width(p.material, p.channel()));
    }

    static glm::vec3 reflectance(const Lobe& lobe) { return glm::vec3(lobe.level * kF0); }
    static void see(LobeView& v)
    {
        see_ggx(glm::vec3(kF0), 1.0f, v);
        v.gain *= v.lobe->level;
        v.albedo *= v.lobe->level;
    }
    static glm::vec3 leaves(const LobeView& v) { return left_by_ggx(v); }
    static void add(const LobeView& v, const ScatterPair& pair, Scattering& s)
    {
        add_ggx(glm::vec3(kF0), 1.0f, v, pair, s);
    }
    static glm::vec3 sample(const LobeView& v, glm::vec3 outgoing, glm::vec2 u) { return sample_ggx(v, outgoing, u); }
};

}  // namespace rcs
