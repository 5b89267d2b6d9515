#pragma once

#include <map>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "batch/frame_record.h"

/// What became of the frames of a batch, for the morning after.
namespace rcs::service {

/// A movie of the frames, beside the report.
inline constexpr const char* kMovieFile = "preview.mp4";

/// What a report consists of: names within its folder.
std::vector<std::string> report_files();
/// Where it is noted what these files are. @param folder  of the report
std::string report_record_path(const std::string& folder);

enum class FrameEnd { rendered, kept, failed, left };
std::string name_of(FrameEnd end);  ///< "rendered", "done before", "failed", "not reached"

struct FrameResult {
    int number = 0;
    FrameEnd end = FrameEnd::left;
    std::string why;    ///< it was rendered: what changed
    std::string error;  ///< why it failed
    std::string log;    ///< ... and what was said before, line by line
    std::vector<std::string> files;
    FrameFigures figures;
};

/// "frame 7: rendered in 1.2 s, error 3.1 %, ...". @param explain  also why it was, or was not
std::string line_of(const FrameResult& result, bool explain);

struct BatchReport {
    std::string scene, command;  ///< as it was called
    double fps = 24.0;
    int width = 0, height = 0;  ///< [px]
    int threads = 0;            ///< 0: of several machines
    std::string began, ended;   ///< local time
    double seconds = 0.0, cpu_seconds = 0.0;
    double ahead_seconds = 0.0;     ///< of these, for records that frames share, placed before them
    std::uint64_t peak_memory = 0;  ///< [bytes]; 0: not known
    bool independent = false;
    bool has_movie = false;            ///< kMovieFile lies beside it
    std::vector<std::string> removed;  ///< of earlier nights, a line for each
    std::string server;                ///< address of the render server that made them; empty: none
    std::vector<FrameResult> frames;

    std::size_t count(FrameEnd end) const;
};

/// Takes what the whole cost from its frames, which several machines have made.
void add_up(BatchReport& report);

/// What all frames would take anew, with what they share [s].
double forecast_seconds(const BatchReport& report);

/// What frames of this run have taken, wherever they were made [s].
double cpu_of_rendered(const BatchReport& report);

/// Of so many frames every how many-th shows its picture in the page.
std::size_t picture_step(std::size_t frames);

/// "3 of 48 frames failed, 40 rendered, ..."
std::string headline(const BatchReport& report);
nlohmann::ordered_json to_json(const BatchReport& report);
/// One page that needs nothing beside it.
std::string to_html(const BatchReport& report);

/// batch.html, batch.css and batch.js, by name.
const std::map<std::string, std::string>& batch_page_sources();

}  // namespace rcs::service
