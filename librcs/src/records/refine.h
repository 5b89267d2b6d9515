#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "records/gather.h"
#include "splat/tiles.h"

namespace rcs {

/// More rays where the records around are noisy: the standard error of each record's neighbourhood is brought
/// down to options.noise_target, or as far as 2,048 rays go.
///
/// A record is judged by its neighbours alone. By its own standard error it would get more rays when it happens
/// to have seen a rare bright spot and fewer when it missed it; what it missed would stay, and the mean would
/// be biased.
///
/// Spacing radii stay: they follow from the first gathers alone, so the pixels served stay served.
/// @param records  all so far   @param pixels  where the newest of them were made; these get more rays
/// @param report  told the fraction done, on this thread; may throw
void refine_noisy_records(const RecordGatherer& gatherer, const GBuffer& gbuffer, const TiledSurfaces& surfaces,
                          const View& view, const RecordOptions& options, std::span<const std::uint32_t> pixels,
                          ThreadPool& pool, std::span<Record> records, RecordStats& stats,
                          const std::function<void(float)>& report);

}  // namespace rcs
