#pragma once

#include "material/charlie.h"
#include "material/lobe.h"
#include "material/material_point.h"
#include "util/basis.h"

namespace rcs {

/// Sheen of cloth (KHR_materials_sheen). `color`; `level`: alpha of the distribution (squared roughness). Its facets
/// stand upright, so the lobe is narrow only across the horizon, by about its roughness: that is the width for the
/// hand-over, and widening it changes nothing else. Where a narrow lobe's albedo would be more than 1 it is brought to
/// 1; what lies below gets 1 less the albedo of the colour's largest channel at the viewer's angle, as the extension
/// has it for light from all sides.
struct Sheen {
    static constexpr bool transmits = false, passes_rays = false, is_diffuse = false, is_recordable = false,
                          is_diffuse_behind = false, keeps_tails = false;
    static constexpr bool covers = true;

    template <typename Range>
    static bool may_be(const Material& m, const Range& range)
    {
        for (int c = 0; c < 3; ++c)
            if (m.sheen_color[c] > 0.0f && m.sheen_color[c] * range(m.sheen_color_texture, c).most > 0.0f) return true;
        return false;
    }
    template <typename Channel>
    static float width(const Material& m, const Channel& channel)
    {
        return std::clamp(m.sheen_roughness * channel(m.sheen_roughness_texture, 3), kLeastCharlieRoughness, 1.0f);
    }
    template <typename Lookup, typename Add>
    static void make(MaterialPoint<Lookup>& p, const Add& add)
    {
        const Material& m = p.material;
        if (m.sheen_color == glm::vec3(0.0f)) return;
        const glm::vec3 color = m.sheen_color * glm::vec3(p.look_up(m.sheen_color_texture));
        const float roughness = width(m, p.channel());
        if (color != glm::vec3(0.0f)) add(color, roughness * roughness, roughness);
    }

    static glm::vec3 reflectance(const Lobe&) { return glm::vec3(0.0f); }
    static void see(LobeView& v)
    {
        const float total = charlie_albedo(v.cosine, v.lobe->level);
        v.gain = v.lobe->color / std::max(total, 1.0f);
        v.albedo = v.lobe->color * std::min(total, 1.0f);
    }
    static glm::vec3 leaves(const LobeView& v)
    {
        return glm::vec3(1.0f - std::max({v.albedo.r, v.albedo.g, v.albedo.b}));
    }
    static void add(const LobeView& v, const ScatterPair& pair, Scattering& s)
    {
        const float alpha = v.lobe->level, d = charlie_distribution(pair.sine2_h, alpha);
        s.value += v.gain * (d * charlie_visibility(v.cosine, charlie_lambda(v.cosine, alpha), pair.cosine_i,
                                                    charlie_lambda(pair.cosine_i, alpha)));
        // A normal that the viewer sees from behind is turned about the surface's: it comes to where another lies.
        const float height = std::sqrt(1.0f - pair.sine2_h);
        const float both = 2.0f * v.cosine * height < pair.cosine_h ? 2.0f : 1.0f;
        const float by_facets = both * d * height / (4.0f * std::max(pair.cosine_h, 1e-6f));
        s.density += v.share * (kEvenly * 0.5f * std::numbers::inv_pi_v<float> + (1.0f - kEvenly) * by_facets);
    }
    /// By facets, and evenly over the hemisphere, where facets seen at grazing angles send much.
    static glm::vec3 sample(const LobeView& v, glm::vec3 outgoing, glm::vec2 u)
    {
        const Basis basis(v.normal);
        if (u.x < kEvenly) {
            const float z = u.x / kEvenly, phi = 2.0f * std::numbers::pi_v<float> * u.y;
            const float sine = std::sqrt(std::max(0.0f, 1.0f - z * z));
            return basis.from_local({sine * std::cos(phi), sine * std::sin(phi), z});
        }
        glm::vec3 h = sample_charlie_normal(v.lobe->level, {(u.x - kEvenly) / (1.0f - kEvenly), u.y});
        const glm::vec3 o = basis.to_local(outgoing);
        if (glm::dot(o, h) < 0.0f) h = {-h.x, -h.y, h.z};
        return glm::normalize(basis.from_local(2.0f * glm::dot(o, h) * h - o));
    }

private:
    static constexpr float kEvenly = 0.5f;  ///< of the samples
};

}  // namespace rcs
