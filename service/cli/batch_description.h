#pragma once

#include <string>
#include <vector>

namespace rcs::service {

/// A command line in which `batch --config FILE` has become what the file says: options by their names without dashes,
/// `scene` the one without a name; those of the command line come first.
/// @throws rcs::Error not_found; bad_argument that names the file
std::vector<std::string> with_description(std::vector<std::string> words);

}  // namespace rcs::service
