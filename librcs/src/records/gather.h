#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "rcs/records.h"

namespace rcs {

/// Irradiance at a place, on luminance [W m^-2].
struct Sounding {
    double light = 0.0;
    int rays = 0;
};

/// Looks at lit points that the first gather at a place has room for, of so many rays.
int most_first_looks(int rays);

/// gather_records() for many batches on one scene: what depends on the scene and options alone is
/// prepared once.
class RecordGatherer {
public:
    RecordGatherer(const LitScene& scene, const RecordSettings& options);
    ~RecordGatherer();

    std::vector<Record> gather(const GBuffer& gbuffer, const std::vector<std::uint32_t>& pixels, ThreadPool& pool,
                               RecordStats& stats) const;

    /// Of one gather: hemisphere rays, about options.rays with the looks at lit points.
    int rays() const;
    /// Whether some of them are looks at lit points.
    bool looks() const;

    /// Gathers again where record i was born, or at its pixel where that is not known, with extra[i] times as many rays
    /// as rays(), other ones, and averages them into the record.
    /// @param report  told the fraction done, on this thread; may throw
    void gather_more(const GBuffer& gbuffer, std::span<const std::uint32_t> pixels, std::span<const int> extra,
                     std::span<Record> records, ThreadPool& pool, RecordStats& stats,
                     const std::function<void(float)>& report) const;

    /// Gathers some records again where they are, with the rays they have, or the first of them.
    /// @param which  indices   @param rays  about how many, for each of these; those of a first gather at the least
    void renew(std::span<Record> records, std::span<const std::uint32_t> which, std::span<const int> rays,
               ThreadPool& pool, RecordStats& stats) const;
    /// The same with all of them.
    void renew(std::span<Record> records, std::span<const std::uint32_t> which, ThreadPool& pool,
               RecordStats& stats) const;

    /// What arrives at pixels by gathers that no record has part in, of about `rays` rays each. Nothing is learned from
    /// them.
    /// @param sample  sets them apart: each has its own rays
    std::vector<Sounding> sound(const GBuffer& gbuffer, std::span<const std::uint32_t> pixels, int rays,
                                std::uint64_t sample, ThreadPool& pool) const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace rcs
