#pragma once

#include "material/ggx_anisotropic.h"
#include "material/lobes/specular.h"

namespace rcs {

/// The specular lobe where it is wider along one direction (KHR_materials_anisotropy): stands in its place. `alpha`:
/// width across that direction; along it, `stretch` leads from there to 1.
struct Anisotropic {
    static constexpr bool transmits = false, passes_rays = false, is_diffuse = false, is_recordable = false,
                          is_diffuse_behind = false, keeps_tails = false;
    static constexpr bool covers = true;

    template <typename Range>
    static bool may_be(const Material& m, const Range& range)
    {
        return m.anisotropy > 0.0f && m.anisotropy * range(m.anisotropy_texture, 2).most > 0.0f &&
               Specular::reflects(m, range);
    }
    template <typename Channel>
    static float width(const Material& m, const Channel& channel)
    {
        return base_width(m, channel);
    }
    template <typename Lookup, typename Add>
    static void make(MaterialPoint<Lookup>& p, const Add& add)
    {
        const Material& m = p.material;
        if (!(m.anisotropy > 0.0f)) return;
        const glm::vec3 texel(p.look_up(m.anisotropy_texture));
        const float strength = m.anisotropy * texel.b;
        if (!(strength > 0.0f)) return;
        const glm::vec2 towards = m.anisotropy_texture.used() ? 2.0f * glm::vec2(texel) - 1.0f : glm::vec2(1.0f, 0.0f);
        const float c = std::cos(m.anisotropy_rotation), s = std::sin(m.anisotropy_rotation);
        const glm::vec2 turned(c * towards.x - s * towards.y, s * towards.x + c * towards.y);
        Specular::make_any(p, add, {strength * strength, p.look_up.turn_of(m.anisotropy_texture, turned)});
        p.is_stretched = true;
    }

    static glm::vec3 reflectance(const Lobe& lobe) { return lobe.color; }
    static void see(LobeView& v)
    {
        const Frame frame(v);
        const glm::vec3 outgoing = frame.to_local(v.outgoing);
        v.slant = ggx_slant(outgoing, frame.widths);
        see_ggx(v.lobe->color, v.lobe->level, ggx_albedo(outgoing, v.lobe->alpha, v.lobe->stretch()), v);
    }
    static glm::vec3 leaves(const LobeView& v) { return left_by_ggx(v); }
    static void add(const LobeView& v, const ScatterPair& pair, Scattering& s)
    {
        const Frame frame(v);
        const glm::vec3 o = frame.to_local(pair.outgoing), i = frame.to_local(pair.incoming);
        const float d = ggx_distribution(glm::normalize(o + i), frame.widths);
        const float visibility = ggx_visibility(v.cosine, v.slant, pair.cosine_i, ggx_slant(i, frame.widths));
        s.value += v.gain * (v.lobe->color + (v.lobe->level - v.lobe->color) * schlick_weight(pair.cosine_h)) *
                   (d * visibility);
        s.density += v.share * d * ggx_density_factor(v.cosine, v.slant);
    }
    static glm::vec3 sample(const LobeView& v, glm::vec3, glm::vec2 u)
    {
        const Frame frame(v);
        const float phi = 2.0f * std::numbers::pi_v<float> * u.y;
        const glm::vec3 h = visible_normal(frame.to_local(v.outgoing), frame.widths,
                                           std::sqrt(u.x) * glm::vec2(std::cos(phi), std::sin(phi)));
        const glm::vec3 normal = h.x * frame.x + h.y * frame.y + h.z * v.normal;
        return glm::normalize(2.0f * glm::dot(v.outgoing, normal) * normal - v.outgoing);
    }

private:
    /// Axes along and across the direction.
    struct Frame {
        glm::vec3 x, y, z;
        glm::vec2 widths;

        explicit Frame(const LobeView& v) : z(v.normal), widths(stretched_widths(v.lobe->alpha, v.lobe->stretch()))
        {
            const Basis basis(v.normal);
            const float angle = v.lobe->turn(), c = std::cos(angle), s = std::sin(angle);
            x = c * basis.x + s * basis.y;
            y = c * basis.y - s * basis.x;
        }
        glm::vec3 to_local(glm::vec3 d) const { return {glm::dot(d, x), glm::dot(d, y), glm::dot(d, z)}; }
    };
};

}  // namespace rcs
