#include "accuracy/error_scale.h"

#include <algorithm>
#include <cmath>

namespace rcs {
namespace {

float log_of(double value) { return std::log(static_cast<float>(value)); }

/// Where an error lies between two points of a curve.
template <typename Points>
struct Place {
    typename Points::const_iterator below, above;  // the same one beyond the ends
    float part = 0.0f;

    template <typename Member>
    double read(Member log_factor) const
    {
        return static_cast<double>(std::exp(std::lerp((*below).*log_factor, (*above).*log_factor, part)));
    }
};

template <typename Points, typename Error, typename Log>
Place<Points> place_in(const Points& points, double error, Error at, Log log_at)
{
    const auto above = std::find_if(points.begin(), points.end(), [&](const auto& p) { return p.*at > error; });
    if (above == points.begin()) return {above, above};
    if (above == points.end()) return {above - 1, above - 1};
    const auto below = above - 1;
    const float from = (*below).*log_at, to = (*above).*log_at;
    return {below, above, (log_of(error) - from) / (to - from)};
}

}  // namespace

ErrorScale::ErrorScale(const std::vector<Part>& parts)
{
    for (const Part& p : parts)
        points_.push_back({p.told, p.found, log_of(p.told), log_of(p.found), log_of(p.found / p.told),
                           log_of(p.judged / p.found), log_of(p.typical / p.found)});
}

double ErrorScale::of_map(double told) const
{
    if (points_.empty()) return 1.0;
    return place_in(points_, told, &Point::told, &Point::log_told).read(&Point::log_of_map);
}

ErrorScale::Judged ErrorScale::judged(double found) const
{
    if (points_.empty()) return {found, found};
    const auto place = place_in(points_, found, &Point::found, &Point::log_found);
    return {found * place.read(&Point::log_judged), found * place.read(&Point::log_typical)};
}

}  // namespace rcs
