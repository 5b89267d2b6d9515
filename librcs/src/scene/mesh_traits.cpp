#include "scene/mesh_traits.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "material/hand_over.h"
#include "material/lobe_kinds.h"
#include "scene/material_fields.h"
#include "util/color.h"

namespace rcs {
namespace {

constexpr float kTexel = 1.0f / 65535.0f;
// Filtering texels that are all the same may be off by a rounding.
constexpr float kRounding = 1e-6f;

/// Ranges of textures' channels, found when asked for: filtered values lie in them.
class TextureRanges {
public:
    explicit TextureRanges(const Scene& scene) : scene_(scene), known_(scene.textures.size()) {}

    /// An unused slot is 1.
    ChannelRange operator()(const TextureSlot& slot, std::size_t channel)
    {
        if (!slot.used()) return {};
        auto& known = known_[static_cast<std::size_t>(slot.texture)];
        if (!known) known = look_through(scene_.textures[static_cast<std::size_t>(slot.texture)]);
        return (*known)[channel];
    }

private:
    using Ranges = std::array<ChannelRange, 4>;

    static Ranges look_through(const Texture& texture)
    {
        std::array<std::uint16_t, 4> least, most;
        least.fill(65535);
        most.fill(0);
        for (const auto& texel : texture.levels[0].texels) {
            for (std::size_t c = 0; c < 4; ++c) {
                least[c] = std::min(least[c], texel[c]);
                most[c] = std::max(most[c], texel[c]);
            }
        }
        Ranges ranges;
        for (std::size_t c = 0; c < 4; ++c)
            ranges[c] = {kTexel * static_cast<float>(least[c]), kTexel * static_cast<float>(most[c])};
        return ranges;
    }

