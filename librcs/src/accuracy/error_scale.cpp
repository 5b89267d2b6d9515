#include "accuracy/error_scale.h"

#include <algorithm>
#include <cmath>

namespace rcs {

ErrorScale::ErrorScale(const std::vector<Part>& parts)
{
    for (const Part& p : parts) {
        of_map_.add(p.told, p.found / p.told);
        judged_.add(p.found, p.judged / p.found);
        typical_.add(p.found, p.typical / p.found);
    }
}

void ErrorScale::Curve::add(double at, double factor)
{
    points_.push_back({at, std::log(at), factor, std::log(factor)});
}

double ErrorScale::Curve::at(double error) const
{
    if (points_.empty()) return 1.0;
    const auto above = std::find_if(points_.begin(), points_.end(), [&](const Point& p) { return p.at > error; });
    if (above == points_.begin()) return points_.front().factor;
    if (above == points_.end()) return points_.back().factor;
    const Point& below = *(above - 1);
    const double part = (std::log(error) - below.log_at) / (above->log_at - below.log_at);
    return std::exp(std::lerp(below.log_factor, above->log_factor, part));
}

}  // namespace rcs
