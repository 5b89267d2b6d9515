#pragma once

#include <vector>

#include "placement/allotment.h"

namespace rcs {

// The steps that an error is brought down by, walked by Steering on the records themselves and by walk_ahead() on a
// sample.
inline constexpr double kStep = 0.7;           ///< of the error, from one look at it to the next
inline constexpr double kShareOfSpread = 0.6;  ///< of the error: errors add up squared, and rays show more of it
inline constexpr double kMostMore = 1.5;       ///< rays of one step, over those so far
inline constexpr double kLeastMore = 0.05;     ///< the same: the last step to the goal may promise to take next to none
inline constexpr int kMostSteps = 24;
inline constexpr int kMostSharpenings = 3;    ///< in a step
inline constexpr float kMostRays = 16384.0f;  ///< per record
inline constexpr float kMostDensity = 4.0f;   ///< of records in one round, over what it was

/// Where a step would end.
struct PathPoint {
    double error = 0.0;  ///< mean relative
    double rays = 0.0;   ///< in all, from here on; finding places for records is counted in rays as well
    double looks = 0.0;  ///< at the error, and what takes as long
};

/// The steps to ever smaller errors, as far as they are known by the records' shares: all of them, with errors as seen
/// so far.
/// @param gather  rays that a new record begins with   @param progress  part of the way that a step comes, over that of
/// most
/// @return errors fall, from what it is now (no rays, no looks)
std::vector<PathPoint> walk_ahead(std::vector<RecordShare> shares, float gather, double progress, double least_error);
/// As the last step showed: it was to bring the error down to kStep of itself. @param left  what it left of it
double progress_of_step(double left);

/// What an error takes, between the points of a path or beyond its end (where only noise falls).
PathPoint read_path(const std::vector<PathPoint>& path, double error);

}  // namespace rcs
