#pragma once

#include "material/lobe.h"
#include "material/material_point.h"
#include "util/basis.h"

namespace rcs {

/// Light that a thin surface lets through in all directions, as a leaf or paper does
/// (KHR_materials_diffuse_transmission): a Lambertian lobe on the other side. It takes its part of the diffuse base.
/// `color`: its albedo.
struct DiffuseTransmission {
    static constexpr bool transmits = true, passes_rays = false, is_diffuse = false, is_recordable = false,
                          is_diffuse_behind = true, keeps_tails = false;
    static constexpr bool covers = false;

    template <typename Range>
    static bool may_be(const Material& m, const Range& range)
    {
        return m.diffuse_transmission > 0.0f && m.metallic < 1.0f &&
               m.diffuse_transmission * range(m.diffuse_transmission_texture, 3).most > 0.0f;
    }
    template <typename Channel>
    static float width(const Material&, const Channel&)
    {
        return 1.0f;
    }
    template <typename Lookup, typename Add>
    static void make(MaterialPoint<Lookup>& p, const Add& add)
    {
        const Material& m = p.material;
        if (!(m.diffuse_transmission > 0.0f)) return;
        const float part = p.take(m.diffuse_transmission * p.look_up(m.diffuse_transmission_texture).a);
        const glm::vec3 color =
            m.diffuse_transmission_color * glm::vec3(p.look_up(m.diffuse_transmission_color_texture));
        if (color * part != glm::vec3(0.0f)) add(color * part, 1.0f, 1.0f);
    }

    static glm::vec3 reflectance(const Lobe&) { return glm::vec3(0.0f); }
    static void see(LobeView& v) { v.albedo = v.lobe->color; }
    static glm::vec3 leaves(const LobeView&) { return glm::vec3(1.0f); }
    static void add(const LobeView& v, const ScatterPair& pair, Scattering& s)
    {
        s.value += v.albedo * std::numbers::inv_pi_v<float>;
        s.density += v.share * pair.cosine_i * std::numbers::inv_pi_v<float>;
    }
    static glm::vec3 sample(const LobeView& v, glm::vec3, glm::vec2 u) { return cosine_direction(v.normal, u); }
};

}  // namespace rcs
