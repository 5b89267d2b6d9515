#include "stability/measures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "util/color.h"

namespace rcs::stability {

double luminance_at(const Image& image, std::size_t pixel)
{
    const float* p = image.pixels.data() + pixel * static_cast<std::size_t>(image.channels);
    return static_cast<double>(image.channels >= 3 ? luminance({p[0], p[1], p[2]}) : p[0]);
}

namespace {

std::size_t pixels_of(const Image& image)
{
    return static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
}

}  // namespace

Spread spread_of(const LayeredImage& image, const std::string& layer, int channel)
{
    const Image& values = image.layers.at(layer);
    const Image& beauty = image.layers.at("beauty");
    Spread s;
    s.low = std::numeric_limits<double>::infinity();
    s.high = -s.low;
    for (int y = 0; y < values.height; ++y) {
        for (int x = 0; x < values.width; ++x) {
            if (beauty.at(x, y)[3] < 1.0f) continue;
            const double value = static_cast<double>(values.at(x, y)[channel]);
            s.low = std::min(s.low, value);
            s.high = std::max(s.high, value);
            s.mean += value;
            ++s.pixels;
        }
    }
    s.mean /= s.pixels > 0 ? s.pixels : 1;
    return s;
}

double worst_deviation(const LayeredImage& image, const std::string& layer, double expected)
{
    const Spread s = spread_of(image, layer);
    return s.pixels > 0 ? std::max(std::abs(s.low - expected), std::abs(s.high - expected)) / expected
                        : std::numeric_limits<double>::quiet_NaN();
}

double difference_of_means(const LayeredImage& a, const LayeredImage& b, const std::string& layer)
{
    double sum_a = 0.0, sum_b = 0.0;
    for (std::size_t i = 0; i < pixels_of(a.layers.at(layer)); ++i) {
        sum_a += luminance_at(a.layers.at(layer), i);
        sum_b += luminance_at(b.layers.at(layer), i);
    }
    return sum_a == sum_b ? 0.0 : std::abs(sum_a / sum_b - 1.0);
}

double mean_difference(const LayeredImage& a, const LayeredImage& b, const std::string& layer)
{
    double sum = 0.0, sum_b = 0.0;
    for (std::size_t i = 0; i < pixels_of(a.layers.at(layer)); ++i) {
        const double value = luminance_at(b.layers.at(layer), i);
        sum += std::abs(luminance_at(a.layers.at(layer), i) - value);
        sum_b += value;
    }
    return sum == 0.0 ? 0.0 : sum / sum_b;
}

double worst_difference(const LayeredImage& a, const LayeredImage& b, const std::string& layer)
{
    const std::vector<float>& x = a.layers.at(layer).pixels;
    const std::vector<float>& y = b.layers.at(layer).pixels;
    double worst = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const double difference = std::abs(static_cast<double>(x[i]) - static_cast<double>(y[i]));
        if (difference != 0.0)
            worst = std::max(worst, difference / static_cast<double>(std::max(std::abs(x[i]), std::abs(y[i]))));
    }
    return worst;
}

bool same_bits(const LayeredImage& a, const LayeredImage& b, std::string& which)
{
    for (const auto& [name, layer] : a.layers) {
        const auto other = b.layers.find(name);
        if (other == b.layers.end() || other->second.pixels != layer.pixels) {
            which = name;
            return false;
        }
    }
    return a.layers.size() == b.layers.size();
}

double polygon_irradiance(const std::vector<glm::dvec3>& corners, glm::dvec3 point, glm::dvec3 normal)
{
    double sum = 0.0;
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const glm::dvec3 a = glm::normalize(corners[i] - point);
        const glm::dvec3 b = glm::normalize(corners[(i + 1) % corners.size()] - point);
        const glm::dvec3 across = glm::cross(a, b);
        const double sine = glm::length(across);
        if (sine > 0.0) sum += std::atan2(sine, glm::dot(a, b)) * glm::dot(across / sine, normal);
    }
    return 0.5 * std::abs(sum);
}

SeedMeans mean_over_seeds(const std::vector<LayeredImage>& renders)
{
    const double n = static_cast<double>(renders.size());
    SeedMeans result;
    for (std::size_t i = 0; i < pixels_of(renders.at(0).layers.at("indirect")); ++i) {
        double sum = 0.0, squares = 0.0;
        for (const LayeredImage& render : renders) {
            const double value = luminance_at(render.layers.at("indirect"), i);
            sum += value;
            squares += value * value;
        }
        const double mean = sum / n;
        result.mean.push_back(mean);
        result.error.push_back(std::sqrt(std::max(0.0, squares / n - mean * mean) / (n - 1.0)));
    }
    return result;
}

double worst_block(const SeedMeans& got, const LayeredImage& reference, int side)
{
    const Image& truth = reference.layers.at("indirect");
    const Image& truth_error = reference.layers.at("indirect_standard_error");
    // The mean absolute value of a normal variable, over its standard deviation.
    const double mean_absolute = std::sqrt(2.0 / std::numbers::pi);
    double worst = 0.0;
    for (int top = 0; top < truth.height; top += side) {
        for (int left = 0; left < truth.width; left += side) {
            double light = 0.0, difference = 0.0, noise = 0.0;
            for (int y = top; y < std::min(top + side, truth.height); ++y) {
                for (int x = left; x < std::min(left + side, truth.width); ++x) {
                    const std::size_t i = static_cast<std::size_t>(y * truth.width + x);
                    light += luminance_at(truth, i);
                    difference += std::abs(got.mean[i] - luminance_at(truth, i));
                    noise += mean_absolute * std::hypot(got.error[i], luminance_at(truth_error, i));
                }
            }
            worst = std::max(worst, (difference - noise) / light);
        }
    }
    return worst;
}

}  // namespace rcs::stability
