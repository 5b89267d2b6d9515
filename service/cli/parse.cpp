#include "cli/parse.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <system_error>

#include "cli/number.h"
#include "rcs/camera.h"
#include "rcs/error.h"

namespace rcs::service {
namespace {

constexpr int kLargestSide = 16384;  // as RenderOptions::width

template <typename Value>
Value look_up(const std::map<std::string, Value>& choices, const std::string& text)
{
    const auto found = choices.find(text);
    if (found != choices.end()) {
        return found->second;
    }
    std::string names;
    for (const auto& [name, value] : choices) {
        names.append(names.empty() ? "" : ", ").append(name);
    }
    throw Error(ErrorCode::bad_argument, text + " is not one of " + names);
}

}  // namespace

Size parse_size(const std::string& text)
{
    const auto side = [](const std::string& digits) {
        // 5 digits hold the largest side; more could overflow
        const bool plain =
            !digits.empty() && digits.size() <= 5 && digits.find_first_not_of("0123456789") == digits.npos;
        return plain ? std::stoi(digits) : 0;
    };
    const std::size_t cross = std::min(text.find('x'), text.size());
    const Size size{side(text.substr(0, cross)), side(text.substr(std::min(cross + 1, text.size())))};
    if (size.width < 1 || size.width > kLargestSide || size.height < 1 || size.height > kLargestSide) {
        throw Error(ErrorCode::bad_argument,
                    text + " is no WIDTHxHEIGHT with each in [1, " + std::to_string(kLargestSide) + "]");
    }
    return size;
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

glm::dvec2 parse_lens_shift(const std::string& text)
{
    const char* cursor = text.c_str();
    glm::dvec2 shift(0.0);
    if (!take_number(cursor, shift.x) || *cursor++ != ',' || !take_number(cursor, shift.y) || *cursor != '\0' ||
        !(std::abs(shift.x) <= kMostLensShift && std::abs(shift.y) <= kMostLensShift)) {
        throw Error(ErrorCode::bad_argument,
                    text + " is not RIGHT,UP with two values in [-10, 10], in heights of the picture");
    }
    return shift;
}

double parse_error_target(const std::string& text)
{
    const char* cursor = text.c_str();
    double value = 0.0;
    const bool number = take_number(cursor, value);
    const bool percent = number && *cursor == '%';
    value *= percent ? 0.01 : 1.0;
    if (!number || cursor[percent ? 1 : 0] != '\0' || !(value > 0.0 && value <= 1.0)) {
        throw Error(ErrorCode::bad_argument, text + " is no relative error in (0, 1], such as 5% or 0.05");
    }
    return value;
}

double parse_budget(const std::string& text)
{
    const char* cursor = text.c_str();
    double value = 0.0;
    const bool number = take_number(cursor, value);
    const std::string unit = cursor;
    value *= unit == "m" ? 60.0 : 1.0;
    if (!number || !(unit.empty() || unit == "s" || unit == "m") || !(value > 0.0 && value <= 1e6)) {
        throw Error(ErrorCode::bad_argument, text + " is no time in (0, 1e6] seconds, such as 20s or 2m");
    }
    return value;
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
    std::error_code ignored;
    if (std::filesystem::is_regular_file(text, ignored)) {
        return {std::nullopt, text, 0.0};
    }
    throw Error(ErrorCode::bad_argument,
                text + " is neither scene nor none nor R,G,B with three values of at least 0 nor a file");
}

std::optional<float> parse_exposure(const std::string& text)
{
    if (text == "auto") {
        return std::nullopt;
    }
    const char* cursor = text.c_str();
    double value = 0.0;
    if (!take_number(cursor, value) || *cursor != '\0' || std::abs(value) > 64.0) {
        throw Error(ErrorCode::bad_argument, text + " is neither auto nor a value in [-64, 64]");
    }
    return static_cast<float>(value);
}

LogLevel parse_log_level(const std::string& text)
{
    return look_up<LogLevel>({{"debug", LogLevel::debug}, {"info", LogLevel::info}, {"warning", LogLevel::warning}},
                             text);
}

SplatMethod parse_splat_method(const std::string& text)
{
    return look_up<SplatMethod>(
        {{"auto", SplatMethod::automatic}, {"quads", SplatMethod::quads}, {"tiles", SplatMethod::tiles}}, text);
}

}  // namespace rcs::service
