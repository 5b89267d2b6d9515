#pragma once

#include <string>

#include "rcs/effect_plan.h"
#include "rcs/log.h"

namespace rcs {

/// Names of effects that are simulated, separated by commas; or of those left out although the scene has material for
/// them, with the reason.
std::string list_effects(const EffectPlan& plan, bool needed);

/// Says what is left out although the scene has material for it.
void tell(const EffectPlan& plan, const LogFunction& log);

}  // namespace rcs
