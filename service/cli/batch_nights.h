#pragma once

#include <string>
#include <vector>

#include "cli/batch_run.h"

namespace rcs::service {

/// Puts the night's date in the place of "{night}", wherever it stands, and keeps what was given.
/// @throws rcs::Error bad_argument: nights are to be kept that no output tells apart
void begin_night(BatchArguments& arguments);

/// Removes nights before the last ones that are to be kept. @return a line for each
/// @param really  else only says so
std::vector<std::string> remove_old_nights(const BatchArguments& arguments, bool really);

/// Notes what the report's files are, if it is one of a night, for the night that removes them. @throws rcs::Error io
void note_report(const BatchArguments& arguments, const std::string& folder);

}  // namespace rcs::service
