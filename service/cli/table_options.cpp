#include "cli/table_options.h"

#include <cstddef>
#include <string_view>

#include "cli/parse.h"
#include "rcs/error.h"

namespace rcs::service {
namespace {

constexpr std::string_view kSize = "--size";

bool is_list(const OptionInfo& option) { return std::holds_alternative<EffectSet EffectChoice::*>(option.field); }

/// "N", "quads|tiles|auto", "EFFECT,..."
std::string type_of(const OptionInfo& option)
{
    if (is_list(option)) return "EFFECT,...";
    std::string choices;
    for (const std::string_view choice : option.choices) choices.append(choices.empty() ? "" : "|").append(choice);
    return choices.empty() ? "N" : choices;
}

std::string help_of(const OptionInfo& option)
{
    std::string help(option.help);
    if (!option.unit.empty()) help.append(" [").append(option.unit).append("]");
    const bool whole = expected_of(option).starts_with("a whole");
    if (option.choices.empty() && !is_list(option)) help += ", in " + interval_text(option.range, whole);
    return help;
}

}  // namespace

std::string& OptionTexts::of(const OptionInfo& option)
{
    return texts[static_cast<std::size_t>(&option - option_table().data())];
}

CLI::Option* add_table_option(CLI::App& command, const OptionInfo& option, const RenderOptions& defaults,
                              OptionTexts& texts)
{
    const auto parse = [&option](const std::string& text) {
        RenderOptions options;
        set_from_text(option, options, text);
    };
    CLI::Option* added = command.add_option(std::string(option.name), texts.of(option), help_of(option))
                             ->type_name(type_of(option))
                             ->check(checked_by(parse), "")
                             ->default_str(text_of(option, defaults));
    if (quality_of(option) != kAnyQuality) added->group("Quality: settings, a target error or a budget");
    if (is_list(option)) added->join(',')->allow_extra_args(false);
    return added;
}

void add_table_options(CLI::App& command, const RenderOptions& defaults, OptionTexts& texts)
{
    for (const OptionInfo& option : option_table())
        if (option.name != kSize) add_table_option(command, option, defaults, texts);
}

RenderOptions read_options(const OptionTexts& texts, const RenderOptions& defaults)
{
    RenderOptions options = defaults;
    std::vector<const OptionInfo*> given;
    std::string names;  // of those that say something about quality
    for (std::size_t i = 0; i < texts.texts.size(); ++i) {
        if (texts.texts[i].empty()) continue;
        const OptionInfo& option = option_table()[i];
        given.push_back(&option);
        if (quality_of(option) != kAnyQuality) names.append(names.empty() ? "" : ", ").append(option.name);
    }
    try {
        check_quality(given);
    } catch (const Error& e) {
        throw Error(e.code(), names + ": " + e.what());
    }
    for (const OptionInfo* option : given)
        set_from_text(*option, options, texts.texts[static_cast<std::size_t>(option - option_table().data())]);
    return options;
}

void validate_named(const RenderOptions& options)
{
    try {
        validate(options);
    } catch (const Error& e) {
        for (const OptionInfo& option : option_table())
            if (std::string_view(e.what()).starts_with(std::string(option.key) + " is "))
                throw Error(e.code(), std::string(option.name) + ": " + e.what());
        throw;
    }
}

}  // namespace rcs::service
