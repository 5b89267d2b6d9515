#pragma once

#include <optional>
#include <string>
#include <vector>

#include "rcs/effect_plan.h"

namespace rcs {

/// Which layers a picture of `pixels` pixels is made with.
/// @param kept  by outputs, beside beauty; none: those made by default
/// @throws Error not_found: a name
std::vector<PlannedLayer> plan_layers(const std::optional<std::vector<std::string>>& kept, const EffectSet& effects,
                                      double pixels);

}  // namespace rcs