    const Scene& scene_;
    std::vector<std::optional<Ranges>> known_;
};

bool varies(const Texture& texture)
{
    const auto& texels = texture.levels[0].texels;
    return !std::all_of(texels.begin(), texels.end(), [&](const auto& texel) { return texel == texels[0]; });
}

float least_alpha(const Material& m, const Mesh& mesh, TextureRanges& ranges)
{
    float vertex = 1.0f;
    for (const glm::vec4& color : mesh.colors) vertex = std::min(vertex, color.a);
    return m.alpha * vertex * ranges(m.base_color_texture, 3).least;
}

bool turns_normals(const Material& m, TextureRanges& ranges)
{
    if (!m.normal_texture.used() || m.normal_scale == 0.0f) return false;
    const auto turns = [&](std::size_t channel) {
        const ChannelRange r = ranges(m.normal_texture, channel);
        return std::max(std::abs(2.0f * r.least - 1.0f), std::abs(2.0f * r.most - 1.0f)) * std::abs(m.normal_scale) >
               1e-4f;
    };
    return turns(0) || turns(1);
}

float largest_base_color(const Material& m, const Mesh& mesh)
{
    float vertex = mesh.colors.empty() ? 1.0f : 0.0f;
    for (const glm::vec4& color : mesh.colors) vertex = std::max(vertex, largest(glm::vec3(color)));
    return std::min(1.0f, vertex * largest(m.base_color));
}

/// Widths that a lobe may have; a texture's, filtered, by a rounding more or less.
template <typename Kind>
ChannelRange widths(Kind kind, const Material& m, TextureRanges& ranges)
{
    const auto at = [&](float ChannelRange::* end, float rounding) {
        return [&ranges, end, rounding](const TextureSlot& slot, int channel) {
            const float value = ranges(slot, static_cast<std::size_t>(channel)).*end;
            return slot.used() ? value * rounding : value;
        };
    };
    return {kind.width(m, at(&ChannelRange::least, 1.0f - kRounding)),
            kind.width(m, at(&ChannelRange::most, 1.0f + kRounding))};
}

/// glTF's, of which a mirror has none.
float roughness_of(float alpha) { return alpha > kLeastAlpha ? std::sqrt(alpha) : 0.0f; }

/// Which lobes there may be, and how they are lit.
void add_lobes(const Material& m, TextureRanges& ranges, MeshTraits& t)
{
    const auto range = [&](const TextureSlot& slot, int channel) {
        return ranges(slot, static_cast<std::size_t>(channel));
    };
    for_each_kind([&](auto kind) {
        if (!kind.may_be(m, range)) return;
        ++t.most_lobes;
        if (kind.is_diffuse) return;
        const ChannelRange width = widths(kind, m, ranges);
        for (const float alpha : {width.least, width.most}) {
            const Lobe lobe = make_lobe<decltype(kind)>(glm::vec3(1.0f), 1.0f, alpha);
            if (lit_by_records(lobe)) t.bits |= kWideLobe;
            if (lit_by_rays(lobe) && !shows_straight(lobe)) t.bits |= kNarrowLobe;
        }
        if (kind.passes_rays) {
            t.bits |= kTransmits;
            return;
        }
        t.bits |= kHasLobe;
        if (kind.is_diffuse_behind) return;
        t.least_roughness = std::min(t.least_roughness, roughness_of(width.least));
        t.most_roughness = std::max(t.most_roughness, roughness_of(width.most));
    });
    if (t.is(kHasLobe)) t.most_albedo = 1.0f;
}

MeshTraits traits_of(const Scene& scene, const Mesh& mesh, TextureRanges& ranges)
{
    const Material& m = scene.materials[static_cast<std::size_t>(mesh.material)];
    MeshTraits t;
    const float alpha = least_alpha(m, mesh, ranges);
    if (m.alpha_mode == AlphaMode::mask && alpha < m.alpha_cutoff + kRounding) t.bits |= kMasked;
    if (m.alpha_mode == AlphaMode::blend && alpha < 1.0f - kRounding) t.bits |= kBlended;
    if (m.unlit) {
        t.bits |= kEmits;
        return t;
    }
    const float emission =
        largest(m.emission * glm::vec3(ranges(m.emission_texture, 0).most, ranges(m.emission_texture, 1).most,
                                       ranges(m.emission_texture, 2).most));
    if (emission > 0.0f) t.bits |= kEmits;
    t.most_albedo = largest_base_color(m, mesh);
    add_lobes(m, ranges, t);
    if (t.most_albedo > 0.0f || t.is(kTransmits)) t.bits |= kReflects;
    if (turns_normals(m, ranges)) t.bits |= kBumpy;
    for (const MaterialTexture& texture : kMaterialTextures) {
        const TextureSlot& slot = m.*texture.slot;
        if (texture.scatters && slot.used() && t.is(kReflects) &&
            varies(scene.textures[static_cast<std::size_t>(slot.texture)]))
            t.bits |= kTextured;
    }
    return t;
}

}  // namespace

std::vector<MeshTraits> find_traits(const Scene& scene)
{
    TextureRanges ranges(scene);
    std::vector<MeshTraits> traits;
    for (const Mesh& mesh : scene.meshes) traits.push_back(traits_of(scene, mesh, ranges));
    return traits;
}

std::uint32_t declared_traits(const Material& m)
{
    std::uint32_t bits = 0;
    if (m.alpha_mode == AlphaMode::mask) bits |= kMasked;
    if (m.alpha_mode == AlphaMode::blend) bits |= kBlended;
    if (m.transmission > 0.0f) bits |= kTransmits;
    if (m.normal_texture.used()) bits |= kBumpy;
    if (m.base_color_texture.used() || m.metallic_roughness_texture.used()) bits |= kTextured;
    return bits;
}

std::uint32_t simulated_traits(const MeshTraits& traits, const Material& material, const EffectChoice& choice)
{
    // Surfaces that say nothing of it are not asked even on demand: of coincident ones rays would meet others then.
    const std::uint32_t declared = declared_traits(material);
    std::uint32_t bits = 0;
    const auto add = [&](Effect effect, Trait trait) {
        if ((declared & trait) != 0u && !choice.without.has(effect) && (choice.with.has(effect) || traits.is(trait)))
            bits |= trait;
    };
    add(Effect::alpha_mask, kMasked);
    add(Effect::alpha_blend, kBlended);
    add(Effect::transmission, kTransmits);
    add(Effect::normal_maps, kBumpy);
    return bits;
}

}  // namespace rcs
