#pragma once

#include <set>

#include "batch/pace.h"
#include "batch/report.h"
#include "cli/batch_frame.h"

namespace rcs::service {

/// Frames that are to be done by a deadline: aims each at the error that leaves as much time to those after it.
class BatchPace {
public:
    BatchPace(const BatchArguments& arguments, FrameMaker& maker) : arguments_(arguments), maker_(maker) {}

    /// Says beforehand what error it is. @param waiting  numbers of frames that are to be rendered @throws rcs::Error
    void begin(std::set<int> waiting);
    /// Before a frame is made.
    void aim(int number);
    /// After it.
    void learn(const FrameResult& result);

private:
    double left() const;  ///< [s]

    const BatchArguments& arguments_;
    FrameMaker& maker_;
    Pace pace_;
    std::set<int> waiting_;
    double asked_ = 0.0;  ///< time there was when it began [s]
    double error_ = 0.0;  ///< that the frame in the making is aimed at; 0: at a time
};

}  // namespace rcs::service
