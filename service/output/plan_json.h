#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "rcs/effect_plan.h"
#include "rcs/render.h"

namespace rcs::service {

nlohmann::ordered_json to_json(const EffectPlan& plan);
nlohmann::ordered_json to_json(const EffectCounts& counts);

/// A table for a person: what is simulated, what not, and why.
std::string to_text(const EffectPlan& plan);

}  // namespace rcs::service
