#include "facts/scene_effects.h"

#include "facts/scene_facts.h"

namespace rcs {

EffectSet scene_effects(const RayScene& rays)
{
    const SceneFacts facts = scene_facts(rays);
    EffectSet set = EffectSet::all();
    set.set(Effect::environment, facts.sky);
    set.set(Effect::environment_peaks, facts.peaks);
    set.set(Effect::highlights, facts.with(kHasLobe) > 0);
    set.set(Effect::glossy_records, facts.with(kWideLobe) > 0);
    set.set(Effect::traced_lobes, facts.with(kNarrowLobe) > 0);
    set.set(Effect::peeling, (facts.simulated & kSeeThrough) != 0u);
    set.set(Effect::hit_textures, facts.with(kTextured) > 0);
    return set;
}

}  // namespace rcs
