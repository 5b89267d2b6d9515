#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "placement/allotment.h"
#include "rcs/records.h"

namespace rcs {

/// Times a record's spacing: what the final splat averages over, its neighbourhood.
constexpr float kNeighbourhood = 3.0f;

/// Of luminance [W m^-2]; 0 if there are none.
double mean_irradiance(std::span<const Record> records);

/// Standard error of what the splat makes of each record's neighbourhood, relative to it, if every record there had
/// been gathered with `rays` rays. A record is judged by its neighbours alone. By its own standard error it would get
/// more rays when it happens to have seen a rare bright spot and fewer when it missed it; what it missed would stay,
/// and the mean would be biased.
/// @param records  all so far   @param pixels  where the newest of them were made
/// @param fall  their noise goes with rays^-fall   @return one for each of `pixels`
std::vector<float> noise_around(int rays, const GBuffer& gbuffer, const View& view, float error_tolerance,
                                std::span<const std::uint32_t> pixels, ThreadPool& pool,
                                std::span<const Record> records, float fall = kNoiseFall);

/// The noise that a record's neighbourhood may keep, per `noise_target`: 1 where records are `widest` [px] apart, more
/// where they are closer. The mean error of a picture falls most for its rays where a record's number of them goes with
/// the power 2/3 of the area it serves; and finer noise is harder to see.
float noise_allowed(const Record& record, float widest);

/// How many times `rays` more each record should get: in proportion to the noise around it over what is allowed, as far
/// as `most_rays` go. Where noise is just above, it comes down to that; where it is far above, not as far, since the
/// square of the noise that this would take buys less there than elsewhere.
/// @param noise  around each of the records: noise_around() for `rays`   @param widest  spacing [px]
std::vector<int> extra_gathers(std::span<const Record> records, std::span<const float> noise, int rays,
                               float noise_target, float widest, int most_rays);

}  // namespace rcs
