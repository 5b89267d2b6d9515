#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace rcs::service {

/// What is wrong with a command line, in one sentence that says what was probably meant.
/// @param words  of the command line, the program's name not among them
std::string advice(const CLI::App& app, const std::vector<std::string>& words, const CLI::ParseError& error);

/// @throws rcs::Error bad_argument on "-o=a.png", which would name a file "=a.png"
void refuse_short_assignments(const std::vector<std::string>& words);

}  // namespace rcs::service
