#pragma once

#include <string>

#include "rcs/camera.h"
#include "rcs/image.h"
#include "rcs/log.h"
#include "rcs/ray_scene.h"
#include "rcs/reference.h"
#include "rcs/thread_pool.h"

namespace rcs::service {

/// A path traced image that gets better round by round, kept in an EXR file after each, so that what was traced is
/// never lost. Rounds are the same however often the work was interrupted, and so is the image.
class GrowingPaths {
public:
    /// Takes up what the file holds, if it is there and belongs to `key`.
    /// @param options  samples and first_sample are set by the rounds
    GrowingPaths(std::string file, std::string key, const View& view, const ReferenceOptions& options);

    int samples() const { return samples_; }                         ///< paths a pixel so far
    double seconds() const { return seconds_; }                      ///< that tracing them took
    double processor_seconds() const { return processor_seconds_; }  ///< of all threads together
    const LayeredImage& image() const { return image_; }

    void clear();  ///< begins anew; the file stays until the next round

    /// Adds next_round() samples, then saves.
    void add_round(const RayScene& rays, ThreadPool& pool, const ProgressFunction& progress);

private:
    std::string file_, key_;
    View view_;
    ReferenceOptions options_;
    LayeredImage image_;
    int samples_ = 0;
    double seconds_ = 0.0, processor_seconds_ = 0.0;
};

// Rounds double the samples until they are of the largest size.
inline constexpr int kSmallestRound = 16;  ///< [paths a pixel]
inline constexpr int kLargestRound = 256;
/// How many samples the round after `samples` adds.
int next_round(int samples);
/// Whether some round ends at so many samples: 16, 32, 64, 128, 256, 512, 768 and so on.
bool is_round(int samples);

}  // namespace rcs::service
