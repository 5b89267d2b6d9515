#include "accuracy/error_scale.h"

#include <algorithm>
#include <cmath>

namespace rcs {
namespace {

/// Between parts by logarithms, beyond them as at the nearest.
template <typename Place, typename Value>
double read(const std::vector<ErrorScale::Part>& parts, double at, const Place& place, const Value& value)
{
    if (parts.empty()) return 1.0;
    const auto above = std::find_if(parts.begin(), parts.end(), [&](const auto& p) { return place(p) > at; });
    if (above == parts.begin()) return value(parts.front());
    if (above == parts.end()) return value(parts.back());
    const auto below = above - 1;
    const double part = std::log(at / place(*below)) / std::log(place(*above) / place(*below));
    return std::exp(std::lerp(std::log(value(*below)), std::log(value(*above)), part));
}

}  // namespace

double ErrorScale::of_map(double told) const
{
    return read(parts_, told, [](const Part& p) { return p.told; }, [](const Part& p) { return p.found / p.told; });
}

double ErrorScale::judged(double found) const
{
    return found *
           read(parts_, found, [](const Part& p) { return p.found; }, [](const Part& p) { return p.judged / p.found; });
}

double ErrorScale::typical(double found) const
{
    return found *
           read(
               parts_, found, [](const Part& p) { return p.found; }, [](const Part& p) { return p.typical / p.found; });
}

}  // namespace rcs
