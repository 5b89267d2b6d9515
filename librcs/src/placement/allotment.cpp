#include "placement/allotment.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "accuracy/error_estimate.h"

namespace rcs {
namespace {

constexpr int kBisections = 40;
constexpr double kPowerOfRays = 0.7;
constexpr double kNearFloor = 1.05;  // what spread alone leaves: nearer it, rays do little

/// The least value in [low, high] for which `enough` holds, which does for all greater ones; `high` if for none.
template <typename Enough>
double least(double low, double high, const Enough& enough)
{
    for (int step = 0; step < kBisections; ++step) {
        const double middle = std::sqrt(low * high);
        (enough(middle) ? high : low) = middle;
    }
    return high;
}

float rays_for(const RecordShare& s, double wanted, float most)
{
    return std::max(s.rays, std::min(most, static_cast<float>(wanted)));
}

double power_of(const RecordShare& s) { return std::pow(static_cast<double>(s.area * s.single), kPowerOfRays); }

/// Shares, and what of them is the same at any level.
class Levels {
public:
    Levels(std::span<const RecordShare> shares, float most) : shares_(shares), most_(most)
    {
        same_.reserve(shares.size());
        for (const RecordShare& s : shares) {
            area_ += static_cast<double>(s.count * s.area);
            same_.push_back({power_of(s), std::hypot(noise_of(s), s.spread)});
        }
    }
    Allotment at(double level) const
    {
        Allotment result{level, 0.0, 0.0};
        if (!(area_ > 0.0)) return result;
        for (std::size_t k = 0; k < shares_.size(); ++k) {
            const RecordShare& s = shares_[k];
            const float rays = rays_for(s, level * same_[k].power, most_);
            const float error = rays == s.rays ? same_[k].error : std::hypot(noise_with(s, rays), s.spread);
            result.error += kMeanAbsolute * static_cast<double>(s.count * s.area * error) / area_;
            result.rays += static_cast<double>(s.count * (rays - s.rays));
        }
        return result;
    }

private:
    struct Same {
        double power;  // that a level is a factor of
        float error;   // with no more rays
    };
    std::span<const RecordShare> shares_;
    float most_;
    double area_ = 0.0;
    std::vector<Same> same_;
};

/// Below this level no share gets rays, above it all have as many as they may.
constexpr double kLeastLevel = 1e-3, kMostLevel = 1e12;

}  // namespace

float spread_at(const RecordShare& s, float density)
{
    return s.spread * std::pow(density, static_cast<float>(-kSpreadFall));
}

float rays_at(const RecordShare& s, double level, float most) { return rays_for(s, level * power_of(s), most); }

Allotment allot(std::span<const RecordShare> shares, double level, float most)
{
    return Levels(shares, most).at(level);
}

Allotment allot_for_error(std::span<const RecordShare> shares, double error, float most)
{
    const Levels levels(shares, most);
    // What no rays reach is not tried for at any price.
    const double reachable = std::max(error, kNearFloor * levels.at(kMostLevel).error);
    return levels.at(least(kLeastLevel, kMostLevel, [&](double level) { return levels.at(level).error <= reachable; }));
}

Allotment allot_for_rays(std::span<const RecordShare> shares, double rays, float most)
{
    const Levels levels(shares, most);
    return levels.at(least(kLeastLevel, kMostLevel, [&](double level) { return levels.at(level).rays >= rays; }));
}

std::vector<float> densities(std::span<const RecordShare> shares, double part, float most)
{
    // Of sum area * spread * density^-f, with so many records in all, the least.
    const auto density = [&](const RecordShare& s, double level) {
        const double wanted = level * std::pow(static_cast<double>(s.area * s.spread), 1.0 / (1.0 + kSpreadFall));
        return std::clamp(static_cast<float>(wanted), 1.0f, most);
    };
    double now = 0.0;
    for (const RecordShare& s : shares) now += static_cast<double>(s.count * s.area * s.spread);
    const double level = least(1e-6, 1e6, [&](double tried) {
        double then = 0.0;
        for (const RecordShare& s : shares)
            then += static_cast<double>(s.count * s.area * spread_at(s, density(s, tried)));
        return then <= part * now;
    });
    std::vector<float> result;
    result.reserve(shares.size());
    for (const RecordShare& s : shares) result.push_back(density(s, level));
    return result;
}

}  // namespace rcs
