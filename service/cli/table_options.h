#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/number.h"
#include "rcs/option_table.h"

namespace rcs::service {

/// What a command line says about the options of the table: a text for each, "" where it says nothing.
struct OptionTexts {
    std::vector<std::string> texts = std::vector<std::string>(option_table().size());

    std::string& of(const OptionInfo& option);
};

const char* group_of(const OptionInfo& option);

/// @param defaults  shown in the help
CLI::Option* add_table_option(CLI::App& command, const OptionInfo& option, const RenderOptions& defaults,
                              OptionTexts& texts);
/// All of them but --size, which goes with the scene.
void add_table_options(CLI::App& command, const RenderOptions& defaults, OptionTexts& texts);

/// A number of a command's own that means what the table says: its name, range and words, and `more` of them.
template <typename Number>
CLI::Option* add_number(CLI::App& command, const OptionInfo& option, Number& value, const std::string& more = "")
{
    CLI::Option* added =
        add_number(command, std::string(option.name), value, option.range, std::string(option.help) + more);
    return added->group(group_of(option));
}

/// `defaults` with what the texts say. @throws rcs::Error bad_argument that names the options
RenderOptions read_options(const OptionTexts& texts, const RenderOptions& defaults);

/// validate(), whose refusal then also says how the field is called on the command line.
void validate_named(const RenderOptions& options);

}  // namespace rcs::service
