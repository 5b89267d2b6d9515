#include "cli/describe.h"

#include <algorithm>

#include <CLI/CLI.hpp>

namespace rcs::service {
namespace {

std::vector<std::string> split_choices(const std::string& value)
{
    std::vector<std::string> choices = CLI::detail::split(value, '|');
    const bool known = std::all_of(choices.begin(), choices.end(), [](const std::string& choice) {
        return !choice.empty() &&
               std::all_of(choice.begin(), choice.end(), [](char c) { return (c >= 'a' && c <= 'z') || c == '-'; });
    });
    return choices.size() > 1 && known ? choices : std::vector<std::string>{};
}

OptionText describe(const CLI::Option& option)
{
    OptionText text;
    if (option.get_positional()) {
        text.names = {option.get_name(true)};
    } else {
        for (const std::string& name : option.get_lnames()) text.names.push_back("--" + name);
        for (const std::string& name : option.get_snames()) text.names.push_back("-" + name);
    }
    const bool is_flag = option.get_expected_max() == 0;
    if (!is_flag) {
        text.value = option.get_type_name();
        text.choices = split_choices(text.value);
        text.by_default = option.get_default_str();
    }
    text.help = option.get_description();
    text.group = option.get_group() == "Options" ? option_group::kOther : option.get_group();  // CLI11's own
    text.required = option.get_required();
    return text;
}

}  // namespace

CommandText describe(const CLI::App& app, const std::string& name)
{
    CommandText text{name, app.get_description(), app.get_footer(), {}, {}, {}};
    for (const CLI::Option* option : app.get_options()) {
        if (option->get_group().empty()) continue;
        (option->get_positional() ? text.words : text.options).push_back(describe(*option));
    }
    for (const CLI::App* command : app.get_subcommands([](const CLI::App* c) { return !c->get_group().empty(); }))
        text.commands.push_back(describe(*command, name + " " + command->get_name()));
    return text;
}

std::string last_word(const std::string& name) { return name.substr(name.rfind(' ') + 1); }

const std::vector<std::string>& option_groups()
{
    using namespace option_group;
    static const std::vector<std::string> groups = {kView,  kQuality, kOutput,  kFrames,  kFarm,   kServe,
                                                    kPage,  kServer,  kCamera,  kRecords, kDirect, kEffects,
                                                    kFiles, kLimits,  kMachine, kOther};
    return groups;
}

bool is_for_experts(const std::string& group)
{
    using namespace option_group;
    const auto is = [&](const char* name) { return group == name; };
    return is(kCamera) || is(kRecords) || is(kDirect) || is(kEffects) || is(kFiles) || is(kLimits) || is(kServer) ||
           is(kMachine) || is(kFarm);
}

}  // namespace rcs::service
