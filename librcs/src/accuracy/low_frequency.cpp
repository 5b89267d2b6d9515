#include "accuracy/low_frequency.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace rcs {
namespace {

constexpr int kReach = static_cast<int>(3.0 * kCloudBlur);

/// Half of a symmetric kernel: its middle, then what lies 1, 2, ... pixels from it.
std::vector<double> half_kernel()
{
    std::vector<double> kernel(kReach + 1);
    for (int i = 0; i <= kReach; ++i)
        kernel[static_cast<std::size_t>(i)] = std::exp(-0.5 * i * i / (kCloudBlur * kCloudBlur));
    return kernel;
}

/// Numbers that lie `step` apart in memory.
struct Line {
    double* first;
    std::size_t step;
    int size;
    double& operator[](int i) const { return first[static_cast<std::size_t>(i) * step]; }
};

/// Sums of a line's numbers, weighted by the kernel; beyond the ends lies nothing.
void blur_line(const Line& line, const std::vector<double>& kernel, std::vector<double>& copy)
{
    copy.resize(static_cast<std::size_t>(line.size));
    for (int i = 0; i < line.size; ++i) copy[static_cast<std::size_t>(i)] = line[i];
    for (int i = 0; i < line.size; ++i) {
        double sum = 0.0;
        const int end = std::min(line.size - 1, i + kReach);
        for (int j = std::max(0, i - kReach); j <= end; ++j)
            sum += kernel[static_cast<std::size_t>(std::abs(i - j))] * copy[static_cast<std::size_t>(j)];
        line[i] = sum;
    }
}

void blur(std::vector<double>& values, int width, int height)
{
    const std::vector<double> kernel = half_kernel();
    const auto w = static_cast<std::size_t>(width);
    std::vector<double> copy;
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y)
        blur_line({values.data() + y * w, 1, width}, kernel, copy);
    for (std::size_t x = 0; x < w; ++x) blur_line({values.data() + x, w, height}, kernel, copy);
}

/// Deviation of the kernel's mean of independent numbers of deviation 1, meaned over the places of a line.
double white_noise_left(int size)
{
    const std::vector<double> kernel = half_kernel();
    double left = 0.0;
    for (int i = 0; i < size; ++i) {
        double sum = 0.0, squares = 0.0;
        for (int j = std::max(0, i - kReach); j <= std::min(size - 1, i + kReach); ++j) {
            const double k = kernel[static_cast<std::size_t>(std::abs(i - j))];
            sum += k;
            squares += k * k;
        }
        left += std::sqrt(squares) / sum;
    }
    return left / size;
}

}  // namespace

LowFrequency low_frequency(std::span<const double> error, int width, int height)
{
    std::vector<double> sums(error.begin(), error.end()), weights(error.size());
    double absolute = 0.0, count = 0.0;
    for (std::size_t i = 0; i < error.size(); ++i) {
        const bool is_known = !std::isnan(error[i]);
        weights[i] = is_known ? 1.0 : 0.0;
        if (!is_known) sums[i] = 0.0;
        absolute += std::abs(sums[i]);
        count += weights[i];
    }
    if (absolute == 0.0) return {};
    const std::vector<double> known = weights;
    blur(sums, width, height);
    blur(weights, width, height);
    double blurred = 0.0;
    for (std::size_t i = 0; i < error.size(); ++i)
        if (known[i] > 0.0) blurred += std::abs(sums[i]) / weights[i];
    // Both means are of absolute values, so that their quotient is that of the deviations.
    return {blurred / count, blurred / (absolute * white_noise_left(width) * white_noise_left(height))};
}

}  // namespace rcs
