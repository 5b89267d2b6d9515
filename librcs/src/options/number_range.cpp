#include "rcs/number_range.h"

#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <optional>
#include <type_traits>

#include "rcs/error.h"

namespace rcs {
namespace {

constexpr std::size_t kLongestEcho = 100;  // of what somebody wrote [bytes]

bool contains(const NumberRange& range, double value)
{
    return (range.open ? value > range.least : value >= range.least) && value <= range.most;
}

/// A limit of whole numbers; 2^64 stands for the largest one.
std::string whole_text(double limit)
{
    constexpr double kTwoTo64 = 18446744073709551616.0;
    return limit >= kTwoTo64 ? std::to_string(std::numeric_limits<std::uint64_t>::max()) : number_text(limit);
}

}  // namespace

std::optional<double> read_number(std::string_view text)
{
    if (text.empty() || text.size() > kLongestEcho || text.find_first_of(" \t\n\v\f\rxXpP(") != text.npos) return {};
    const std::string terminated(text);
    char* end = nullptr;
    const double value = std::strtod(terminated.c_str(), &end);
    if (*end != '\0') return {};
    return value;
}

std::string interval_text(const NumberRange& range, bool whole)
{
    const auto limit = [&](double value) { return whole ? whole_text(value) : number_text(value); };
    std::string text = range.open ? "(" : "[";
    return text.append(limit(range.least)).append(", ").append(limit(range.most)).append("]");
}

std::string words_of(const NumberRange& range, bool whole)
{
    std::string words = whole ? "a whole number in " : "a value in ";
    return words.append(interval_text(range, whole));
}

template <typename Number>
std::string number_text(Number value)
{
    if constexpr (std::is_integral_v<Number>) {
        return std::to_string(value);
    } else {
        if (std::isnan(value)) return "nan";
        // Digits that every such number has, up to those that tell any two apart.
        constexpr int kFewest = sizeof(Number) == sizeof(float) ? 6 : 12;
        constexpr int kMost = std::numeric_limits<Number>::max_digits10;
        char text[40];
        for (int digits = kFewest; digits <= kMost; ++digits) {
            std::snprintf(text, sizeof text, "%.*g", digits, static_cast<double>(value));
            if (static_cast<Number>(std::strtod(text, nullptr)) == value) break;
        }
        return text;
    }
}

void refuse_value(std::string_view field, std::string_view value, std::string_view expected)
{
    const std::string shown(value.empty() ? "empty" : value.substr(0, kLongestEcho));
    throw Error(ErrorCode::bad_argument, std::string(field) + " is " + shown + ", expected " + std::string(expected));
}

template <typename Number>
void check_number(std::string_view field, Number value, const NumberRange& range)
{
    if (!contains(range, static_cast<double>(value)))
        refuse_value(field, number_text(value), words_of(range, std::is_integral_v<Number>));
}

template <typename Number>
Number parse_number(std::string_view field, std::string_view text, const NumberRange& range)
{
    constexpr bool kWhole = std::is_integral_v<Number>;
    if constexpr (kWhole) {
        Number exact{};  // beyond 2^53 doubles have gaps
        const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), exact);
        if (problem == std::errc{} && end == text.data() + text.size()) {
            check_number(field, exact, range);
            return exact;
        }
    }
    const std::optional<double> value = read_number(text);
    if (!value) refuse_value(field, text, words_of(range, kWhole));
    if constexpr (kWhole) {
        // What is no number of this type at all is refused before it is made one.
        constexpr auto kEnd = static_cast<double>(std::numeric_limits<Number>::max());
        if (*value != std::floor(*value) || !contains(range, *value) || !(*value < kEnd))
            refuse_value(field, number_text(*value), words_of(range, true));
    }
    const auto rounded = static_cast<Number>(*value);
    check_number(field, rounded, range);
    return rounded;
}

template std::string number_text(int);
template std::string number_text(std::uint64_t);
template std::string number_text(float);
template std::string number_text(double);
template void check_number(std::string_view, int, const NumberRange&);
template void check_number(std::string_view, std::uint64_t, const NumberRange&);
template void check_number(std::string_view, float, const NumberRange&);
template void check_number(std::string_view, double, const NumberRange&);
template int parse_number(std::string_view, std::string_view, const NumberRange&);
template std::uint64_t parse_number(std::string_view, std::string_view, const NumberRange&);
template float parse_number(std::string_view, std::string_view, const NumberRange&);
template double parse_number(std::string_view, std::string_view, const NumberRange&);

}  // namespace rcs
