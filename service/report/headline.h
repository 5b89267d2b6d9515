#pragma once

#include <optional>
#include <string>
#include <vector>

#include "rcs/sweep.h"

namespace rcs::service {

/// What some error costs the path tracer: read off its points, or from the last one on as the square of the error.
struct PathCost {
    double seconds = 0.0;
    bool extrapolated = false;
};
/// @return none if there are no points or `error` is not positive
std::optional<PathCost> path_seconds_for_error(const std::vector<CostPoint>& paths, double error);

/// What a user wants to know, as one sentence: "An error of 10 % costs 4 s; 5 % costs 15 s; the path tracer needs 20
/// min for 5 %." Only errors that the points reach are named, the coarse ones of the list and the finest reached.
std::string headline(const std::vector<CostPoint>& renders, const std::vector<CostPoint>& paths);

}  // namespace rcs::service
