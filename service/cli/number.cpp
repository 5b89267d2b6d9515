#include "cli/number.h"

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <type_traits>

namespace rcs::service {
namespace {

std::string number_text(double value)
{
    char text[32];
    std::snprintf(text, sizeof text, "%.12g", value);
    return text;
}

std::string range_text(Range range)
{
    return (range.open ? "(" : "[") + number_text(range.least) + ", " + number_text(range.most) + "]";
}

}  // namespace

bool take_number(const char*& cursor, double& value)
{
    char* end = nullptr;
    value = std::strtod(cursor, &end);
    if (end == cursor || !std::isfinite(value)) {
        return false;
    }
    cursor = end;
    return true;
}

template <typename Number>
CLI::Option* add_number(CLI::App& app, const std::string& name, Number& value, Range range, const std::string& help)
{
    CLI::Option* option = app.add_option(name, value, help + ", in " + range_text(range));
    const auto in_range = [range](const std::string& text) {
        const char* cursor = text.c_str();
        double number = 0.0;
        if (take_number(cursor, number) && *cursor == '\0' && number <= range.most &&
            (range.open ? number > range.least : number >= range.least) &&
            (!std::is_integral_v<Number> || number == std::floor(number))) {
            return std::string();
        }
        return text + (std::is_integral_v<Number> ? " is no whole number in " : " is no number in ") +
               range_text(range);
    };
    return option->check(in_range, "")->type_name("N")->capture_default_str();
}

template CLI::Option* add_number(CLI::App&, const std::string&, int&, Range, const std::string&);
template CLI::Option* add_number(CLI::App&, const std::string&, float&, Range, const std::string&);
template CLI::Option* add_number(CLI::App&, const std::string&, double&, Range, const std::string&);
template CLI::Option* add_number(CLI::App&, const std::string&, std::uint64_t&, Range, const std::string&);

}  // namespace rcs::service
