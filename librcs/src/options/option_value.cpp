#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "rcs/error.h"
#include "rcs/option_table.h"

namespace rcs {
namespace {

template <typename Owner, typename Value>
Value value_in(Value Owner::*);  // for its type
template <typename Field>
using ValueOf = decltype(value_in(Field{}));

std::string list(std::span<const std::string_view> names)
{
    std::string text;
    for (const std::string_view name : names) text.append(text.empty() ? "" : ", ").append(name);
    return text;
}

std::vector<std::string_view> effect_names()
{
    std::vector<std::string_view> names;
    for (std::size_t i = 0; i < kEffects; ++i) names.push_back(name_of(static_cast<Effect>(i)));
    return names;
}

// Of each type that a value can have: what is expected of it, its text, what a text says, and whether it is sound.

template <typename Number>
    requires std::is_arithmetic_v<Number>
std::string expected(const OptionInfo& option, const Number*)
{
    return words_of(option.range, std::is_integral_v<Number>);
}
template <typename Choice>
    requires std::is_enum_v<Choice>
std::string expected(const OptionInfo& option, const Choice*)
{
    return "one of " + list(option.choices);
}
std::string expected(const OptionInfo& option, const std::optional<double>*) { return words_of(option.range, false); }
std::string expected(const OptionInfo&, const std::optional<Crop>*)
{
    return "X,Y,WIDTH,HEIGHT, whole numbers, within the picture";
}
std::string expected(const OptionInfo&, const EffectSet*) { return "one of " + list(effect_names()); }

template <typename Number>
    requires std::is_arithmetic_v<Number>
std::string text_of_value(const OptionInfo&, Number value)
{
    return number_text(value);
}
template <typename Choice>
    requires std::is_enum_v<Choice>
std::string text_of_value(const OptionInfo& option, Choice value)
{
    const auto index = static_cast<std::size_t>(value);
    return index < option.choices.size() ? std::string(option.choices[index]) : number_text(static_cast<int>(value));
}
std::string text_of_value(const OptionInfo&, const std::optional<double>& value)
{
    return value ? number_text(*value) : "";
}
std::string text_of_value(const OptionInfo&, const std::optional<Crop>& value)
{
    if (!value) return "";
    std::string text;
    for (const int number : {value->x, value->y, value->width, value->height})
        text.append(text.empty() ? "" : ",").append(number_text(number));
    return text;
}
std::string text_of_value(const OptionInfo&, EffectSet value)
{
    std::string names;
    for (std::size_t i = 0; i < kEffects; ++i) {
        const auto effect = static_cast<Effect>(i);
        if (value.has(effect)) names.append(names.empty() ? "" : ",").append(name_of(effect));
    }
    return names;
}

template <typename Number>
    requires std::is_arithmetic_v<Number>
void read(const OptionInfo& option, std::string_view text, Number& value)
{
    for (const auto& [ending, factor] : option.suffixes) {
        if (!text.ends_with(ending)) continue;
        const auto number = read_number(text.substr(0, text.size() - ending.size()));
        if (!number) refuse_value(option.key, text, expected_of(option));
        value = static_cast<Number>(factor * *number);
        return;
    }
    value = parse_number<Number>(option.key, text, option.range);
}
template <typename Choice>
    requires std::is_enum_v<Choice>
void read(const OptionInfo& option, std::string_view text, Choice& value)
{
    const auto found = std::find(option.choices.begin(), option.choices.end(), text);
    if (found == option.choices.end()) refuse_value(option.key, text, expected_of(option));
    value = static_cast<Choice>(found - option.choices.begin());
}
void read(const OptionInfo& option, std::string_view text, std::optional<double>& value)
{
    value = parse_number<double>(option.key, text, option.range);
}
void read(const OptionInfo& option, std::string_view text, std::optional<Crop>& value)
{
    std::array<int, 4> numbers{};
    std::string_view rest = text;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        const std::size_t end = i + 1 < numbers.size() ? rest.find(',') : rest.size();
        const auto number = end == rest.npos ? std::nullopt : read_number(rest.substr(0, end));
        if (!number || std::abs(*number) > 1e9 || *number != std::floor(*number))
            refuse_value(option.key, text, expected_of(option));
        numbers[i] = static_cast<int>(*number);
        rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    value = Crop{numbers[0], numbers[1], numbers[2], numbers[3]};
}
void read(const OptionInfo& option, std::string_view text, EffectSet& value)
{
    const std::vector<std::string_view> names = effect_names();
    value = {};
    for (std::size_t begin = 0; begin <= text.size();) {
        const std::size_t end = std::min(text.find(',', begin), text.size());
        const std::string_view name = text.substr(begin, end - begin);
        if (std::find(names.begin(), names.end(), name) == names.end())
            refuse_value(option.key, name, expected_of(option));
        value.set(find_effect(name));
        begin = end + 1;
    }
}

template <typename Number>
    requires std::is_arithmetic_v<Number>
void check(const OptionInfo& option, Number value)
{
    check_number(option.key, value, option.range);
}
template <typename Choice>
    requires std::is_enum_v<Choice>
void check(const OptionInfo& option, Choice value)
{
    if (static_cast<std::size_t>(value) >= option.choices.size())
        refuse_value(option.key, text_of_value(option, value), expected_of(option));
}
void check(const OptionInfo& option, const std::optional<double>& value)
{
    if (value) check_number(option.key, *value, option.range);
}
void check(const OptionInfo&, const std::optional<Crop>&) {}  // with the picture's size
void check(const OptionInfo&, EffectSet) {}

bool lies_within(const Crop& crop, const RenderOptions& picture)
{
    const auto fits = [](int begin, int size, int whole) { return begin >= 0 && size >= 1 && begin <= whole - size; };
    return fits(crop.x, crop.width, picture.width) && fits(crop.y, crop.height, picture.height);
}

template <typename Owner, typename Value>
std::size_t quality_of_member(Value Owner::*)
{
    if constexpr (std::is_constructible_v<Quality, Owner>) return Quality(Owner{}).index();
    return kAnyQuality;
}

}  // namespace

std::string expected_of(const OptionInfo& option)
{
    return std::visit(
        [&](auto field) { return expected(option, static_cast<const ValueOf<decltype(field)>*>(nullptr)); },
        option.field);
}

void set_from_text(const OptionInfo& option, RenderOptions& options, std::string_view text)
{
    if (text.starts_with(option.prefix)) text.remove_prefix(option.prefix.size());
    change_value(option, options, [&](auto& value) {
        read(option, text, value);
        check(option, value);
    });
}

std::string text_of(const OptionInfo& option, const RenderOptions& options)
{
    std::string text;
    with_value(option, options,
               [&](const auto& value) { text = std::string(option.prefix) + text_of_value(option, value); });
    return text;
}

std::vector<std::pair<std::string, std::string>> list_options(const RenderOptions& options)
{
    std::vector<std::pair<std::string, std::string>> listed;
    for (const OptionInfo& option : option_table()) {
        const std::string text = text_of(option, options);
        if (text.empty()) continue;
        std::string name(option.name.substr(2));
        if (!listed.empty() && listed.back().first == name)
            listed.back().second += "x" + text;  // width and height
        else
            listed.emplace_back(std::move(name), text);
    }
    return listed;
}

std::size_t quality_of(const OptionInfo& option)
{
    return std::visit([](auto field) { return quality_of_member(field); }, option.field);
}

void check_quality(std::span<const OptionInfo* const> given)
{
    std::string kinds;
    int count = 0;
    for (std::size_t kind = 0; kind < std::size(kQualities); ++kind) {
        if (std::none_of(given.begin(), given.end(), [&](const OptionInfo* o) { return quality_of(*o) == kind; }))
            continue;
        kinds.append(kinds.empty() ? "" : " and ").append(kQualities[kind]);
        ++count;
    }
    if (count > 1) refuse_value("quality", kinds, "one of " + list(kQualities));
}

void validate(const RenderOptions& options)
{
    for (const OptionInfo& option : option_table())
        with_value(option, options, [&](const auto& value) { check(option, value); });
    // What two options have to do with each other.
    if (options.min_reach > options.max_reach)
        refuse_value("min_reach", number_text(options.min_reach),
                     "at most max_reach, which is " + number_text(options.max_reach));
    if (options.crop && !lies_within(*options.crop, options))
        refuse_value("crop", text_of(find_option("crop"), options),
                     "X,Y,WIDTH,HEIGHT, at least one pixel, within the picture of " + number_text(options.width) + "x" +
                         number_text(options.height));
    if (options.f_stop && !options.focus) refuse_value("focus", "not given", "a distance, as f_stop is given");
    if (options.focus && !options.f_stop) refuse_value("f_stop", "not given", "an f-number, as focus is given");
    if (options.f_stop && options.aa < 2)
        refuse_value("aa", number_text(options.aa), "at least 2 with f_stop: each sample is another point of the lens");
    for (std::size_t i = 0; i < kEffects; ++i) {
        const auto effect = static_cast<Effect>(i);
        if (options.effects.with.has(effect) && options.effects.without.has(effect))
            refuse_value("without_effects", name_of(effect), "none of with_effects");
    }
}

}  // namespace rcs
