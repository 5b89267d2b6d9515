#pragma once

#include <string>

namespace rcs::service {

/// What the file of a job's output is called in a folder, with a place for the frame's number where there are several.
/// @param given   the name that whoever submitted it gave; taken only if it is a plain one that is not hidden
/// @param output  the output's name, which does else
std::string delivered_name(const std::string& given, const std::string& output, int frames);

}  // namespace rcs::service
