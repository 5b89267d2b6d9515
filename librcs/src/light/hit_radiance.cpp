#include "light/hit_radiance.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "records/hemisphere.h"
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

glm::vec3 cosine_direction(const SurfacePoint& point, RandomStream& random)
{
    const float sin2 = random.next();
    const Frame frame = make_frame(point.shading_normal, random.next());
    return std::sqrt(sin2) * frame.x + std::sqrt(1.0f - sin2) * frame.z;
}

HitRadiance::HitRadiance(const RayScene& rays, const LightCache* cache)
    : scene_(rays.scene()), cache_(cache), lights_(collect_lights(rays)), sky_(scene_.sky_radiance),
      has_sky_(luminance(sky_) > 0.0f)
{
}

glm::vec3 HitRadiance::albedo(int material_index, glm::vec2 uv, float uv_per_length, float cone_width) const
{
    const Material& material = scene_.materials[static_cast<std::size_t>(material_index)];
    if (!material.base_color_texture.used())
        return material.base_color;
    const Texture& texture = scene_.textures[static_cast<std::size_t>(material.base_color_texture.texture)];
    const int level = mip_level(texture, uv_per_length, cone_width);
    return material.base_color * glm::vec3(sample_slot_nearest(scene_, material.base_color_texture, uv, level));
}

}  // namespace rcs
