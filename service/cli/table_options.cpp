#include "cli/table_options.h"

#include <cstddef>
#include <string_view>

#include "cli/describe.h"
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
    if (std::holds_alternative<std::optional<Crop> RenderOptions::*>(option.field)) return "X,Y,W,H";
    std::string choices;
    for (const std::string_view choice : option.choices) choices.append(choices.empty() ? "" : "|").append(choice);
    return choices.empty() ? "N" : choices;
}

/// "; did you mean 5%?" of a number that is out of range but for its unit, or how units are written; or "".
std::string with_suffix(const OptionInfo& option, const std::string& text)
{
    std::string endings;
    for (const auto& [ending, factor] : option.suffixes) {
        const auto number = read_number(text);
        const double value = factor * number.value_or(0.0);
        const NumberRange& range = option.range;
        const bool fits = value <= range.most && (range.open ? value > range.least : value >= range.least);
        if (number && factor != 1.0 && fits) return "; did you mean " + text + std::string(ending) + "?";
        endings.append(endings.empty() ? "" : " or ").append(ending);
    }
    return endings.empty() ? "" : "; it may end in " + endings;
}

std::string help_of(const OptionInfo& option)
{
    std::string help(option.help);
    if (!option.unit.empty()) help.append(" [").append(option.unit).append("]");
    const bool whole = expected_of(option).starts_with("a whole");
    if (option.range.most > option.range.least) help += ", in " + interval_text(option.range, whole);
    return help;
}

}  // namespace

const char* group_of(const OptionInfo& option)
{
    switch (option.group) {
        case OptionGroup::picture:
            return option_group::kView;
        case OptionGroup::quality:
            return option_group::kQuality;
        case OptionGroup::records:
            return option_group::kRecords;
        case OptionGroup::direct:
            return option_group::kDirect;
        case OptionGroup::effects:
            return option_group::kEffects;
    }
    return option_group::kOther;
}

std::string& OptionTexts::of(const OptionInfo& option)
{
    return texts[static_cast<std::size_t>(&option - option_table().data())];
}

CLI::Option* add_table_option(CLI::App& command, const OptionInfo& option, const RenderOptions& defaults,
                              OptionTexts& texts)
{
    const auto parse = [&option](const std::string& text) {
        try {
            RenderOptions options;
            set_from_text(option_for(option, text), options, text);
        } catch (const Error& e) {
            throw Error(e.code(), e.what() + with_suffix(option, text));
        }
    };
    const std::string name(option.name), alone(option.given_alone);
    CLI::Option* added = alone.empty() ? command.add_option(name, texts.of(option), help_of(option))
                                       : command.add_flag(name + "{" + alone + "}", texts.of(option), help_of(option));
    added->type_name(type_of(option))->check(checked_by(parse), "")->default_str(text_of(option, defaults));
    added->group(group_of(option));
    if (is_list(option)) added->join(',')->allow_extra_args(false);
    return added;
}

void add_table_options(CLI::App& command, const RenderOptions& defaults, OptionTexts& texts)
{
    for (const OptionInfo& option : option_table())
        if (option.name != kSize && option.prefix.empty()) add_table_option(command, option, defaults, texts);
}

RenderOptions read_options(const OptionTexts& texts, const RenderOptions& defaults)
{
    RenderOptions options = defaults;
    std::vector<const OptionInfo*> given;
    std::vector<const std::string*> values;
    std::string names;  // of those that say something about quality
    for (std::size_t i = 0; i < texts.texts.size(); ++i) {
        if (texts.texts[i].empty()) continue;
        const OptionInfo& option = option_for(option_table()[i], texts.texts[i]);
        given.push_back(&option);
        values.push_back(&texts.texts[i]);
        if (quality_of(option) != kAnyQuality) names.append(names.empty() ? "" : ", ").append(option.name);
    }
    try {
        check_quality(given);
    } catch (const Error& e) {
        throw Error(e.code(), names + ": " + e.what());
    }
    for (std::size_t i = 0; i < given.size(); ++i) set_from_text(*given[i], options, *values[i]);
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
