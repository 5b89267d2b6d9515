#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include "rcs/v1/job.pb.h"

namespace rcs::service {

/// How far a frame is, told from the stages that render() names: of the frame as a whole it is an estimate, from what
/// stages take in the mean.
class FrameProgress {
public:
    /// @param passes  samples a pixel, as asked for
    FrameProgress(int frame, int passes);

    void show(std::string_view stage, float fraction);
    void after_pass(int done, int passes, double error_estimate);
    void forecast(double seconds, int passes);  ///< of rendering, as the library says it

    const v1::Progress& message();  ///< as it is now
    /// Whether it is time to tell, which it is some ten times a second and when a stage begins.
    bool due();

private:
    using Clock = std::chrono::steady_clock;

    v1::Progress message_;
    Clock::time_point begin_, told_;
    std::string told_stage_;
    double forecast_seconds_ = 0.0;
    Clock::time_point render_begin_;
};

}  // namespace rcs::service
