#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "rcs/image.h"

namespace rcs::stability {

// Measures. All take one channel, and pixels that the first image's beauty covers wholly.

double luminance_at(const Image& image, std::size_t pixel);

/// Mean, least and most.
struct Spread {
    double mean = 0.0, low = 0.0, high = 0.0;
    int pixels = 0;
};
Spread spread_of(const LayeredImage& image, const std::string& layer, int channel = 0);
/// Largest relative distance of any pixel from `expected`.
double worst_deviation(const LayeredImage& image, const std::string& layer, double expected);
/// |mean(a) / mean(b) - 1| over all pixels, on luminance; 0 where both are black.
double difference_of_means(const LayeredImage& a, const LayeredImage& b, const std::string& layer);
/// mean |a - b| / mean(b) over all pixels, on luminance; 0 where both are black.
double mean_difference(const LayeredImage& a, const LayeredImage& b, const std::string& layer);
/// Largest |a - b| / max(a, b), over channels and pixels.
double worst_difference(const LayeredImage& a, const LayeredImage& b, const std::string& layer);
/// Whether every layer has the same bits; the first that has not is named in `which`.
bool same_bits(const LayeredImage& a, const LayeredImage& b, std::string& which);

/// Irradiance from a polygon of radiance 1 whose corners all lie above the point's horizon: Lambert's formula, in
/// double precision, written for this suite alone. The sign of the winding does not count.
double polygon_irradiance(const std::vector<glm::dvec3>& corners, glm::dvec3 point, glm::dvec3 normal);

/// What pixels of indirect light hold on average over renders with other seeds.
struct SeedMeans {
    std::vector<double> mean, error;  ///< per pixel, on luminance; error: standard error of the mean
};
SeedMeans mean_over_seeds(const std::vector<LayeredImage>& renders);

/// The worst block of so many pixels a side: mean of the pixels' |difference| from a path traced reference over the
/// mean of the reference there, less what the noise of both makes it on average.
double worst_block(const SeedMeans& got, const LayeredImage& reference, int side);

}  // namespace rcs::stability
