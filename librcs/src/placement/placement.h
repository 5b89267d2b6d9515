#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "accuracy/probes.h"
#include "placement/allotment.h"
#include "placement/served_pixels.h"
#include "rcs/records.h"
#include "records/gather.h"
#include "splat/tiles.h"

namespace rcs {

/// Least R_k of a record whose expansion disagrees with the others [px].
inline constexpr float kLeastReach = 4.0f;

/// place_records() in steps: records of one view, filled in and refined as often as needed.
class Placement {
public:
    /// @param report  told the fraction done of each step, on this thread; may throw
    Placement(const LitScene& scene, const GBuffer& gbuffer, const View& view, const RecordSettings& options,
              ThreadPool& pool, std::vector<Record>& records, RecordStats& stats, std::function<void(float)> report);

    /// Records of other views count as made here where they lie on what is seen: they may come closer and get more rays
    /// as well. Before anything is made.
    void take_over();
    /// Adds records in waves until every visible point is within the spacing radius of one.
    void fill();
    /// Where extrapolations disagree by more than Ward's error tolerance allows, at contacts and the edges of light,
    /// adds records between.
    void sharpen();
    /// Lets record k, of those made here, and what is made around it have an R_k of as little as `reach` [px]. fill()
    /// brings them in.
    void allow_closer(std::size_t k, float reach);
    /// Lets `density` records, > 1, be where record k is, of those made here, and what is made around it. fill() brings
    /// them in. @param least  R_k [px]   @return whether they may come that close
    bool bring_closer(std::size_t k, float density, float least);
    /// Around each record, as it is now.
    std::vector<float> noise() const;
    /// Gathers again, with extra[i] times rays() more at record i.
    void refine(std::span<const int> extra);

    /// Independent gathers in the same light.
    std::unique_ptr<Probes> make_probes() const
    {
        return std::make_unique<Probes>(scene_.by_samples(), gbuffer_, options_, pool_);
    }

    RecordSettings& options() { return options_; }
    /// Hemisphere rays of one gather.
    int rays() const { return gatherer_.rays(); }
    /// Noise of its records goes with rays^-noise_fall().
    float noise_fall() const { return gatherer_.looks() ? kLooksFall : kNoiseFall; }
    const TiledSurfaces& surfaces() const { return surfaces_; }
    /// The records made here, and the pixel of each.
    std::span<Record> records() { return std::span(records_).last(pixels_.size()); }
    std::span<const Record> records() const { return std::span<const Record>(records_).last(pixels_.size()); }
    std::span<const std::uint32_t> pixels() const { return pixels_; }

private:
    LitScene scene_;
    const GBuffer& gbuffer_;
    const View& view_;
    RecordSettings options_;
    ThreadPool& pool_;
    std::vector<Record>& records_;
    RecordStats& stats_;
    std::function<void(float)> report_;
    RecordGatherer gatherer_;
    TiledSurfaces surfaces_;
    ServedPixels served_;
    std::vector<std::uint32_t> pixels_;
    std::vector<float> closeness_;  // of records to be made, pixel by pixel
};

}  // namespace rcs
