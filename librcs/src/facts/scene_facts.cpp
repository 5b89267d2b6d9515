#include "facts/scene_facts.h"

#include <algorithm>
#include <vector>

#include "lamps/lights.h"
#include "rays/ray_scene_impl.h"

namespace rcs {

SceneFacts scene_facts(const RayScene& rays)
{
    const RayScene::Impl& impl = rays.impl();
    SceneFacts f;
    for (const PunctualLight& light : rays.scene().lights) f.punctual += light.intensity != glm::vec3(0.0f) ? 1 : 0;
    f.triangles = impl.lights->triangles.size();
    f.sky = !impl.environment.is_black();
    f.peaks = impl.environment.has_peaks();
    f.lamps = f.punctual > 0 || f.triangles > 0 || f.peaks;
    std::vector<int> uses(rays.scene().meshes.size(), 0);
    for (std::size_t i = 0; i < impl.instances.size(); ++i) {
        f.instanced += impl.instances[i].instanced ? 1 : 0;
        ++uses[static_cast<std::size_t>(rays.scene().instances[i].mesh)];
    }
    for (std::size_t m = 0; m < uses.size(); ++m) {
        if (uses[m] == 0) continue;
        ++f.used_meshes;
        f.shared_meshes += uses[m] > 1 ? 1 : 0;
        const MeshTraits& t = impl.traits[m];
        f.most_lobes = std::max(f.most_lobes, t.most_lobes);
        f.most_albedo = std::max(f.most_albedo, static_cast<double>(t.most_albedo));
        f.least_roughness = std::min(f.least_roughness, t.least_roughness);
        f.most_roughness = std::max(f.most_roughness, t.most_roughness);
        f.declared |=
            declared_traits(rays.scene().materials[static_cast<std::size_t>(rays.scene().meshes[m].material)]);
        f.simulated |= impl.simulated[m];
        for (std::size_t bit = 0; bit < kTraits; ++bit) f.meshes[bit] += t.bits >> bit & 1u;
    }
    return f;
}

}  // namespace rcs
