#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "report/accuracy_report.h"

namespace rcs::service {

/// Whether each point lies on the Pareto front of the renders; the path tracer's points do not take part.
std::vector<bool> on_front(const AccuracyReport& report);

/// One line a point (RFC 4180); times in seconds, errors as fractions. The first line names the columns.
std::string to_csv(const AccuracyReport& report);

/// The headline and a short table for a person.
std::string to_text(const AccuracyReport& report);

/// All figures, no pictures.
nlohmann::ordered_json to_json(const AccuracyReport& report);

}  // namespace rcs::service
