#pragma once

#include "material/lobe.h"
#include "material/material_point.h"
#include "util/basis.h"

namespace rcs {

/// The Lambertian base. `color`: its albedo. Light that reaches it may also come from below the shading normal's
/// horizon as the viewer sees it: smooth silhouettes stay lit.
struct Diffuse {
    static constexpr bool transmits = false, passes_rays = false, is_diffuse = true, is_recordable = false,
                          is_diffuse_behind = false, keeps_tails = false;
    static constexpr bool covers = false;

    template <typename Range>
    static bool may_be(const Material&, const Range&)
    {
        return true;
    }
    template <typename Channel>
    static float width(const Material&, const Channel&)
    {
        return 1.0f;
    }
    template <typename Lookup, typename Add>
    static void make(MaterialPoint<Lookup>& p, const Add& add)
    {
        add(p.base_color * p.rest, 1.0f, 1.0f);
    }

    static glm::vec3 reflectance(const Lobe& lobe) { return lobe.color; }
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
