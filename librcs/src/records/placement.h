#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "rcs/records.h"
#include "records/gather.h"
#include "splat/tiles.h"

namespace rcs {

/// place_records() in steps: records of one view, filled in and refined as often as needed.
class Placement {
public:
    /// @param report  told the fraction done of each step, on this thread; may throw
    Placement(const RayScene& rays, const GBuffer& gbuffer, const View& view, const RecordOptions& options,
              ThreadPool& pool, std::vector<Record>& records, RecordStats& stats, const LightCache* cache,
              std::function<void(float)> report);

    /// Adds records in waves until every visible point is within the spacing radius of one.
    void fill();
    /// Around each record, as it is now.
    std::vector<float> noise() const;
    /// More rays where that is more than `noise_target`, up to `most_rays` a record.
    void refine(std::span<const float> noise, float noise_target, int most_rays);
    /// Hemisphere rays that refine() would shoot.
    std::uint64_t refining_rays(std::span<const float> noise, float noise_target, int most_rays) const;

    RecordOptions& options() { return options_; }
    const TiledSurfaces& surfaces() const { return surfaces_; }
    /// The records made here, and the pixel of each.
    std::span<Record> records() { return std::span(records_).last(pixels_.size()); }
    std::span<const Record> records() const { return std::span<const Record>(records_).last(pixels_.size()); }
    std::span<const std::uint32_t> pixels() const { return pixels_; }

private:
    std::vector<int> extra(std::span<const float> noise, float noise_target, int most_rays) const;

    const GBuffer& gbuffer_;
    const View& view_;
    RecordOptions options_;
    ThreadPool& pool_;
    std::vector<Record>& records_;
    RecordStats& stats_;
    std::function<void(float)> report_;
    RecordGatherer gatherer_;
    TiledSurfaces surfaces_;
    std::vector<std::uint32_t> pixels_;
};

}  // namespace rcs
