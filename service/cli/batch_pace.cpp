#include "cli/batch_pace.h"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "process/clock.h"
#include "report/encoding.h"

namespace rcs::service {

namespace {

constexpr double kLate = 0.05;  ///< of the time there was: less is in time

}  // namespace

double BatchPace::left() const { return 1e-3 * static_cast<double>(*arguments_.deadline_ms - steady_ms()); }

void BatchPace::begin(std::set<int> waiting)
{
    if (!arguments_.deadline_ms || waiting.empty()) return;
    waiting_ = std::move(waiting);
    asked_ = left();
    pace_.learn(maker_.forecast(*waiting_.begin()));
    const double each = left() / static_cast<double>(waiting_.size());
    const std::string frames = std::to_string(waiting_.size()) + (waiting_.size() == 1 ? " frame" : " frames");
    std::string words = frames + " in " + duration_text(asked_) + ": " + duration_text(each) + " each";
    if (pace_.knows()) {
        const double error = pace_.error_in(each);
        words += error < Pace::kMostError ? ", which makes an error of about " + percent_text(error)
                                          : ", which is little: each gets its time, whatever the error";
    }
    if (!arguments_.render.report.quiet) {
        std::printf("%s\n", words.c_str());
        std::fflush(stdout);
    }
}

void BatchPace::aim(int number)
{
    if (!waiting_.contains(number)) return;
    const double each = left() / static_cast<double>(waiting_.size());
    const double error = pace_.error_in(each);
    // The last frame ends in time, and is about as good as the one before.
    error_ = waiting_.size() > 1 && error < Pace::kMostError ? error : 0.0;
    if (error_ > 0.0)
        maker_.aim(TargetError{error_});
    else
        maker_.aim(Budget{std::max(1e-3, each - maker_.seconds_around())});
}

void BatchPace::learn(const FrameResult& result)
{
    if (waiting_.erase(result.number) == 0 || result.end != FrameEnd::rendered) return;
    pace_.learn(maker_.last_forecast());
    if (error_ > 0.0 && pace_.knows()) pace_.learn(error_, result.figures.seconds);
    if (waiting_.empty() && -left() > kLate * asked_)
        maker_.warn("the frames were done " + duration_text(-left()) + " after the deadline");
}

}  // namespace rcs::service
