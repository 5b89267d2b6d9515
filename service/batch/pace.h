#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>

#include "rcs/render.h"

namespace rcs::service {

/// How long it is until a time that somebody named: "06:00", the next one where we are, "2026-11-24T06:00" likewise,
/// with "Z" or "+01:00" after it elsewhere, "+1h30m" from now. @param now_ms  Unix time [ms] @return [s], above 0
/// @throws rcs::Error bad_argument: no time, or one that has passed
double seconds_until(const std::string& text, std::int64_t now_ms);

/// Chooses the error of frames so that all are done in the time there is: each forecast says what errors cost, each
/// frame by how much that is off.
class Pace {
public:
    void learn(const Forecast& forecast);
    /// @param error, seconds  what a frame that is done was aimed at, and took; after its forecast
    void learn(double error, double seconds);

    bool knows() const { return !forecast_.points.empty(); }
    double seconds_to(double error) const;
    /// The least error that a frame reaches in this time; at most kMostError.
    double error_in(double seconds) const;
    /// What records that are there already come to, and at the most kMostError.
    double settled_error() const { return std::min(kMostError, forecast_.settled_error); }
    /// The same of frames that share their records, by a forecast of one of them that has none yet: a guess, as nobody
    /// knows how much they have in common.
    double error_of_shot(double seconds, std::size_t frames) const;

    /// Beyond, a frame is no cheaper for it: one can give it a time alone.
    static constexpr double kMostError = 0.2;
    static constexpr double kLeastError = 1e-3;

private:
    double forecast_seconds(double error) const;
    template <typename SecondsTo>
    static double least_error(double seconds, const SecondsTo& seconds_to);

    Forecast forecast_;
    double factor_ = 1.0;  ///< on the forecast
    bool learned_ = false;
};

}  // namespace rcs::service
