#pragma once

#include <chrono>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "batch/flicker.h"
#include "batch/frame_record.h"
#include "batch/frames.h"
#include "cli/batch_ahead.h"
#include "cli/batch_records.h"
#include "cli/batch_run.h"
#include "cli/batch_scene.h"
#include "cli/progress_bar.h"
#include "output/output_files.h"
#include "process/interrupt.h"
#include "rcs/render.h"

namespace rcs::service {

/// Where a task says for others why a frame failed.
inline std::string failed_path(const std::string& path) { return path + ".failed"; }
/// Where a frame's small picture is made.
inline std::string thumbnail_path(const std::string& path) { return path + ".jpg"; }

/// Renders frame after frame in one session.
class FrameMaker {
public:
    /// Makes the folders of the outputs. @param on_request  called when SIGUSR1 came @throws rcs::Error
    FrameMaker(const BatchArguments& arguments, ProgressBar& bar, std::function<void()> on_request);

    const RenderOptions& options() const { return options_; }
    int threads() { return session_.pool().size(); }
    std::vector<std::string> paths_of(int number) const;
    /// What the record of a frame would say, but for scene and camera. @throws rcs::Error: its camera
    FrameRecord wanted(int number) const;
    /// @throws rcs::Error io, if the scene's files have changed
    void check_scene() const { scene_.check_unchanged(); }
    /// What was said since forget_log(), line by line: stages and messages, the last ones where there are many.
    std::string log_so_far() const;
    void forget_log() { said_.clear(), stage_.clear(); }
    /// Adds scene and camera, which have to be loaded for it. @throws rcs::Error
    void identify(FrameRecord& wanted);
    /// Removes what is known of it: that says nothing of the files that come now.
    void forget(const FrameRecord& frame) const;
    /// Writes the record of a frame whose files are there. @throws rcs::Error io
    void settle(FrameRecord& frame) const;
    /// Makes the frame and its record. @throws rcs::Error, after as many tries as the arguments say
    void render(FrameRecord& wanted);
    /// Whether the exposure of the next frame is to be that of all after it: one that followed each picture by itself
    /// would flicker.
    bool finds_exposure() const
    {
        return !arguments_.independent && arguments_.render.output.exposure == "auto" && !held_exposure_;
    }
    /// Takes it from a frame that is done.
    void hold_exposure(const FrameFigures& figures);
    /// What is held [EV]; none: each picture's own.
    std::optional<float> held_exposure() const { return held_exposure_; }
    /// Whether a frame by itself found what is held: shown with it, too, it is the same, whoever comes before it.
    bool shows_as_held(const FrameRecord& frame) const;
    /// Takes it from the one of all frames that another task has found it with.
    void take_exposure(const std::vector<int>& all);
    /// What which error costs in a frame. @throws rcs::Error
    Forecast forecast(int number);
    /// Of the last frame that was aimed at something.
    const Forecast& last_forecast() const { return forecast_; }
    /// What that took besides being rendered [s].
    double seconds_around() const { return seconds_around_; }
    /// In place of what the arguments say.
    void aim(Quality quality) { quality_ = quality; }
    /// The frames that share what is placed before this one is made, and are yet to; none: nothing is placed then.
    std::span<const int> places_for(int number) const
    {
        return ahead_.is_new(number) ? ahead_.part_of(number) : std::span<const int>();
    }
    /// Places it, or brings it further. @return what that came to; none: it took more than so many seconds, and was
    /// called off @throws rcs::Error
    std::optional<AheadStats> place_ahead(int number, const Quality& quality, double seconds);
    /// What that has taken so far, for all frames, called off or not [s].
    double ahead_seconds() const { return ahead_.seconds(); }
    /// Writes the report if SIGUSR1 has asked for it.
    void answer_request() const
    {
        if (take_report_request()) on_request_();
    }
    void warn(const std::string& line) { bar_.log()(LogLevel::warning, line); }
    /// For other tasks, if there is a file for it. @throws rcs::Error io
    void save_records() const { shared_records_.save(session_, options_); }

private:
    void say(std::string_view line);
    void try_frame(FrameRecord& wanted);
    void begin_records(int number);
    AheadStats look_ahead(int number, const Quality& quality);
    RenderResult render_picture(FrameRecord& wanted);
    void judge(const FrameRecord& wanted, const LayeredImage& image, FrameFigures& figures);
    double time_of(int number) const { return number / arguments_.shutter.fps; }
    LogFunction log();
    ProgressFunction progress();

    const BatchArguments& arguments_;
    ProgressBar& bar_;
    const std::function<void()> on_request_;
    std::vector<std::string> warnings_;  // of the frame in the making
    std::deque<std::string> said_;       // ... by all levels, and its stages
    std::string stage_;
    std::chrono::steady_clock::time_point frame_began_;
    double cpu_began_ = 0.0;  // of the frame [s]
    bool too_slow_ = false;
    std::optional<std::chrono::steady_clock::time_point> latest_;  // of what is placed ahead

    const RenderOptions options_;
    const std::vector<int> numbers_;  // of the whole batch
    const std::vector<OutputFile> files_;
    OutputFiles outputs_;
    BatchScene scene_;
    Session session_;
    const std::thread::id main_ = std::this_thread::get_id();
    std::optional<float> held_exposure_;
    std::optional<int> exposure_frame_;  // it was taken from
    SharedRecords shared_records_;
    const Dependencies settings_;  // what all frames depend on
    FramesAhead ahead_;
    Quality quality_;
    Forecast forecast_;
    double seconds_around_ = 0.0;
    struct Before {
        int number;
        std::string camera;
        FlickerFrame frame;
    };
    std::optional<Before> before_;  // the frame before, to see what flickers
};

}  // namespace rcs::service
