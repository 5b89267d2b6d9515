#pragma once

#include <string>
#include <vector>

#include "rcs/error_estimate.h"

namespace rcs {

/// A kind of light that pixels sample by themselves, and what filtering it brought. Errors are root mean squares,
/// relative to the light, where it is noisy: as independent samples of some pixels tell.
struct DenoisedLight {
    std::string name;           ///< "direct", "highlights" or "reflections"
    bool is_exact = false;      ///< nothing was to be done: samples do not differ
    double filtered = 0.0;      ///< part of it that is filtered, where it is noisy; 0: that would not help
    double error_before = 0.0;  ///< of the light as it was sampled
    double error_after = 0.0;   ///< of what the picture shows
};

/// What took noise out of a picture, and what it did.
struct DenoiseStats {
    std::string library;                ///< "Open Image Denoise 2.3.0"; empty: nobody asked
    std::string device;                 ///< that it ran on: "CPU"
    std::vector<DenoisedLight> lights;  ///< those that there are
    ErrorEstimates before;              ///< of the picture, and of its indirect light, without the filter
};

}  // namespace rcs
