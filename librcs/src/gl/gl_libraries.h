#pragma once

#include <initializer_list>

namespace rcs {

/// Whether one of these libraries can be opened: epoxy opens them by their names, and ends the program where it cannot.
/// @param package  that has them on Debian   @throws rcs::Error gl_unavailable
void expect_library(std::initializer_list<const char*> any_of, const char* package);

}  // namespace rcs
