#include "batch/pace.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <iterator>
#include <optional>
#include <regex>

#include "rcs/error.h"

namespace rcs::service {
namespace {

// The records of a shot are those of so many views that have nothing in common: 2.4 in Sponza's walk.
constexpr double kViewsOfShot = 2.5;

/// "+1h30m" and the like [s].
std::optional<double> duration_of(const std::string& text)
{
    static const std::regex form(R"(^\+(?:(\d{1,4})d)?(?:(\d{1,5})h)?(?:(\d{1,6})m)?(?:(\d{1,8})s)?$)");
    std::smatch found;
    if (!std::regex_match(text, found, form)) return std::nullopt;
    constexpr double kUnits[] = {86400.0, 3600.0, 60.0, 1.0};
    double seconds = 0.0;
    for (std::size_t i = 0; i < 4; ++i)
        if (found[i + 1].matched) seconds += kUnits[i] * std::stod(found[i + 1]);
    return seconds;
}

int number_of(const std::ssub_match& part) { return part.matched ? std::stoi(part) : 0; }

bool is_clock_time(const std::tm& t) { return t.tm_hour < 24 && t.tm_min < 60 && t.tm_sec < 60; }

/// "06:00" as the next such time [Unix time, s].
std::optional<std::time_t> next_time(const std::string& text, std::time_t now)
{
    static const std::regex form(R"(^(\d{1,2}):(\d{2})(?::(\d{2}))?$)");
    std::smatch found;
    if (!std::regex_match(text, found, form)) return std::nullopt;
    std::tm time{};
    localtime_r(&now, &time);
    time.tm_hour = number_of(found[1]);
    time.tm_min = number_of(found[2]);
    time.tm_sec = number_of(found[3]);
    time.tm_isdst = -1;
    if (!is_clock_time(time)) return std::nullopt;
    std::tm tomorrow = time;
    ++tomorrow.tm_mday;
    const std::time_t today = std::mktime(&time);
    return today > now ? today : std::mktime(&tomorrow);
}

/// "2026-11-24T06:00:00+01:00" [Unix time, s].
std::optional<std::time_t> time_of_date(const std::string& text)
{
    static const std::regex form(
        R"(^(\d{4})-(\d{2})-(\d{2})[T ](\d{2}):(\d{2})(?::(\d{2}))?(Z|([+-])(\d{2}):?(\d{2}))?$)");
    std::smatch found;
    if (!std::regex_match(text, found, form)) return std::nullopt;
    std::tm time{};
    time.tm_year = number_of(found[1]) - 1900;
    time.tm_mon = number_of(found[2]) - 1;
    time.tm_mday = number_of(found[3]);
    time.tm_hour = number_of(found[4]);
    time.tm_min = number_of(found[5]);
    time.tm_sec = number_of(found[6]);
    time.tm_isdst = -1;
    std::tm normal = time;
    if (!is_clock_time(time) || timegm(&normal) < 0 || normal.tm_mon != time.tm_mon) return std::nullopt;
    if (!found[7].matched) return std::mktime(&time);
    const int offset = 60 * (60 * number_of(found[9]) + number_of(found[10]));
    return timegm(&time) - (found[8] == "-" ? -offset : offset);
}

}  // namespace

double seconds_until(const std::string& text, std::int64_t now_ms)
{
    const double now = 1e-3 * static_cast<double>(now_ms);
    const auto left = [&](const std::optional<std::time_t>& time) {
        return time ? std::optional(static_cast<double>(*time) - now) : std::nullopt;
    };
    auto seconds = duration_of(text);
    if (!seconds) seconds = left(next_time(text, static_cast<std::time_t>(now_ms / 1000)));
    if (!seconds) seconds = left(time_of_date(text));
    if (!seconds) throw Error(ErrorCode::bad_argument, text + " is no time such as 06:00, 2026-11-24T06:00 or +1h30m");
    if (*seconds <= 0.0) throw Error(ErrorCode::bad_argument, text + " has passed");
    return *seconds;
}

void Pace::learn(const Forecast& forecast)
{
    if (forecast.points.empty()) return;
    forecast_ = forecast;
    // From there on it takes more.
    auto& points = forecast_.points;
    const double settled = forecast.settled_error;
    const auto next = std::find_if(points.begin(), points.end(), [&](const auto& p) { return p.error < settled; });
    if (next != points.begin() && next != points.end() && std::prev(next)->error > settled)
        points.insert(next, {settled, std::prev(next)->seconds});
}

void Pace::learn(double error, double seconds)
{
    const double factor = seconds / forecast_seconds(error);
    factor_ = learned_ ? std::sqrt(factor_ * factor) : factor;  // a frame that is odd counts half
    learned_ = true;
}

double Pace::seconds_to(double error) const { return factor_ * forecast_seconds(error); }

/// Straight lines between the points, and beyond them, where both axes are logarithms.
double Pace::forecast_seconds(double error) const
{
    const auto& points = forecast_.points;
    if (points.empty()) return 1.0;
    if (points.size() == 1) return points[0].seconds;
    std::size_t i = 0;
    while (i + 2 < points.size() && points[i + 1].error > error) ++i;
    const auto &a = points[i], &b = points[i + 1];
    const double at = std::log(error / a.error) / std::log(b.error / a.error);
    return a.seconds * std::pow(b.seconds / a.seconds, at);
}

template <typename SecondsTo>
double Pace::least_error(double seconds, const SecondsTo& seconds_to)
{
    double low = kLeastError, high = kMostError;
    for (int step = 0; step < 40; ++step) {
        const double middle = std::sqrt(low * high);
        (seconds_to(middle) > seconds ? low : high) = middle;
    }
    return high;
}

double Pace::error_in(double seconds) const
{
    return least_error(seconds, [&](double error) { return seconds_to(error); });
}

double Pace::error_of_shot(double seconds, std::size_t frames) const
{
    const double each = seconds_to(kMostError);
    return least_error(seconds, [&](double error) {
        return kViewsOfShot * (seconds_to(error) - each) + static_cast<double>(frames) * each;
    });
}

}  // namespace rcs::service
