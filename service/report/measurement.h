#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "rcs/metrics.h"
#include "rcs/sweep.h"

namespace rcs::service {

/// Pictures of one point, as JPEG files in memory.
struct PointPictures {
    std::string picture, indirect, difference;
    std::string records;  ///< empty for the path tracer, which has none
};

/// One way to make the image: what it cost and how wrong it is.
struct Measurement {
    std::string label;               ///< "--accuracy 0.2 --rays 128 --noise 0.02", "64 paths a pixel"
    int paths = 0;                   ///< paths a pixel; 0: a render
    double seconds = 0.0;            ///< of the image alone: without loading, acceleration structure and files
    double processor_seconds = 0.0;  ///< of all threads together
    double others = 0.0;             ///< what other processes took of the machine meanwhile, [0, 1]
    std::vector<std::pair<std::string, double>> stage_seconds;  ///< in order of execution; wall time
    std::uint64_t records = 0, rays = 0;                        ///< of a render
    std::optional<double> estimated_error;  ///< what the renderer said of its own relative error, if it did
    ErrorMetrics indirect, beauty;          ///< of these layers against the reference
    PointPictures pictures;

    bool is_render() const { return paths == 0; }
};

/// An error without the reference's own, which adds in squares. Never below a tenth of what was measured: there the
/// difference says nothing any more. @param noise  the reference's own error
double without_noise(double measured, double noise);

/// What the curve is drawn of: seconds, and mean relative error of the indirect light without the reference's own.
CostPoint cost_of(const Measurement& measurement, double noise);
/// Of the renders, or of the path tracer's points.
std::vector<CostPoint> costs_of(const std::vector<Measurement>& measurements, bool renders, double noise);

/// Everything but the pictures.
nlohmann::ordered_json to_json(const Measurement& measurement);

/// A point kept in a folder of its own; it counts as there only once it is complete.
/// @throws rcs::Error io
void save(const std::string& folder, const Measurement& measurement);
/// @return none if there is no complete point
std::optional<Measurement> load_measurement(const std::string& folder);

}  // namespace rcs::service
