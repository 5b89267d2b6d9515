#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "rcs/metrics.h"
#include "rcs/render.h"

namespace rcs::service {

/// How display values were made.
struct ShownWith {
    std::string config, display, view;
    double exposure = 0.0;  ///< [EV]
};

/// Records kept in a file from render to render.
struct RecordFileUse {
    std::string file;
    std::uint64_t loaded = 0, saved = 0;
};

/// What a command did and what it cost.
struct RunReport {
    std::string command, scene, camera;
    int width = 0, height = 0;  ///< [px]
    int threads = 0;
    std::vector<std::pair<std::string, std::string>> options;   ///< in the order of --help, as texts
    std::vector<std::pair<std::string, double>> stage_seconds;  ///< in order of execution; wall time
    double seconds = 0.0;                                       ///< wall time of the whole command
    double cpu_before = 0.0;                                    ///< what the process had taken when it began [s]
    std::optional<RenderStats> render;                          ///< of the render command
    std::uint64_t paths = 0;                                    ///< of the reference command
    std::optional<Forecast> forecast;                           ///< with a target or budget
    std::optional<RecordFileUse> record_file;
    std::optional<ShownWith> shown_with;
    std::vector<std::string> written;

    void add(const std::string& stage, double stage_time);
};

/// Runs `work` and adds its wall time to the report under `stage`.
template <typename Work>
auto timed(RunReport& report, const std::string& stage, const Work& work)
{
    const auto begin = std::chrono::steady_clock::now();
    struct Stop {
        RunReport& report;
        const std::string& stage;
        std::chrono::steady_clock::time_point begin;
        ~Stop() { report.add(stage, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count()); }
    } const stop{report, stage, begin};
    return work();
}

/// All rays of a render, whatever for.
std::uint64_t all_rays(const RenderStats& stats);

/// Largest amount of memory this process ever held [bytes].
std::uint64_t peak_memory();
/// Processor time of this process so far, all threads [s].
double cpu_seconds();

nlohmann::ordered_json to_json(const RunReport& report);
nlohmann::ordered_json to_json(const ErrorMetrics& metrics);

/// A short table for a person.
std::string to_text(const RunReport& report);

/// Whether write_text_file() could write there. @throws rcs::Error io that names the file
void check_text_path(const std::string& path);
/// Appears under its name only when complete.
void write_text_file(const std::string& path, const std::string& text);

}  // namespace rcs::service
