#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "rcs/api.h"

namespace rcs {

/// Numbers that a field may have.
struct NumberRange {
    double least = 0.0;  ///< lower end
    double most = 0.0;   ///< upper end, part of it
    bool open = false;   ///< `least` itself is left out
};

/// "(0, 1]"
RCS_API std::string interval_text(const NumberRange& range, bool whole);
/// "a value in (0, 1]", of whole numbers "a whole number in [16, 65536]".
RCS_API std::string words_of(const NumberRange& range, bool whole);

/// The shortest text that reads back as the same value; "nan", "inf", "-inf". Of int, std::uint64_t, float and double.
template <typename Number>
RCS_API std::string number_text(Number value);

/// Every refusal of a value is worded here. @throws Error bad_argument "FIELD is VALUE, expected RANGE"
[[noreturn]] RCS_API void refuse_value(std::string_view field, std::string_view value, std::string_view expected);

/// @throws Error bad_argument: the field, its value and its range
template <typename Number>
RCS_API void check_number(std::string_view field, Number value, const NumberRange& range);

/// As C reads it, but neither hexadecimal nor after spaces; none: it is no number.
RCS_API std::optional<double> read_number(std::string_view text);

/// What a text says, once rounded to Number; "1e3" is a whole number.
/// @throws Error bad_argument: the field, its value and its range
template <typename Number>
RCS_API Number parse_number(std::string_view field, std::string_view text, const NumberRange& range);

}  // namespace rcs
