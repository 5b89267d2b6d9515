#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "rcs/records.h"
#include "rcs/scene.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// What became another in a scene.
struct SceneChange {
    std::uint32_t state = 0;                 ///< since when it is so
    bool everywhere = false;                 ///< light may have changed everywhere
    std::vector<Bounds> where{};             ///< of all else, as it was and as it is
    std::vector<std::uint32_t> instances{};  ///< that moved or became others, ascending
};

/// The scenes that a session has shown one after the other, by number.
struct SceneStates {
    std::uint32_t now = 0;
    std::span<const std::uint32_t> changed{};  ///< per instance: since when it has been where and what it is
    std::span<const SceneChange> changes{};    ///< of the last scenes, ascending
    /// Instances that have changed from the scene before to this one, ascending.
    std::span<const std::uint32_t> in_motion() const
    {
        return changes.empty() || changes.back().state != now ? std::span<const std::uint32_t>{}
                                                              : std::span(changes.back().instances);
    }
    Bounds box{};  ///< around what most ways lie in; the same for all of the scenes
};

/// Looks at records' light along a few rays, the same ones each time: what they bring now less what they brought before
/// is what has changed, free of the noise that both have (a control variate). Where nothing that the rays meet has
/// changed, it is exactly 0.
class RecordWatcher {
public:
    RecordWatcher(const LitScene& scene, const RecordSettings& options);
    ~RecordWatcher();

    /// Begins to watch those records that are not watched yet, if it is known where they were born, and not on what has
    /// just moved: those hold in this scene alone.
    void begin(std::span<Record> records, const SceneStates& states, ThreadPool& pool, RecordStats& stats) const;

    /// Looks again at some of the records, all watched. @param which  their indices
    /// @return for each what has changed since: Gatherer::difference(); those whose rays would meet nothing that has
    /// changed are spared them
    std::vector<Record> look(std::span<Record> records, std::span<const std::uint32_t> which, const SceneStates& states,
                             ThreadPool& pool, RecordStats& stats) const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Adds to a record what has changed, and what is unsure of it to its noise. @return false: it would not be light
bool add_change(Record& record, const Record& change);

}  // namespace rcs
