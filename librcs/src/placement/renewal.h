#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "rcs/records.h"
#include "records/watch.h"

namespace rcs {

/// What records of earlier views are brought up to date for.
struct Renewal {
    LitScene scene;  ///< as it is now
    const GBuffer& gbuffer;
    const View& view;
    RecordSettings settings;
    SceneStates states;
};

/// Whether any of the records knows an earlier scene alone.
bool are_stale(std::span<const Record> records, const SceneStates& states);

/// Brings records of earlier scenes up to date, each looked at along a few rays (RecordWatcher): they take on what they
/// and those around saw change as long as that is told more surely than their noise, and are gathered again where they
/// are if not (changes_around()). Those on or inside of what has moved go, those that nothing in view is near are laid
/// aside.
/// @param aside  records of earlier scenes, still not up to date: another view may be near them
/// @return how noisy new ones may be, over what is wanted, which will follow changes, too; 1 where none of these do
float renew_records(const Renewal& renewal, ThreadPool& pool, std::vector<Record>& records, std::vector<Record>& aside,
                    RecordStats& stats);

}  // namespace rcs
