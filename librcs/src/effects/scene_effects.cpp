#include "effects/scene_effects.h"

#include "rays/ray_scene_impl.h"

namespace rcs {

EffectSet scene_effects(const RayScene& rays)
{
    EffectSet set = EffectSet::all();
    set.set(Effect::environment, !environment_of(rays).is_black());
    set.set(Effect::environment_peaks, environment_of(rays).has_peaks());
    std::uint32_t traits = 0, simulated = 0;
    for (const RayInstance& instance : rays.impl().instances) {
        traits |= rays.impl().traits[static_cast<std::size_t>(instance.mesh - rays.scene().meshes.data())].bits;
        simulated |= instance.simulated;
    }
    set.set(Effect::highlights, (traits & kHasLobe) != 0u);
    set.set(Effect::glossy_records, (traits & kWideLobe) != 0u);
    set.set(Effect::traced_lobes, (traits & kNarrowLobe) != 0u);
    set.set(Effect::peeling, (simulated & kSeeThrough) != 0u);
    set.set(Effect::hit_textures, (traits & kTextured) != 0u);
    return set;
}

}  // namespace rcs
