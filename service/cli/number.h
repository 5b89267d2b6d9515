#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace rcs::service {

/// A range as a person reads it: both its check and its place in --help come from here.
struct Range {
    double least = 0.0;
    double most = 0.0;
    bool open = false;  ///< `least` itself is left out
};

inline constexpr double kLargestSeed = 4294967295.0;  // 2^32 - 1

/// Adds a number; its help ends in the range, and shows the default that `value` holds.
template <typename Number>
CLI::Option* add_number(CLI::App& app, const std::string& name, Number& value, Range range, const std::string& help);

/// Reads one number and what follows it. @return false if there is none
bool take_number(const char*& cursor, double& value);

}  // namespace rcs::service
