#include "cli/parse.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <map>
#include <string_view>
#include <system_error>

#include "cli/number.h"
#include "rcs/error.h"
#include "rcs/option_table.h"
#include "rcs/suggestion.h"
#include "wire/limits.h"

namespace rcs::service {

std::string listed(const std::vector<std::string>& names)
{
    std::string text;
    for (const std::string& name : names) text.append(text.empty() ? "" : ", ").append(name);
    return text;
}

std::string check_name(const std::string& kind, const std::string& name, const std::vector<std::string>& names)
{
    if (std::find(names.begin(), names.end(), name) != names.end()) return {};
    const std::string meant = did_you_mean(name, names);
    return "there is no " + kind + " '" + name + "'" + (meant.empty() ? "; there are " + listed(names) : meant);
}

namespace {

template <typename Value>
Value look_up(const std::map<std::string, Value>& choices, const std::string& text)
{
    const auto found = choices.find(text);
    if (found != choices.end()) {
        return found->second;
    }
    std::vector<std::string> names;
    for (const auto& [name, value] : choices) names.push_back(name);
    throw Error(ErrorCode::bad_argument, text + " is not one of " + listed(names) + did_you_mean(text, names));
}

/// The letter behind a place in a text, or 0.
int letter_after(const std::string& text, std::size_t at)
{
    return at < text.size() && at + 1 < text.size() ? static_cast<unsigned char>(text[at + 1]) : 0;
}

}  // namespace

Size parse_size(const std::string& text)
{
    const std::size_t cross = text.find('x');
    if (cross == text.npos) refuse_value("size", text, "WIDTHxHEIGHT, such as 640x360");
    RenderOptions options;
    set_from_text(find_option("width"), options, std::string_view(text).substr(0, cross));
    set_from_text(find_option("height"), options, std::string_view(text).substr(cross + 1));
    return {options.width, options.height};
}

double parse_time(const std::string& text)
{
    const char* cursor = text.c_str();
    double value = 0.0;
    if (!take_number(cursor, value) || *cursor != '\0') {
        throw Error(ErrorCode::bad_argument, text + " is no number of seconds");
    }
    return value;
}

MotionTime parse_motion_time(const std::string& text)
{
    return {parse_time(text), text.starts_with('+') || text.starts_with('-')};
}

double parse_fps(const std::string& text)
{
    constexpr NumberRange kRates{0, 1e6, true}, kParts{0, 1e9, true};
    const std::size_t slash = text.find('/');
    if (slash == text.npos) return parse_number<double>("fps", text, kRates);
    const double fps = parse_number<double>("fps", text.substr(0, slash), kParts) /
                       parse_number<double>("fps", text.substr(slash + 1), kParts);
    check_number("fps", fps, kRates);
    return fps;
}

glm::dvec3 parse_place(const std::string& text)
{
    const char* cursor = text.c_str();
    glm::dvec3 place(0.0);
    for (int i = 0; i < 3; ++i) {
        if ((i > 0 && *cursor++ != ',') || !take_number(cursor, place[i]))
            throw Error(ErrorCode::bad_argument, text + " is not X,Y,Z, three finite numbers");
    }
    if (*cursor != '\0') throw Error(ErrorCode::bad_argument, text + " is not X,Y,Z, three finite numbers");
    return place;
}

glm::dvec2 parse_lens_shift(const std::string& text)
{
    const char* cursor = text.c_str();
    glm::dvec2 shift(0.0);
    if (!take_number(cursor, shift.x) || *cursor++ != ',' || !take_number(cursor, shift.y) || *cursor != '\0')
        refuse_value("lens_shift", text, "RIGHT,UP, each " + words_of(kLensShifts, false));
    check_number("lens_shift", shift.x, kLensShifts);
    check_number("lens_shift", shift.y, kLensShifts);
    return shift;
}

EnvironmentChoice parse_environment(const std::string& text)
{
    if (text == "scene") {
        return {};
    }
    if (text == "none") {
        return {glm::vec3(0.0f), {}, 0.0};
    }
    glm::vec3 radiance(0.0f);
    const char* cursor = text.c_str();
    for (int c = 0; c < 3; ++c) {
        double value = 0.0;
        const bool separated = c == 0 || *cursor++ == ',';
        if (!separated || !take_number(cursor, value) || value < 0.0) {
            break;
        }
        radiance[c] = static_cast<float>(value);
        if (c == 2 && *cursor == '\0' && std::isfinite(radiance.x + radiance.y + radiance.z)) {
            return {radiance, {}, 0.0};
        }
    }
    const bool named_as_file = text.find('/') != text.npos || std::isalpha(letter_after(text, text.rfind('.'))) != 0;
    std::error_code ignored;
    if (named_as_file || std::filesystem::exists(text, ignored)) return {std::nullopt, text, 0.0};
    throw Error(ErrorCode::bad_argument,
                text + " is neither scene nor none nor R,G,B with three values of at least 0 nor a file");
}

std::optional<float> parse_exposure(const std::string& text)
{
    if (text == "auto") {
        return std::nullopt;
    }
    if (!read_number(text)) refuse_value("exposure", text, "auto or " + words_of(kExposures, false));
    return parse_number<float>("exposure", text, kExposures);
}

LogLevel parse_log_level(const std::string& text)
{
    return look_up<LogLevel>({{"debug", LogLevel::debug}, {"info", LogLevel::info}, {"warning", LogLevel::warning}},
                             text);
}

}  // namespace rcs::service
