#pragma once

#include <map>
#include <string>

namespace rcs {

/// The files of shaders/, by their path below that folder.
const std::map<std::string, std::string>& shader_sources();

}  // namespace rcs
