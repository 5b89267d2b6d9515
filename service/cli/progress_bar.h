#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include "rcs/log.h"

namespace rcs::service {

/// Shows on stderr what is being done: a bar where that is a terminal, elsewhere a plain line when a stage
/// that took over a second has ended, and every ten seconds within one.
class ProgressBar {
public:
    /// @param least  messages below this level are dropped   @param quiet  shows nothing but messages
    ProgressBar(LogLevel least, bool quiet);
    ~ProgressBar();
    ProgressBar(const ProgressBar&) = delete;
    ProgressBar& operator=(const ProgressBar&) = delete;

    /// @param detail  said behind the bar in place of the stage's time; "": that
    void show(std::string_view stage, float fraction, const std::string& detail = {});
    void finish();  ///< ends the running stage and takes the bar away

    /// For the library; both refer to this bar. Progress says stop once a signal came.
    ProgressFunction progress();
    LogFunction log();

private:
    using Clock = std::chrono::steady_clock;

    void begin(std::string_view stage);
    void end_stage();
    void draw_bar(float part, const std::string& detail);
    void clear_line();

    LogLevel least_;
    bool quiet_;
    bool terminal_;
    bool drawn_ = false;
    std::string stage_;
    Clock::time_point stage_begin_;
    Clock::time_point last_output_;
};

}  // namespace rcs::service
