#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace rcs {

/// Numbers that a field may have.
struct NumberRange {
    double least = 0.0;
    double most = 0.0;
    bool open = false;  ///< `least` itself is left out
};

/// "(0, 1]"
std::string interval_text(const NumberRange& range, bool whole);
/// "a value in (0, 1]", of whole numbers "a whole number in [16, 65536]".
std::string words_of(const NumberRange& range, bool whole);

/// The shortest text that reads back as the same value; "nan", "inf", "-inf". Of int, std::uint64_t, float and double.
template <typename Number>
std::string number_text(Number value);

/// Every refusal of a value is worded here. @throws Error bad_argument "FIELD is VALUE, expected RANGE"
[[noreturn]] void refuse_value(std::string_view field, std::string_view value, std::string_view expected);

/// @throws Error bad_argument: the field, its value and its range
template <typename Number>
void check_number(std::string_view field, Number value, const NumberRange& range);

/// As C reads it, but neither hexadecimal nor after spaces; none: it is no number.
std::optional<double> read_number(std::string_view text);

/// What a text says, once rounded to Number; "1e3" is a whole number.
/// @throws Error bad_argument: the field, its value and its range
template <typename Number>
Number parse_number(std::string_view field, std::string_view text, const NumberRange& range);

}  // namespace rcs
