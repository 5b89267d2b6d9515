#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "rcs/records.h"

namespace rcs {

/// gather_records() for many batches on one scene: what depends on the scene and options alone is
/// prepared once. @param cache  as for gather_records()
class RecordGatherer {
public:
    RecordGatherer(const RayScene& rays, const RecordOptions& options, const LightCache* cache);
    ~RecordGatherer();

    std::vector<Record> gather(const GBuffer& gbuffer, const std::vector<std::uint32_t>& pixels, ThreadPool& pool,
                               RecordStats& stats) const;

    /// Gathers again at record i's pixel, extra[i] times with other rays, and averages all into the record.
    void gather_more(const GBuffer& gbuffer, std::span<const std::uint32_t> pixels, std::span<const int> extra,
                     std::span<Record> records, ThreadPool& pool, RecordStats& stats) const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace rcs
