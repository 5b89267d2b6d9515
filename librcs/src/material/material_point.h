#pragma once

#include <glm/glm.hpp>

#include "material/hand_over.h"
#include "rcs/scene.h"

namespace rcs {

/// What values of a texture's channel may be.
struct ChannelRange {
    float least = 1.0f, most = 1.0f;
};
/// Of a texture that nobody has looked at; 1 where the slot is empty.
inline ChannelRange any_channel(const TextureSlot& slot, int) { return {slot.used() ? 0.0f : 1.0f, 1.0f}; }

/// Width of the base's lobes. @param channel  (slot, number of a channel) to a texture's value
template <typename Channel>
float base_width(const Material& m, const Channel& channel)
{
    return ggx_width(m.roughness * channel(m.metallic_roughness_texture, 1));
}

/// A material at one point, from which lobes are made in the order of their layers.
/// @tparam Lookup  (slot) to a texture's value, 1 where the slot is empty; turn_of(slot, direction) to the angle of a
/// direction of the slot's tangent space, as Lobe::turn()
template <typename Lookup>
struct MaterialPoint {
    const Material& material;
    const Lookup& look_up;
    glm::vec3 base_color;  ///< [0, 1]
    bool lets_rays_pass;   ///< whether lobes are made through which rays go straight on
    float metallic;
    float alpha;                ///< width of the base's lobes
    bool is_stretched = false;  ///< the specular reflection is another lobe's
    float rest;                 ///< what lobes have left for those below them to scatter of the base colour

    MaterialPoint(const Material& m, const Lookup& lookup, glm::vec3 color, bool passable)
        : material(m), look_up(lookup), base_color(color), lets_rays_pass(passable)
    {
        const glm::vec4 texel = look_up(m.metallic_roughness_texture);
        metallic = m.metallic * texel.b;
        alpha = ggx_width(m.roughness * texel.g);
        rest = 1.0f - metallic;
    }

    /// A lobe's part of the base; what it leaves is the rest of it.
    float take(float part)
    {
        const float taken = rest * part;
        rest *= 1.0f - part;
        return taken;
    }
    auto channel() const
    {
        return [this](const TextureSlot& slot, int number) { return look_up(slot)[number]; };
    }
};

}  // namespace rcs
