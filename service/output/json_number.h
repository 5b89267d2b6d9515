#pragma once

#include <cmath>

#include <nlohmann/json.hpp>

namespace rcs::service {

/// JSON knows no infinity and no NaN; null stands for both.
inline nlohmann::ordered_json finite_or_null(double value)
{
    return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

}  // namespace rcs::service
