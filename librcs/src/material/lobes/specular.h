#pragma once

#include "material/ggx_lobe.h"
#include "material/material_point.h"

namespace rcs {

/// Specular reflection of glTF 2.0, appendix B (and KHR_materials_specular, KHR_materials_ior): metal and dielectric
/// mixed in one GGX lobe. `color`: f0; `level`: f90.
struct Specular {
    static constexpr bool transmits = false, passes_rays = false, is_diffuse = false, is_recordable = true,
                          is_diffuse_behind = false, keeps_tails = true;
    static constexpr bool covers = true;

    template <typename Range>
    static bool may_be(const Material& m, const Range& range)
    {
        const bool always_stretched = m.anisotropy > 0.0f && range(m.anisotropy_texture, 2).least > 0.0f;
        return !always_stretched && reflects(m, range);
    }
    template <typename Range>
    static bool reflects(const Material& m, const Range& range)
    {
        return (m.metallic > 0.0f && m.metallic * range(m.metallic_roughness_texture, 2).most > 0.0f) ||
               (m.specular > 0.0f && m.specular * range(m.specular_texture, 3).most > 0.0f);
    }
    template <typename Channel>
    static float width(const Material& m, const Channel& channel)
    {
        return base_width(m, channel);
    }
    template <typename Lookup, typename Add>
    static void make(MaterialPoint<Lookup>& p, const Add& add)
    {
        if (!p.is_stretched) make_any(p, add);
    }
    /// @param direction  of the lobe
    template <typename Lookup, typename Add>
    static void make_any(MaterialPoint<Lookup>& p, const Add& add, LobeDirection direction = {})
    {
        const Material& m = p.material;
        const float specular = m.specular * p.look_up(m.specular_texture).a;
        const float root = (m.ior - 1.0f) / (m.ior + 1.0f);
        const glm::vec3 tint = m.specular_color * glm::vec3(p.look_up(m.specular_color_texture));
        const glm::vec3 dielectric = glm::min(root * root * tint, glm::vec3(1.0f)) * specular;
        const float f90 = glm::mix(specular, 1.0f, p.metallic);
        if (f90 > 0.0f) add(glm::mix(dielectric, p.base_color, p.metallic), f90, p.alpha, direction);
    }

    static glm::vec3 reflectance(const Lobe& lobe) { return lobe.color; }
    static void see(LobeView& v) { see_ggx(v.lobe->color, v.lobe->level, v); }
    static glm::vec3 leaves(const LobeView& v) { return left_by_ggx(v); }
    static void add(const LobeView& v, const ScatterPair& pair, Scattering& s)
    {
        add_ggx(v.lobe->color, v.lobe->level, v, pair, s);
    }
    static glm::vec3 sample(const LobeView& v, glm::vec3 outgoing, glm::vec2 u) { return sample_ggx(v, outgoing, u); }
};

}  // namespace rcs
