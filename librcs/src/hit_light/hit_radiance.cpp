#include "hit_light/hit_radiance.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "material/material_lobes.h"
#include "rays/ray_scene_impl.h"
#include "rays/surface_material.h"
#include "scene/texture.h"
#include "util/color.h"

namespace rcs {

int mip_level(const Texture& texture, float uv_per_length, float cone_width)
{
    const int size = std::max(texture.levels[0].width, texture.levels[0].height);
    const float texels = static_cast<float>(size) * uv_per_length * cone_width;
    // The exponent of sqrt(2) x is log2(x), rounded.
    const std::uint32_t bits = std::bit_cast<std::uint32_t>(std::max(texels, 1.0f) * std::numbers::sqrt2_v<float>);
    return static_cast<int>(bits >> 23) - 127;
}

namespace {

/// The lobes of a white surface of this material; `textured` becomes true where they depend on a texture.
Bsdf lobes_of_white(const Material& m, bool& textured)
{
    struct {
        bool& textured;
        glm::vec4 operator()(const TextureSlot& slot) const
        {
            textured = textured || slot.used();
            return glm::vec4(1.0f);
        }
        float turn_of(const TextureSlot&, glm::vec2) const { return 0.0f; }
    } look_up{textured};
    Bsdf bsdf;
    make_lobes(m, glm::vec3(1.0f), look_up, true, bsdf);
    return bsdf;
}

bool is_plain(const Material& m, const Mesh& mesh, std::uint32_t simulated)
{
    bool textured = false;
    const Bsdf white = lobes_of_white(m, textured);
    const bool like_diffuse = std::all_of(white.begin(), white.end(), [](const Lobe& lobe) {
        return is_diffuse(lobe) ? lobe.color == glm::vec3(1.0f)
                                : lit_by_records(lobe) && lobe.alpha >= kLikeDiffuseAlpha;
    });
    return like_diffuse && !textured && !m.unlit && (simulated & kBumpy) == 0u && mesh.colors.empty() &&
           m.base_color_texture.uv_set == 0;
}

/// What lies above the base of a plain material.
Bsdf plain_layer(const Material& m)
{
    bool textured = false;
    const Bsdf white = lobes_of_white(m, textured);
    return white.only(reflecting_lobes(white));
}

}  // namespace

HitRadiance::HitRadiance(const RayScene& rays, const LightCache* cache, const EffectSet& effects,
                         const GatheredLamps* gathered)
    : rays_(rays),
      scene_(rays.scene()),
      cache_(cache),
      lights_(collect_lights(rays, effects)),
      gathered_(gathered && gathered->finder ? gathered : nullptr),
      sky_(effects.has(Effect::environment) ? scene_.sky_radiance : glm::vec3(0.0f)),
      environment_(effects.has(Effect::environment) ? environment_of(rays) : black_environment()),
      has_sky_(effects.has(Effect::environment)),
      has_textures_(effects.has(Effect::hit_textures))
{
    for (const RayInstance& instance : rays.impl().instances)
        plain_.push_back(rcs::is_plain(scene_.materials[static_cast<std::size_t>(instance.material)], *instance.mesh,
                                       instance.simulated));
    for (const RayInstance& instance : rays.impl().instances) {
        bool textured = false;
        const Bsdf white = lobes_of_white(scene_.materials[static_cast<std::size_t>(instance.material)], textured);
        lit_behind_.push_back(std::any_of(white.begin(), white.end(), is_diffuse_behind));
    }
    for (const Material& material : scene_.materials) {
        layer_.push_back(plain_layer(material));
        glm::vec3& color = mean_color_.emplace_back(material.base_color);
        if (material.base_color_texture.used()) {
            const Texture& texture = scene_.textures[static_cast<std::size_t>(material.base_color_texture.texture)];
            color *= glm::vec3(texel_value(texture.levels.back(), 0, 0));
        }
    }
}

namespace {

Hit hit_of(const HitPacket& packet, int lane)
{
    return {packet.ray.t_max[lane], packet.u[lane], packet.v[lane], packet.instance(lane), packet.primitive[lane]};
}

}  // namespace

MaterialValues HitRadiance::values(const HitPacket& packet, int lane, const HitSurface& hit, float cone_width) const
{
    return values(hit_of(packet, lane), hit.point, -ray_direction(packet.ray, lane), hit.uv_per_length * cone_width);
}

MaterialValues HitRadiance::values(const Hit& hit, const SurfacePoint& point, glm::vec3 outgoing, float width) const
{
    if (has_textures_) tally(Count::hit_textures);
    return material_at(rays_, hit, point, outgoing, {{width, 0.0f}, {0.0f, width}, !has_textures_});
}

bool HitRadiance::leave_to_finder(const SurfacePoint& point, RandomStream& random, HitLights::Sample& lamp) const
{
    constexpr float kLeastPart = 0.25f;  // smaller ones are brought by fewer rays
    const std::size_t punctual = lights_.lights().punctual.size();
    const std::vector<EmissiveTriangle>& triangles = lights_.lights().triangles;
    if (lamp.irradiance == glm::vec3(0.0f) || lamp.lamp < punctual || lamp.lamp - punctual >= triangles.size())
        return false;
    const EmissiveTriangle& triangle = triangles[lamp.lamp - punctual];
    if (!gathered_->has(triangle.instance)) return false;
    float part = gathered_->finder->part_left(point, lamp, triangle);
    if (part < kLeastPart) part = random.next() * kLeastPart < part ? kLeastPart : 0.0f;
    lamp.irradiance *= part;
    return true;
}

bool HitRadiance::may_find_light(glm::vec3 origin, glm::vec3 unit_direction) const
{
    const Lights& lamps = lights_.lights();
    return has_sky_ || (!lamps.triangles.empty() && lamps.tree->may_meet(origin, unit_direction));
}

glm::vec3 HitRadiance::emission(const HitPacket& packet, int lane, const HitSurface& hit, float cone_width) const
{
    return emission(hit_of(packet, lane), hit.point, -ray_direction(packet.ray, lane), hit.uv_per_length * cone_width);
}

glm::vec3 HitRadiance::emission(const Hit& hit, const SurfacePoint& point, glm::vec3 outgoing, float width) const
{
    const Material& material = scene_.materials[static_cast<std::size_t>(point.material)];
    return material.unlit || emitted_radiance(material, point.front) == glm::vec3(0.0f)
               ? glm::vec3(0.0f)
               : values(hit, point, outgoing, width).emission;
}

float HitRadiance::density_of_lamp(const SurfacePoint& origin, const HitPacket& packet, int lane) const
{
    const std::uint32_t triangle = lights_.lights().emissive_triangle(packet.instance(lane), packet.primitive[lane]);
    return triangle != Lights::kNone
               ? lights_.density(origin, lights_.triangle_lamp(triangle), ray_direction(packet.ray, lane))
               : 0.0f;
}

namespace {

MaterialValues widened(MaterialValues values, bool is_curved, float least_alpha)
{
    const float least = is_curved ? least_alpha : kFlatPart * least_alpha;
    for (std::uint32_t i = 0; i < values.bsdf.count; ++i) widen_at_hit(values.bsdf.lobe[i], least);
    return values;
}

}  // namespace

MaterialValues HitRadiance::widened_values(const HitPacket& packet, int lane, const HitSurface& hit, float cone_width,
                                           float least_alpha) const
{
    return widened(values(packet, lane, hit, cone_width), is_curved(rays_, packet, lane), least_alpha);
}

MaterialValues HitRadiance::widened_values(const Hit& hit, const SurfacePoint& point, glm::vec3 outgoing, float width,
                                           float least_alpha) const
{
    return widened(values(hit, point, outgoing, width), instance_of(rays_, hit.instance).is_curved(hit.primitive),
                   least_alpha);
}

glm::vec3 HitRadiance::indirect(const SurfacePoint& point, const Bsdf& bsdf, glm::vec3 outgoing,
                                RandomStream& random) const
{
    constexpr float kInversePi = std::numbers::inv_pi_v<float>;
    const glm::vec3 reflected = kInversePi * total_albedo(bsdf, outgoing) * indirect_irradiance(point, random);
    const LobeSet behind = bsdf.those(is_diffuse_behind);
    if (behind == 0u) return reflected;
    return reflected +
           kInversePi * rcs::albedo(bsdf, outgoing, behind) * indirect_irradiance(other_side(point), random);
}

glm::vec3 HitRadiance::base_color(const PlainHit& hit) const
{
    const Material& material = scene_.materials[static_cast<std::size_t>(hit.material)];
    if (!has_textures_ || !material.base_color_texture.used())
        return mean_color_[static_cast<std::size_t>(hit.material)];
    tally(Count::hit_textures);
    const Texture& texture = scene_.textures[static_cast<std::size_t>(material.base_color_texture.texture)];
    const int level = mip_level(texture, hit.uv_per_length, hit.cone_width);
    return material.base_color * glm::vec3(sample_slot_nearest(scene_, material.base_color_texture, hit.uv, level));
}

glm::vec3 HitRadiance::albedo(const PlainHit& hit, float cosine) const
{
    const Bsdf& layer = layer_[static_cast<std::size_t>(hit.material)];
    const glm::vec3 color = base_color(hit);
    if (layer.count == 0) return color;
    const glm::vec3 specular =
        rcs::albedo(layer, {std::sqrt(std::max(0.0f, 1.0f - cosine * cosine)), 0.0f, cosine}, kAllLobes);
    return color * (1.0f - specular) + specular;
}

glm::vec3 HitRadiance::reflectance(const PlainHit& hit, glm::vec3 normal, glm::vec3 outgoing, glm::vec3 incoming) const
{
    return reflectance(hit.material, base_color(hit), normal, outgoing, incoming);
}

glm::vec3 HitRadiance::reflectance(int material, glm::vec3 color, glm::vec3 normal, glm::vec3 outgoing,
                                   glm::vec3 incoming) const
{
    Bsdf layer = layer_[static_cast<std::size_t>(material)];
    if (layer.count == 0) return color;
    layer.normal = layer.geometric_normal = normal;
    return color * (1.0f - rcs::albedo(layer, outgoing, kAllLobes)) +
           std::numbers::pi_v<float> * evaluate(layer, outgoing, incoming);
}

}  // namespace rcs
