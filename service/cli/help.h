#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include "cli/describe.h"

namespace rcs::service {

/// Text in lines of at most `width` columns that all begin with `indent` blanks but the first, which goes on from
/// there.
std::string wrapped(const std::string& text, std::size_t indent, std::size_t width);

/// What --help prints: options by groups, without those for experts where there are many; --help-all prints all.
std::string help_text(const CommandText& command, bool all);

/// Lets an application print help_text().
class HelpFormatter : public CLI::FormatterBase {
public:
    std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override;
};

}  // namespace rcs::service
