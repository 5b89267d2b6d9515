#include "material/surface_material.h"
#include "scene/texture.h"
namespace rcs {
__attribute__((weak)) float alpha_at(const Scene& scene, const Mesh& mesh, std::uint32_t, float, float)
{
    const Material& m = scene.materials[static_cast<std::size_t>(mesh.material)];
    return m.alpha_mode == AlphaMode::mask ? (m.alpha >= m.alpha_cutoff ? 1.0f : 0.0f) : m.alpha_mode == AlphaMode::blend ? m.alpha : 1.0f;
}
__attribute__((weak)) MaterialValues material_at(const RayScene& rays, const Hit&, const SurfacePoint& point, glm::vec3, const TextureFilter&)
{
    MaterialValues v;
    const Material& m = rays.scene().materials[static_cast<std::size_t>(point.material)];
    v.bsdf.normal = point.shading_normal;
    v.bsdf.geometric_normal = point.geometric_normal;
    v.bsdf.diffuse = m.base_color * (1.0f - m.transmission);
    v.bsdf.transmission = m.base_color * m.transmission;
    v.emission = m.emission;
    v.alpha = m.alpha;
    return v;
}
__attribute__((weak)) glm::vec3 specular_albedo(const Bsdf&, float) { return glm::vec3(0.0f); }
__attribute__((weak)) glm::vec3 evaluate_glossy(const Bsdf&, glm::vec3, glm::vec3) { return glm::vec3(0.0f); }
__attribute__((weak)) BsdfSample sample_glossy(const Bsdf&, glm::vec3, float, glm::vec2) { return {}; }
__attribute__((weak)) float glossy_density(const Bsdf&, glm::vec3, glm::vec3) { return 0.0f; }
}  // namespace rcs
