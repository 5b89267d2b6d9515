#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "accuracy/disagreement.h"
#include "gbuffer/views.h"
#include "placement/holes.h"
#include "placement/placement.h"
#include "placement/refine.h"
#include "placement/spacing.h"
#include "placement/view_fit.h"
#include "rcs/error.h"
#include "rcs/records.h"
#include "records/gather.h"
#include "splat/at_pixels.h"
#include "util/random.h"

namespace rcs {
namespace {

constexpr float kHardlyMore = 1.05f;  // times the closest spacing: as close as they may

// Spread of the records' extrapolations, relative to their light and over Ward's error tolerance, beyond which they
// come closer, and how often that is asked (docs/method.md, Spacing).
constexpr float kMostSpread = 0.36f;
constexpr int kSharpenings = 2;
// ... and over the noise there, with which what is told of spread scatters.
constexpr float kOfNoise = 0.5f;
constexpr float kUsualOverlap = 3.0f;
constexpr float kMostCloser = 8.0f;  // times as many, at a time
// A few new records beside those of other views are as close as those are.
constexpr double kFewAreNew = 0.1;

template <typename T>
void require(bool valid, const char* field, T value, const char* range)
{
    if (!valid)
        throw Error(ErrorCode::bad_argument,
                    std::string(field) + " is " + std::to_string(value) + ", expected " + range);
}

}  // namespace

void validate(const RecordSettings& o)
{
    require(o.error_tolerance > 0.0f && o.error_tolerance <= 1.0f, "error_tolerance", o.error_tolerance,
            "a value in (0, 1]");
    require(o.rays >= 16 && o.rays <= 65536, "rays", o.rays, "a value in [16, 65536]");
    require(o.max_reach > 0.0f && std::isfinite(o.max_reach), "max_reach", o.max_reach, "a positive number of pixels");
    require(o.min_reach > 0.0f && o.min_reach <= o.max_reach, "min_reach", o.min_reach, "a value in (0, max_reach]");
    require(o.steepest > 0.0f && o.steepest <= 1.0f, "steepest", o.steepest, "a value in (0, 1]");
    require(o.bounces >= 0 && o.bounces <= 64, "bounces", o.bounces, "a value in [0, 64]");
    require(o.noise_target > 0.0f, "noise_target", o.noise_target, "a positive value");
    require(o.gradient_limit > 0.0f, "gradient_limit", o.gradient_limit, "a positive value");
}

Placement::Placement(const LitScene& scene, const GBuffer& gbuffer, const View& view, const RecordSettings& options,
                     ThreadPool& pool, std::vector<Record>& records, RecordStats& stats,
                     std::function<void(float)> report)
    : scene_(scene),
      gbuffer_(gbuffer),
      view_(view),
      options_(options),
      pool_(pool),
      records_(records),
      stats_(stats),
      report_(std::move(report)),
      gatherer_(scene, options),
      surfaces_(make_tiled_surfaces(gbuffer, pool)),
      served_(surfaces_, view, options.error_tolerance, pool),
      closeness_(gbuffer.size(), 1.0f)
{
    validate(options);
}

void Placement::take_over() { pixels_ = bring_seen_last(gbuffer_, view_, options_.radiance, records_); }

void Placement::fill()
{
    SpacingLimiter spacing(options_);
    const std::vector<Wave> list = waves();
    const Wave every_pixel{1, -1, true};
    std::vector<bool> has_own(gbuffer_.size(), false);
    bool stale = true;
    for (std::size_t w = 0;; ++w) {
        const bool planned = w < list.size();
        const Wave wave = planned ? list[w] : every_pixel;
        report_(static_cast<float>(std::min(w, list.size())) / static_cast<float>(list.size()));
        if (w == 0 || (stale && wave.refresh)) {
            spacing.limit(records_, 0, pool_);
            served_.follow(records_);
            if (w == 0) served_.add(records_);
            stale = false;
        }
        std::vector<std::uint32_t> holes =
            find_holes(gbuffer_, view_.corner, served_.weight(), wave, options_.seed, pool_);
        // A late record may clamp a neighbour so that a pixel already passed is a hole again. Each such pixel gets a
        // record of its own, once: the loop ends, also where that has no size (a wall whose plane the eye is in).
        std::erase_if(holes, [&](std::uint32_t i) { return has_own[i]; });
        for (const std::uint32_t i : holes) has_own[i] = true;
        if (holes.empty() && !planned) break;
        if (holes.empty()) continue;
        const std::size_t known = records_.size();
        std::vector<Record> fresh = gatherer_.gather(gbuffer_, holes, pool_, stats_);
        for (std::size_t i = 0; i < holes.size(); ++i) fresh[i].closeness = closeness_[holes[i]];
        records_.insert(records_.end(), fresh.begin(), fresh.end());
        pixels_.insert(pixels_.end(), holes.begin(), holes.end());
        spacing.limit(records_, known, pool_);
        served_.add(records_);
        stale = true;
        ++stats_.waves;
    }
}

void Placement::allow_closer(std::size_t k, float reach)
{
    Record& r = records()[k];
    const float closeness = reach / options_.min_reach;
    if (!(closeness < r.closeness)) return;
    r.closeness = closeness;
    // What it no longer serves.
    const int radius = static_cast<int>(std::ceil(r.spacing_radius / r.footprint));
    const glm::ivec2 size(gbuffer_.width, gbuffer_.height);
    const glm::ivec2 centre(static_cast<int>(pixels_[k]) % size.x, static_cast<int>(pixels_[k]) / size.x);
    const glm::ivec2 low = glm::max(centre - radius, 0), high = glm::min(centre + radius, size - 1);
    for (int y = low.y; y <= high.y; ++y) {
        for (int x = low.x; x <= high.x; ++x) {
            float& least = closeness_[static_cast<std::size_t>(y) * static_cast<std::size_t>(size.x) +
                                      static_cast<std::size_t>(x)];
            least = std::min(least, closeness);
        }
    }
}

bool Placement::bring_closer(std::size_t k, float density, float least)
{
    Record& r = records()[k];
    const float nearer = 1.0f / std::sqrt(density), reach = r.spacing_radius / options_.error_tolerance;
    if (!(reach > kHardlyMore * least * r.footprint)) return false;
    r.harmonic_mean_distance = nearer * reach;  // neighbours are held to it as well
    allow_closer(k, std::max(least, nearer * reach / r.footprint));
    return true;
}

void Placement::sharpen()
{
    const SplatSettings as_splat{options_.error_tolerance, kUsualOverlap, true};
    const float most = kMostSpread * options_.error_tolerance, least = std::min(kLeastReach, options_.min_reach);
    for (int round = 0; round < kSharpenings; ++round) {
        if (static_cast<double>(pixels_.size()) < kFewAreNew * static_cast<double>(records_.size())) return;
        const PixelSums sums = splat_at_pixels(records_, gbuffer_, pixels_, view_, as_splat, pool_);
        bool any = false;
        for (std::size_t k = 0; k < pixels_.size(); ++k) {
            const Disagreement said = disagreement(sums, k, sums.weighted[k]);
            if (!(said.mean > 0.0f)) continue;
            const float allowed = std::max(most, kOfNoise * said.noise());
            const float density =
                std::min(kMostCloser, error_of_spread(static_cast<double>(said.relative_excess())) / allowed);
            any |= density > 1.0f && bring_closer(k, density, least);
        }
        if (!any) return;
        fill();
    }
}

std::vector<float> Placement::noise() const
{
    return noise_around(gatherer_.rays(), gbuffer_, view_, options_.error_tolerance, pixels_, pool_, records_,
                        noise_fall());
}

void Placement::refine(std::span<const int> extra)
{
    gatherer_.gather_more(gbuffer_, pixels_, extra, records(), pool_, stats_, report_);
    trust_gradients(records(), options_);
}

void place_records(const LitScene& scene, const GBuffer& gbuffer, const View& view, const RecordSettings& options,
                   ThreadPool& pool, std::vector<Record>& records, RecordStats& stats, const ProgressFunction& progress)
{
    float done = 0.0f;
    Placement placement(scene, gbuffer, view, options, pool, records, stats, [&](float fraction) {
        if (progress && !progress("records", done + 0.5f * fraction))
            throw Error(ErrorCode::cancelled, "cancelled while gathering records");
    });
    placement.fill();
    if (options.steepest < 1.0f) placement.sharpen();
    done = 0.5f;  // refining takes about as long
    const float widest = options.error_tolerance * options.max_reach;
    placement.refine(extra_gathers(placement.records(), placement.noise(), placement.rays(), options.noise_target,
                                   widest, options.refinement * options.rays));
}

}  // namespace rcs
