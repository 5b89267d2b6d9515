#pragma once

#include <cmath>
#include <span>
#include <vector>

namespace rcs {

/// Noise falls as rays^-kNoiseFall, faster than by chance: rays are strata of a hemisphere, and finer ones follow its
/// edges better (measured in sponza, sibenik and castle, from 64 to 4,000 rays).
inline constexpr float kNoiseFall = 0.7f;
/// By chance alone, where most of them are looks at lit points.
inline constexpr float kLooksFall = 0.5f;

/// What of a picture's error hangs on one record, as a splat of all of them shows it.
struct RecordShare {
    float area = 0.0f;    ///< of the picture that it makes, less where it is too dark to be seen [px]
    float single = 0.0f;  ///< standard error of the splat's mean around it, relative to it, if each record there had
                          ///< been gathered with one ray
    float spread = 0.0f;  ///< error of the first-order expansions around it, relative
    float rays = 1.0f;    ///< that it has been gathered with
    float count = 1.0f;   ///< of records that are like this one, each with this area and these rays
    float fall = kNoiseFall;  ///< its noise goes with rays^-fall
};

/// Of the splat's mean around a record that has so many rays.
inline float noise_with(const RecordShare& share, float rays) { return share.single * std::pow(rays, -share.fall); }
inline float noise_of(const RecordShare& share) { return noise_with(share, share.rays); }

/// The rays that a record is to have: as (area * single)^0.7. The mean error, sum area * noise, is least for the
/// rays spent with the power 1 / (1 + kNoiseFall) = 0.59; a larger one leaves less noise where there is most of it, for
/// somewhat more of them.
/// @param level  factor of that   @return at least the share's rays; new ones up to `most`
float rays_at(const RecordShare& share, double level, float most);

/// What more rays lead to.
struct Allotment {
    double level = 0.0;  ///< for rays_at()
    double error = 0.0;  ///< mean relative error over the picture then, as of normal errors
    double rays = 0.0;   ///< more than there are
};
Allotment allot(std::span<const RecordShare> shares, double level, float most);
/// With the fewest rays for `error`, or as near to it as `most` rays a record come.
Allotment allot_for_error(std::span<const RecordShare> shares, double error, float most);
/// With the least error for so many more rays.
Allotment allot_for_rays(std::span<const RecordShare> shares, double rays, float most);

/// How many records there are to be in the place of each, so that the mean of the spread becomes `part` of what it is
/// with the fewest new ones. Of second order it would fall as the square of their distance; closer records also see
/// what wider ones do not, and it falls as density^-kSpreadFall. @return in [1, most]
std::vector<float> densities(std::span<const RecordShare> shares, double part, float most);
inline constexpr double kSpreadFall = 0.85;
/// What is left of its spread then.
float spread_at(const RecordShare& share, float density);

}  // namespace rcs
