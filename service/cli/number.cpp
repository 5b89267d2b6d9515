#include "cli/number.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <type_traits>

#include "cli/parse.h"

namespace rcs::service {
namespace {

/// "--min-free" as a refusal names it: "min_free". A positional "priority" stays what it is.
std::string field_of(const std::string& name)
{
    std::string field = name.substr(std::min(name.find_first_not_of('-'), name.size()));
    std::replace(field.begin(), field.end(), '-', '_');
    return field;
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
CLI::Option* add_number(CLI::App& app, const std::string& name, Number& value, const NumberRange& range,
                        const std::string& help)
{
    const auto parse = [field = field_of(name), range](const std::string& text) {
        return parse_number<Number>(field, text, range);
    };
    return app
        .add_option_function<std::string>(
            name, [&value, parse](const std::string& text) { value = parse(text); },
            help + ", in " + interval_text(range, std::is_integral_v<Number>))
        ->check(checked_by(parse), "")
        ->type_name("N")
        ->default_str(number_text(value));
}

template CLI::Option* add_number(CLI::App&, const std::string&, int&, const NumberRange&, const std::string&);
template CLI::Option* add_number(CLI::App&, const std::string&, float&, const NumberRange&, const std::string&);
template CLI::Option* add_number(CLI::App&, const std::string&, double&, const NumberRange&, const std::string&);
template CLI::Option* add_number(CLI::App&, const std::string&, std::uint64_t&, const NumberRange&, const std::string&);

}  // namespace rcs::service
