#include "rcs/sweep.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <string>

#include "rcs/error.h"

namespace rcs {
namespace {

struct Settings {
    float accuracy;
    int rays;
    float noise;
};

// Coarse to fine, each about twice the time of the one before.
constexpr Settings kSettings[kMostSweepPoints] = {
    {0.5f, 16, 0.3f},    {0.4f, 32, 0.15f},    {0.3f, 64, 0.08f},   {0.25f, 64, 0.04f},   {0.2f, 128, 0.02f},
    {0.2f, 256, 0.015f}, {0.15f, 512, 0.012f}, {0.12f, 768, 0.01f}, {0.1f, 1024, 0.008f}, {0.07f, 2048, 0.006f}};

}  // namespace

SweepPoint settings_point(const RenderOptions& base, float accuracy, int rays, float noise)
{
    SweepPoint point{{}, base};
    settings_of(point.options).error_tolerance = accuracy;
    settings_of(point.options).rays = rays;
    settings_of(point.options).noise_target = noise;
    char label[96];
    std::snprintf(label, sizeof label, "--accuracy %g --rays %d --noise %g", static_cast<double>(accuracy), rays,
                  static_cast<double>(noise));
    point.label = label;
    return point;
}

std::vector<SweepPoint> settings_sweep(const RenderOptions& base, int count)
{
    if (count < 2 || count > kMostSweepPoints) {
        throw Error(ErrorCode::bad_argument, "points is " + std::to_string(count) + ", expected a value in [2, " +
                                                 std::to_string(kMostSweepPoints) + "]");
    }
    std::vector<SweepPoint> points;
    for (int i = 0; i < count; ++i) {
        const Settings& s = kSettings[(i * (kMostSweepPoints - 1) + (count - 1) / 2) / (count - 1)];
        points.push_back(settings_point(base, s.accuracy, s.rays, s.noise));
    }
    return points;
}

std::vector<std::size_t> pareto_front(const std::vector<CostPoint>& points)
{
    std::vector<std::size_t> order(points.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        const CostPoint &p = points[a], &q = points[b];
        return p.seconds != q.seconds ? p.seconds < q.seconds : p.error < q.error;
    });
    std::vector<std::size_t> front;
    for (const std::size_t i : order) {
        if (front.empty() || points[i].error < points[front.back()].error) front.push_back(i);
    }
    return front;
}

std::optional<double> seconds_for_error(const std::vector<CostPoint>& points, double error)
{
    const std::vector<std::size_t> front = pareto_front(points);
    for (std::size_t k = 0; k < front.size(); ++k) {
        const CostPoint& fine = points[front[k]];
        if (fine.error > error) continue;
        if (k == 0 || fine.error <= 0.0) return fine.seconds;
        const CostPoint& coarse = points[front[k - 1]];
        const double t = std::log(coarse.error / error) / std::log(coarse.error / fine.error);
        return coarse.seconds * std::pow(fine.seconds / coarse.seconds, t);
    }
    return std::nullopt;
}

}  // namespace rcs
