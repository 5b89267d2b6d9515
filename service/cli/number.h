#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include "rcs/number_range.h"

namespace rcs::service {

/// Adds a number; its help ends in the range, and shows the default that `value` holds.
template <typename Number>
CLI::Option* add_number(CLI::App& app, const std::string& name, Number& value, const NumberRange& range,
                        const std::string& help);

/// Reads one finite number and what follows it. @return false if there is none
bool take_number(const char*& cursor, double& value);

}  // namespace rcs::service
