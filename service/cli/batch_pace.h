#pragma once

#include <deque>
#include <set>
#include <span>
#include <string>

#include "batch/pace.h"
#include "batch/report.h"
#include "cli/batch_frame.h"

namespace rcs::service {

/// Frames that are to be done by a deadline. Those that share records get these beforehand, as good as leaves time for
/// the frames themselves; then each is aimed at the error that leaves as much time to those after it.
class BatchPace {
public:
    BatchPace(const BatchArguments& arguments, FrameMaker& maker) : arguments_(arguments), maker_(maker) {}

    /// Says beforehand what error it is. @param waiting  numbers of frames that are to be rendered @throws rcs::Error
    void begin(std::set<int> waiting);
    /// Before a frame is made.
    void aim(int number);
    /// After it. The last one's result tells if it was too late.
    void learn(FrameResult& result);

private:
    void say(const std::string& words) const;
    double left() const;  ///< [s]
    double frames_of_part() const;
    double for_part() const;
    double usual_seconds() const;
    void share_records(int number);
    void begin_part(int number);
    void spend(int number);
    void look_ahead(int number, const Quality& quality, double seconds);

    const BatchArguments& arguments_;
    FrameMaker& maker_;
    Pace pace_;
    std::set<int> waiting_;
    double asked_ = 0.0;         ///< time there was when it began [s]
    std::span<const int> part_;  ///< frames that share records
    int looks_ = 0;              ///< at views of theirs, made last; 0: nothing is placed for them
    double shared_ = 0.0;        ///< error that those left, in the worst of the views
    std::deque<double> recent_;  ///< what frames of theirs have taken [s]
    bool is_first_ = true;       ///< no frame is made: that takes what is made once for all as well
    double aimed_at_ = 0.0;      ///< error that the frame in the making is aimed at; 0: at a time
};

}  // namespace rcs::service
