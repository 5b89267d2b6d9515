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

double area_of(std::span<const RecordShare> shares)
{
    double area = 0.0;
    for (const RecordShare& s : shares) area += static_cast<double>(s.count * s.area);
    return area;
}

/// Below this level no share gets rays, above it all have as many as they may.
constexpr double kLeastLevel = 1e-3, kMostLevel = 1e12;

}  // namespace

float spread_at(const RecordShare& s, float density)
{
    return s.spread * std::pow(density, static_cast<float>(-kSpreadFall));
}

float rays_at(const RecordShare& s, double level, float most)
{
    const double wanted = level * std::pow(static_cast<double>(s.area * s.single), kPowerOfRays);
    return std::max(s.rays, std::min(most, static_cast<float>(wanted)));
}

Allotment allot(std::span<const RecordShare> shares, double level, float most)
{
    Allotment result{level, 0.0, 0.0};
    const double area = area_of(shares);
    if (!(area > 0.0)) return result;
    for (const RecordShare& s : shares) {
        const float rays = rays_at(s, level, most);
        const float noise = noise_with(s, rays);
        result.error += kMeanAbsolute * static_cast<double>(s.count * s.area * std::hypot(noise, s.spread)) / area;
        result.rays += static_cast<double>(s.count * (rays - s.rays));
    }
    return result;
}

Allotment allot_for_error(std::span<const RecordShare> shares, double error, float most)
{
    // What no rays reach is not tried for at any price.
    const double reachable = std::max(error, kNearFloor * allot(shares, kMostLevel, most).error);
    return allot(
        shares,
        least(kLeastLevel, kMostLevel, [&](double level) { return allot(shares, level, most).error <= reachable; }),
        most);
}

Allotment allot_for_rays(std::span<const RecordShare> shares, double rays, float most)
{
    return allot(shares,
                 least(kLeastLevel, kMostLevel, [&](double level) { return allot(shares, level, most).rays >= rays; }),
                 most);
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
