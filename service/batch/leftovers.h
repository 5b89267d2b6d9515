#pragma once

#include <set>
#include <string>

namespace rcs::service {

/// Removes what processes that were killed have left half written of these files.
/// @param scratch  files that only such a process leaves
void remove_leftovers(const std::set<std::string>& paths, const std::set<std::string>& scratch);

}  // namespace rcs::service
