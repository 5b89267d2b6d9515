#include "direct/direct_error.h"

#include <algorithm>
#include <cmath>

#include "gbuffer/checked_pixels.h"
#include "util/color.h"

namespace rcs {
namespace {

// Squares around a pixel's own that tell of its error.
constexpr int kBlockReach = 1;
// Two samples of one normal error differ by 2 / sqrt(pi) standard errors in the mean.
constexpr float kOfDifference = 0.886226925f;

/// Sums over a square of a picture, by whether its pixels see lamps in part.
struct SquareSums {
    float error = 0.0f, roots = 0.0f, light = 0.0f, count = 0.0f;

    void add(float first, float second)
    {
        error += kOfDifference * std::abs(first - second);
        roots += std::sqrt(0.5f * (first + second));
        light += 0.5f * (first + second);
        count += 1.0f;
    }
    void add(const SquareSums& other)
    {
        error += other.error, roots += other.roots, light += other.light, count += other.count;
    }
    /// Of a pixel that got so much. What is seen by chance varies by the root of what there is; where it is mostly
    /// noise, one pixel's light says little of that.
    float error_at(float own) const
    {
        if (!(error > 0.0f)) return 0.0f;
        const float noisy = std::min(1.0f, error * error / (light * light));
        return error / roots * std::sqrt(std::lerp(own, light / count, noisy));
    }
};

/// Sums over all squares, those around each, and over the whole picture.
class Squares {
public:
    Squares(int width, int height)
        : columns_(checked_squares(width)),
          rows_(checked_squares(height)),
          sums_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)),
          around_(sums_.size())
    {
    }
    void add(int x, int y, float first, float second)
    {
        sums_[index(x / kCheckedSide, y / kCheckedSide)].add(first, second);
        all_.add(first, second);
    }
    void sum_around()
    {
        for (int y = 0; y < rows_; ++y)
            for (int x = 0; x < columns_; ++x)
                for (int ny = std::max(0, y - kBlockReach); ny <= std::min(rows_ - 1, y + kBlockReach); ++ny)
                    for (int nx = std::max(0, x - kBlockReach); nx <= std::min(columns_ - 1, x + kBlockReach); ++nx)
                        around_[index(x, y)].add(sums_[index(nx, ny)]);
    }
    float error_at(int x, int y, float own) const
    {
        const SquareSums& near = around_[index(x / kCheckedSide, y / kCheckedSide)];
        return (near.count > 0.0f ? near : all_).error_at(own);
    }
    bool is_exact() const { return !(all_.error > 0.0f); }

private:
    std::size_t index(int x, int y) const
    {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(x);
    }
    int columns_, rows_;
    std::vector<SquareSums> sums_, around_;
    SquareSums all_;
};

}  // namespace

void spread_errors(const std::vector<CheckedPixel>& checked, const GBuffer& g, DirectLightResult& light)
{
    Squares irradiance(g.width, g.height), glossy(g.width, g.height);
    const auto in_part = [&](std::size_t i) { return !light.in_part.empty() && light.in_part[i] != 0; };
    for (const CheckedPixel& c : checked) {
        const int x = static_cast<int>(c.pixel) % g.width, y = static_cast<int>(c.pixel) / g.width;
        if (in_part(c.pixel)) irradiance.add(x, y, luminance(light.irradiance[c.pixel]), c.irradiance);
        if (!light.glossy.empty()) glossy.add(x, y, luminance(light.glossy[c.pixel]), c.glossy);
    }
    irradiance.sum_around();
    glossy.sum_around();
    if (!irradiance.is_exact()) light.irradiance_error.assign(g.size(), 0.0f);
    if (!glossy.is_exact()) light.glossy_error.assign(g.size(), 0.0f);
    for (std::size_t i = 0; i < g.size(); ++i) {
        if (!g.covered(i)) continue;
        const int x = static_cast<int>(i) % g.width, y = static_cast<int>(i) / g.width;
        if (!irradiance.is_exact() && in_part(i))
            light.irradiance_error[i] = irradiance.error_at(x, y, luminance(light.irradiance[i]));
        if (!glossy.is_exact()) light.glossy_error[i] = glossy.error_at(x, y, luminance(light.glossy[i]));
    }
}

}  // namespace rcs
