#pragma once

#include <cstdint>
#include <vector>

#include "accuracy/error_estimate.h"
#include "accuracy/error_scale.h"
#include "rcs/gbuffer.h"
#include "rcs/records.h"
#include "records/gather.h"

namespace rcs {

/// Independent gathers at pixels all over a picture. How a splat differs from two gathers that know nothing of it, and
/// they from each other, tells its error without theirs: also of light that every record missed. They take part in
/// nothing else.
class Probes {
public:
    /// @param scene  its guide learns nothing from probes   @param settings  the records'
    Probes(const LitScene& scene, const GBuffer& gbuffer, const RecordSettings& settings, ThreadPool& pool);

    /// Shoots rays until there are about so many; the first ones also settle at which pixels, as many where a map tells
    /// of much error as where it tells of little. @param sums, map  of a splat
    void spend(double rays, const SplatBuffer& sums, const ErrorMap& map);

    /// Of a splat onto the same pixels.
    ErrorScale compare(const SplatBuffer& sums, const ErrorMap& map) const;

    std::uint64_t rays() const { return rays_; }

    /// What is worth to be spent where records took so many.
    static double worth(double record_rays);

private:
    void choose_pixels(std::size_t count, const SplatBuffer& sums, const ErrorMap& map);

    const GBuffer& gbuffer_;
    ThreadPool& pool_;
    std::uint64_t seed_;
    RecordGatherer gatherer_;
    std::vector<std::uint32_t> pixels_;
    std::vector<Sounding> halves_[2];
    std::uint64_t sample_ = 0, rays_ = 0;
};

}  // namespace rcs
