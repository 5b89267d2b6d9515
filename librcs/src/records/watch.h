#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "rcs/records.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// Looks at records' light along a few rays, the same ones each time: what they bring now less what they brought before
/// is what has changed, free of the noise that both have (a control variate). Where nothing that the rays meet has
/// changed, it is exactly 0.
class RecordWatcher {
public:
    RecordWatcher(const LitScene& scene, const RecordSettings& options);
    ~RecordWatcher();

    /// Begins to watch those records that are not watched yet, if it is known where they were born.
    /// @param state  of the scene
    void begin(std::span<Record> records, std::uint32_t state, ThreadPool& pool, RecordStats& stats) const;

    /// Looks again at some of the records, all watched. @param which  their indices
    /// @return for each what has changed since: Gatherer::difference()
    std::vector<Record> look(std::span<Record> records, std::span<const std::uint32_t> which, std::uint32_t state,
                             ThreadPool& pool, RecordStats& stats) const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Adds to a record what has changed, and what is unsure of it to its noise. @return false: it would not be light
bool add_change(Record& record, const Record& change);

}  // namespace rcs
