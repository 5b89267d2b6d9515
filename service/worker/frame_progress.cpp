#include "worker/frame_progress.h"

#include <algorithm>
#include <iterator>

namespace rcs::service {
namespace {

struct Share {
    std::string_view stage;
    double begin, end;  ///< of a pass; stages before and after rendering: of the frame
};
// From renders of Sponza and the built-in scenes; only the bar depends on them.
constexpr Share kShares[] = {{"gbuffer", 0.0, 0.05}, {"bounces", 0.05, 0.15},  {"lamps", 0.15, 0.17},
                             {"direct", 0.17, 0.3},  {"glossy", 0.3, 0.4},     {"records", 0.4, 0.85},
                             {"splat", 0.85, 0.95},  {"estimate", 0.95, 0.97}, {"compose", 0.97, 1.0}};
constexpr double kLoaded = 0.1, kRendered = 0.97;  // of the frame
constexpr double kFirstPass = 0.6;                 // of rendering, if there are more: it places the records
constexpr double kKnown = 0.15;                    // below, what is left is anybody's guess
constexpr auto kBetween = std::chrono::milliseconds(100);

double seconds(std::chrono::steady_clock::duration d) { return std::chrono::duration<double>(d).count(); }

}  // namespace

FrameProgress::FrameProgress(int frame, int passes)
    : begin_(Clock::now()), told_(begin_ - kBetween), render_begin_(begin_)
{
    message_.set_frame(frame);
    message_.set_passes(passes);
}

void FrameProgress::show(std::string_view stage, float fraction)
{
    message_.set_stage(std::string(stage));
    message_.set_stage_fraction(std::clamp(fraction, 0.0f, 1.0f));
    const Share* const share =
        std::find_if(std::begin(kShares), std::end(kShares), [&](const Share& s) { return s.stage == stage; });
    double part = 0.0;
    if (share != std::end(kShares)) {
        const int passes = std::max(1, message_.passes()), done = message_.passes_done();
        const double first = passes > 1 ? kFirstPass : 1.0, other = passes > 1 ? (1.0 - first) / (passes - 1) : 0.0;
        const double within = share->begin + (share->end - share->begin) * message_.stage_fraction();
        part = kLoaded + (kRendered - kLoaded) * (done == 0 ? first * within : first + other * (done - 1 + within));
    } else if (stage == "tone map" || stage == "write") {
        part = kRendered;
    } else if (stage == "bvh") {
        part = 0.5 * kLoaded;
    } else if (stage == "plan") {
        part = kLoaded;
        render_begin_ = Clock::now();
    }
    message_.set_fraction(
        std::max(message_.fraction(), static_cast<float>(std::min(part, kRendered))));  // a bar never goes back
}

void FrameProgress::after_pass(int done, int passes, double error_estimate)
{
    message_.set_passes_done(done);
    message_.set_passes(passes);
    message_.set_error_estimate(error_estimate);
}

void FrameProgress::forecast(double render_seconds, int passes)
{
    forecast_seconds_ = render_seconds;
    message_.set_forecast_seconds(render_seconds);
    message_.set_passes(passes);
}

const v1::Progress& FrameProgress::message()
{
    const Clock::time_point now = Clock::now();
    const double elapsed = seconds(now - begin_);
    message_.set_elapsed_seconds(elapsed);
    if (forecast_seconds_ > 0.0) {
        message_.set_eta_seconds(std::max(0.0, forecast_seconds_ - seconds(now - render_begin_)));
    } else if (message_.fraction() > kKnown) {
        message_.set_eta_seconds(elapsed * (1.0 / message_.fraction() - 1.0));
    }
    return message_;
}

bool FrameProgress::due()
{
    const Clock::time_point now = Clock::now();
    if (now - told_ < kBetween && message_.stage() == told_stage_) return false;
    told_ = now;
    told_stage_ = message_.stage();
    return true;
}

}  // namespace rcs::service
