#include "plan/plan_words.h"

namespace rcs {

EffectSet EffectPlan::set() const
{
    EffectSet set;
    for (const PlannedEffect& e : effects) set.set(e.effect, e.needed);
    return set;
}

std::string list_effects(const EffectPlan& plan, bool needed)
{
    std::string list;
    for (const PlannedEffect& e : plan.effects)
        if (e.needed == needed && (needed || e.has_material))
            list.append(list.empty() ? ""
                        : needed     ? ","
                                     : "; ")
                .append(name_of(e.effect))
                .append(needed ? "" : ": " + e.reason);
    return list;
}

void tell(const EffectPlan& plan, const LogFunction& log)
{
    if (!log) return;
    for (const PlannedEffect& e : plan.effects)
        if (!e.needed && e.has_material)
            log(LogLevel::info, "left out: " + std::string(name_of(e.effect)) + ": " + e.reason);
}

}  // namespace rcs
