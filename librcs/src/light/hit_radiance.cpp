#include "light/hit_radiance.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "material/surface_material.h"
#include "records/hemisphere.h"
#include "rays/ray_scene_impl.h"
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

namespace {

bool is_plain(const Material& material, const Mesh& mesh)
{
    return is_lambertian(material) && !material.unlit && !material.normal_texture.used() && mesh.colors.empty() &&
           material.base_color_texture.uv_set == 0;
}

}  // namespace

HitRadiance::HitRadiance(const RayScene& rays, const LightCache* cache, float least_alpha)
    : rays_(rays), scene_(rays.scene()), cache_(cache), lights_(collect_lights(rays)), sky_(scene_.sky_radiance),
      environment_(environment_of(rays)), has_sky_(!environment_.is_black()), least_alpha_(least_alpha)
{
    for (const Instance& instance : scene_.instances) {
        const Mesh& mesh = scene_.meshes[static_cast<std::size_t>(instance.mesh)];
        plain_.push_back(rcs::is_plain(scene_.materials[static_cast<std::size_t>(mesh.material)], mesh));
    }
}

Bsdf HitRadiance::bsdf(const HitPacket& packet, int lane, const HitSurface& hit, float cone_width) const
{
    const Hit at{packet.ray.t_max[lane], packet.u[lane], packet.v[lane], packet.instance(lane), packet.primitive[lane]};
    const float width = hit.uv_per_length * cone_width;
    Bsdf result = material_at(rays_, at, hit.point, -ray_direction(packet.ray, lane), {{width, 0.0f}, {0.0f, width}}).bsdf;
    result.alpha = std::max(result.alpha, least_alpha_);
    result.coat_alpha = std::max(result.coat_alpha, least_alpha_);
    return result;
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
