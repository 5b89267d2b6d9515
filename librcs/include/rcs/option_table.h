#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "rcs/api.h"
#include "rcs/number_range.h"
#include "rcs/render_options.h"

/// What a user can ask of a render, said once: validation, command line, help, wire, fingerprints, record files and
/// reports read this table. A new option is a member of RenderOptions, a row here and a field of options.proto.
namespace rcs {

/// The member that holds an option's value.
using OptionField = std::variant<int RenderOptions::*, float RenderOptions::*, std::uint64_t RenderOptions::*,
                                 SplatMethod RenderOptions::*, GatherMethod RenderOptions::*, Denoiser RenderOptions::*,
                                 std::optional<Crop> RenderOptions::*, std::optional<double> RenderOptions::*,
                                 EffectSet EffectChoice::*, int QualitySettings::*, float QualitySettings::*,
                                 double TargetError::*, double TargetIndirectError::*, double Budget::*>;

/// What a value's text may end in, and what that multiplies it by.
struct UnitSuffix {
    std::string_view text;  ///< "%", "s", "m"
    double factor = 1.0;    ///< > 0
};

/// Whether records gathered with other values serve as well.
enum class RecordUse {
    free,     ///< any value serves
    bound,    ///< only the same value
    by_goal,  ///< only the same value where the estimated error steers what is gathered
};

/// Where help and manual list an option.
enum class OptionGroup { picture, quality, records, direct, effects };

/// An option: what it is called, what it may be, and what it does.
struct OptionInfo {
    std::string_view key;    ///< of messages, refusals and fingerprints: the member's name, as "error_tolerance"
    std::string_view name;   ///< of the command line, without dashes also of reports, metadata and record files
    OptionField field;       ///< where its value lies
    NumberRange range = {};  ///< of numbers
    std::span<const std::string_view> choices = {};  ///< of an enumeration, in its order
    std::string_view given_alone = {};               ///< what it means without a value; "": it takes one
    std::string_view prefix = {};                    ///< of its text, where rows of one name differ by it
    std::string_view unit = {};                      ///< as text, "" where it is a plain number or says so itself
    std::span<const UnitSuffix> suffixes = {};       ///< that its text may end in
    RecordUse records = RecordUse::free;             ///< whether records of other values serve
    OptionGroup group = OptionGroup::records;        ///< where help lists it
    std::string_view help = {};                      ///< one sentence, without its range
};

/// In the order of --help.
RCS_API std::span<const OptionInfo> option_table();
/// The first row with that key. @throws Error internal: there is none
RCS_API const OptionInfo& find_option(std::string_view key);
/// Of the rows that share a row's name, the one whose prefix a text begins with; else that row.
RCS_API const OptionInfo& option_for(const OptionInfo& option, std::string_view text);

/// "a whole number in [16, 65536]", "one of auto, quads, tiles, gpu-tiles".
RCS_API std::string expected_of(const OptionInfo& option);

/// Reads a value as the command line takes it, with or without the row's prefix; one of quality makes the options'
/// quality of its kind.
/// @throws Error bad_argument: the field, its value and its range
RCS_API void set_from_text(const OptionInfo& option, RenderOptions& options, std::string_view text);
/// The text that reads back as the same value; "" for one that belongs to another quality.
RCS_API std::string text_of(const OptionInfo& option, const RenderOptions& options);

/// Names without dashes and texts of the values that options have, in the table's order.
RCS_API std::vector<std::pair<std::string, std::string>> list_options(const RenderOptions& options);

/// The kinds of quality by their names on the wire.
inline constexpr std::string_view kQualities[] = {"settings", "target_error", "budget_seconds",
                                                  "target_indirect_error"};
static_assert(std::size(kQualities) == std::variant_size_v<Quality>);
/// Of an option that belongs to no kind of quality.
inline constexpr std::size_t kAnyQuality = std::variant_npos;
/// Which kind of quality an option belongs to, as an index; else kAnyQuality.
RCS_API std::size_t quality_of(const OptionInfo& option);
/// A quality is of one kind. @param given  options that somebody wants to set
/// @throws Error bad_argument: the kinds that are mixed
RCS_API void check_quality(std::span<const OptionInfo* const> given);

/// The struct that `field` is a member of, within the options; null if they have another quality.
template <typename Options, typename Owner, typename Value>
auto* owner_of(Options& options, Value Owner::*)
{
    if constexpr (std::is_same_v<Owner, RenderOptions>) {
        return &options;
    } else if constexpr (std::is_same_v<Owner, EffectChoice>) {
        return &options.effects;
    } else {
        return std::get_if<Owner>(&options.quality);
    }
}

/// Calls `use` with the value, unless it belongs to another quality. @return whether it did
template <typename Use>
bool with_value(const OptionInfo& option, const RenderOptions& options, const Use& use)
{
    return std::visit(
        [&](auto field) {
            const auto* owner = owner_of(options, field);
            if (owner != nullptr) use(owner->*field);
            return owner != nullptr;
        },
        option.field);
}

/// Calls `change` with the value to be set, in options whose quality becomes that of the option.
template <typename Owner, typename Value, typename Change>
void change_value(RenderOptions& options, Value Owner::* field, const Change& change)
{
    if (owner_of(options, field) == nullptr) {
        if constexpr (std::is_constructible_v<Quality, Owner>) options.quality = Owner{};
    }
    change(owner_of(options, field)->*field);
}
/// The same, whatever the type of the option's value.
template <typename Change>
void change_value(const OptionInfo& option, RenderOptions& options, const Change& change)
{
    std::visit([&](auto field) { change_value(options, field, change); }, option.field);
}

}  // namespace rcs
