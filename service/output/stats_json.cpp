#include "output/stats_json.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include <sys/resource.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "output/json_number.h"
#include "output/plan_json.h"
#include "rcs/error.h"
#include "rcs/version.h"

namespace rcs::service {
namespace {

using Json = nlohmann::ordered_json;

std::uint64_t record_rays(const RecordStats& stats) { return stats.hemisphere_rays + stats.shadow_rays + stats.looks; }

double seconds_of(const RunReport& report, const std::string& stage)
{
    double sum = 0.0;
    for (const auto& [name, seconds] : report.stage_seconds) {
        sum += name == stage ? seconds : 0.0;
    }
    return sum;
}

double per(double amount, double count) { return count > 0.0 ? amount / count : 0.0; }

Json error_json(const ErrorEstimate& error)
{
    return {{"mean_relative", error.mean_relative},
            {"median_relative", error.median_relative},
            {"p95_relative", error.p95_relative}};
}

Json denoised_json(const DenoiseStats& denoised)
{
    Json json = {{"library", denoised.library},
                 {"device", denoised.device},
                 {"error_before",
                  {{"image", error_json(denoised.before.image)}, {"indirect", error_json(denoised.before.indirect)}}},
                 {"lights", Json::array()}};
    for (const DenoisedLight& light : denoised.lights)
        json["lights"].push_back({{"name", light.name},
                                  {"exact", light.is_exact},
                                  {"filtered", light.filtered},
                                  {"error_before", light.error_before},
                                  {"error_after", light.error_after}});
    return json;
}

void add_render(Json& json, const RunReport& report)
{
    const RenderStats& stats = *report.render;
    const double record_seconds = seconds_of(report, "records");
    json["records"] = stats.records.records;
    json["waves"] = stats.records.waves;
    json["refined_records"] = stats.records.refined;
    json["lit_points"] = stats.records.lit_points;
    json["direct_cells"] = stats.records.direct_cells;
    json["aimed_rays"] = stats.records.aimed_rays;
    json["gathered_lamps"] = stats.records.gathered_lamps;
    json["contacts"] = stats.contacts;
    json["contact_rays"] = stats.contact_rays;
    json["lamp_checks"] = stats.lamp_checks;
    json["unserved_pixels"] = stats.unserved_pixels;
    json["rays"] = {{"hemisphere", stats.records.hemisphere_rays},    {"refining", stats.records.refining_rays},
                    {"hemisphere_shadow", stats.records.shadow_rays}, {"look", stats.records.looks},
                    {"direct_shadow", stats.direct_shadow_rays},      {"lobe", stats.traced.rays},
                    {"lobe_shadow", stats.traced.shadow_rays},        {"lobe_look", stats.traced.looks}};
    json["record_rays_per_second"] = per(static_cast<double>(record_rays(stats.records)), record_seconds);
    if (stats.light_cache.cells > 0) {
        json["light_cache"] = {{"cells", stats.light_cache.cells}, {"links", stats.light_cache.links},
                               {"rays", stats.light_cache.rays},   {"shadow_rays", stats.light_cache.shadow_rays},
                               {"bytes", stats.light_cache.bytes}, {"seconds", seconds_of(report, "bounces")}};
    }
    json["error_estimate"] = {{"image", error_json(stats.errors.image)},
                              {"indirect", error_json(stats.errors.indirect)}};
    if (!stats.denoised.library.empty()) json["denoised"] = denoised_json(stats.denoised);
    json["splats"] = stats.splats.splats;
    json["pixels_per_splat"] = per(static_cast<double>(stats.splats.samples), static_cast<double>(stats.splats.splats));
    json["splat_method"] = stats.splat_method;
    json["gather_method"] = stats.gather_method;
    json["plan"] = to_json(stats.plan);
    json["counts"] = to_json(stats.counts);
    json["gl"] = {{"renderer", stats.gl_renderer}, {"version", stats.gl_version}, {"platform", stats.gl_platform}};
}

__attribute__((format(printf, 2, 3))) void append(std::string& text, const char* format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    char line[512];
    std::vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    text += line;
}

/// 1234567 as "1.23 M".
std::string short_count(double count)
{
    char text[32];
    if (count >= 1e9) {
        std::snprintf(text, sizeof text, "%.3g G", count * 1e-9);
    } else if (count >= 1e6) {
        std::snprintf(text, sizeof text, "%.3g M", count * 1e-6);
    } else if (count >= 1e4) {
        std::snprintf(text, sizeof text, "%.3g k", count * 1e-3);
    } else {
        std::snprintf(text, sizeof text, "%.0f", count);
    }
    return text;
}

std::string short_count(std::uint64_t count) { return short_count(static_cast<double>(count)); }

void append_error(std::string& text, const char* what, const ErrorEstimate& error)
{
    append(text, "%s is off by about %.1f %% in the mean, %.1f %% in the median, %.1f %% at the 95th percentile\n",
           what, 100.0 * error.mean_relative, 100.0 * error.median_relative, 100.0 * error.p95_relative);
}

/// What filtering did: never silent. @param after  the errors of the picture as it is
void append_denoised(std::string& text, const DenoiseStats& denoised, const ErrorEstimates& after)
{
    if (denoised.library.empty()) return;
    append(
        text,
        "denoised by %s (%s): the picture's error from %.1f %% to %.1f %%, indirect light's from %.1f %% to %.1f %%\n",
        denoised.library.c_str(), denoised.device.c_str(), 100.0 * denoised.before.image.mean_relative,
        100.0 * after.image.mean_relative, 100.0 * denoised.before.indirect.mean_relative,
        100.0 * after.indirect.mean_relative);
    if (denoised.lights.empty()) text += "         there is no light that a filter is for\n";
    for (const DenoisedLight& light : denoised.lights) {
        append(text, "         %s: ", light.name.c_str());
        if (light.is_exact)
            text += "exact, left as it was\n";
        else if (light.filtered > 0.0)
            append(text, "%.0f %% filtered, against other samples off by %.3g %% (rms) in place of %.3g %%\n",
                   100.0 * light.filtered, 100.0 * light.error_after, 100.0 * light.error_before);
        else if (!(light.error_before > 0.0))
            text += "left as it was: too few pixels have it to judge a filter by\n";
        else
            append(text, "left as it was, off by %.3g %% (rms): a filter does not help\n", 100.0 * light.error_before);
    }
}

void append_render(std::string& text, const RunReport& report)
{
    const RenderStats& stats = *report.render;
    const auto of_records = static_cast<double>(record_rays(stats.records));
    append(text, "records  %s in %s waves; %s in noisy places took %s more rays\n",
           short_count(stats.records.records).c_str(), short_count(stats.records.waves).c_str(),
           short_count(stats.records.refined).c_str(), short_count(stats.records.refining_rays).c_str());
    append(text, "rays     %s: hemisphere %s, its shadows %s, direct shadows %s; records shoot %s a second\n",
           short_count(all_rays(stats)).c_str(), short_count(stats.records.hemisphere_rays).c_str(),
           short_count(stats.records.shadow_rays).c_str(), short_count(stats.direct_shadow_rays).c_str(),
           short_count(per(of_records, seconds_of(report, "records"))).c_str());
    if (stats.records.lit_points > 0)
        append(text, "looks    %s at %s lit points: there records look for light, besides where their rays lead\n",
               short_count(stats.records.looks).c_str(), short_count(stats.records.lit_points).c_str());
    if (stats.records.direct_cells > 0)
        append(text,
               "cells    %s: what lamps and sky send there is known, so that rays of records need no shadow rays\n",
               short_count(stats.records.direct_cells).c_str());
    if (stats.contacts > 0)
        append(text, "contacts %s pixels where surfaces meet gathered themselves, by %s rays\n",
               short_count(stats.contacts).c_str(), short_count(stats.contact_rays).c_str());
    if (stats.lamp_checks > 0)
        append(text, "checks   %s pixels asked huge lamps themselves: records about them disagreed\n",
               short_count(stats.lamp_checks).c_str());
    if (stats.records.aimed_rays > 0)
        append(text, "aimed    %s of the rays of records, to where light had come from before\n",
               short_count(stats.records.aimed_rays).c_str());
    const double pixels = per(static_cast<double>(stats.splats.samples), static_cast<double>(stats.splats.splats));
    if (stats.light_cache.cells > 0) {
        append(text, "bounces  %s cells, %s links from %s rays, their shadows %s\n",
               short_count(stats.light_cache.cells).c_str(), short_count(stats.light_cache.links).c_str(),
               short_count(stats.light_cache.rays).c_str(), short_count(stats.light_cache.shadow_rays).c_str());
    }
    if (stats.traced.rays > 0) {
        append(text, "glossy   %s rays along narrow lobes, their shadows %s", short_count(stats.traced.rays).c_str(),
               short_count(stats.traced.shadow_rays).c_str());
        if (stats.traced.looks > 0) append(text, ", %s looks", short_count(stats.traced.looks).c_str());
        append(text, "\n");
    }
    append(text, "splats   %s as %s, %s pixels each\n", short_count(stats.splats.splats).c_str(),
           stats.splat_method.c_str(), short_count(pixels).c_str());
    append_denoised(text, stats.denoised, stats.errors);
    append_error(text, "error    the picture", stats.errors.image);
    append_error(text, "         its indirect light", stats.errors.indirect);
    std::string left_out;
    for (const PlannedEffect& e : stats.plan.effects) {
        if (!e.needed && e.has_material) {
            left_out.append(left_out.empty() ? "" : ", ").append(name_of(e.effect));
        }
    }
    if (!left_out.empty()) {
        text.append("left out ").append(left_out).append(" (rcsplat plan says why)\n");
    }
    append(text, "OpenGL   %s (%s)\n", stats.gl_renderer.c_str(), stats.gl_platform.c_str());
    if (stats.unserved_pixels > 0) {
        append(text, "warning  %s visible pixels have no record\n", short_count(stats.unserved_pixels).c_str());
    }
}

[[noreturn]] void fail_write(const std::string& path, int error)
{
    throw Error(ErrorCode::io, "cannot write '" + path + "': " + std::strerror(error));
}

std::string temporary_name(const std::string& path)
{
    const std::filesystem::path target(path);
    std::string name = ".";
    name.append(target.filename().string()).append(".tmp-").append(std::to_string(::getpid()));
    return (target.parent_path() / name).string();
}

}  // namespace

std::uint64_t all_rays(const RenderStats& stats)
{
    return record_rays(stats.records) + stats.contact_rays + stats.direct_shadow_rays + stats.light_cache.rays +
           stats.light_cache.shadow_rays + stats.traced.rays + stats.traced.shadow_rays;
}

std::uint64_t peak_memory()
{
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024u;  // Linux counts in KiB
}

double cpu_seconds()
{
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const auto of = [](const timeval& t) {
        return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    return of(usage.ru_utime) + of(usage.ru_stime);
}

void RunReport::add(const std::string& stage, double stage_time) { stage_seconds.emplace_back(stage, stage_time); }

Json to_json(const RunReport& report)
{
    Json json;
    json["version"] = kVersion;
    json["command"] = report.command;
    json["scene"] = report.scene;
    json["camera"] = report.camera;
    json["width"] = report.width;
    json["height"] = report.height;
    json["options"] = Json::object();
    for (const auto& [name, value] : report.options) {
        json["options"][name] = value;
    }
    json["threads"] = report.threads;
    json["seconds"] = report.seconds;
    json["cpu_seconds"] = cpu_seconds() - report.cpu_before;
    json["stage_seconds"] = Json::object();
    json["stages"] = Json::array();  // the same in order; objects have none for many readers
    for (const auto& [stage, seconds] : report.stage_seconds) {
        json["stage_seconds"][stage] = seconds_of(report, stage);
        json["stages"].push_back({{"name", stage}, {"seconds", seconds}});
    }
    if (report.render) {
        add_render(json, report);
    } else {
        json["paths"] = report.paths;
    }
    if (report.forecast) {
        json["forecast"] = {{"error", report.forecast->goal_error},
                            {"seconds", report.forecast->goal_seconds},
                            {"passes", report.forecast->passes},
                            {"points", Json::array()}};
        for (const Forecast::Point& point : report.forecast->points) {
            json["forecast"]["points"].push_back({{"error", point.error}, {"seconds", finite_or_null(point.seconds)}});
        }
    }
    if (report.record_file) {
        json["record_file"] = {{"file", report.record_file->file},
                               {"loaded", report.record_file->loaded},
                               {"saved", report.record_file->saved}};
    }
    if (report.shown_with) {
        json["tone_map"] = {{"config", report.shown_with->config},
                            {"display", report.shown_with->display},
                            {"view", report.shown_with->view},
                            {"exposure", report.shown_with->exposure}};
    }
    json["peak_memory_bytes"] = peak_memory();
    json["images"] = report.written;
    return json;
}

Json to_json(const ErrorMetrics& metrics)
{
    Json json{{"pixels", metrics.pixels}, {"not_finite", metrics.not_finite}};
    for (const MetricRow& row : metric_table()) json[row.name] = finite_or_null(metrics.*row.value);
    return json;
}

std::string to_text(const RunReport& report)
{
    std::string text;
    text.append(report.scene).append(", camera \"").append(report.camera).append("\"");
    append(text, ", %dx%d, %d threads\n", report.width, report.height, report.threads);
    append(text, "\n%-12s %9s %7s\n", "stage", "seconds", "share");
    for (const auto& [stage, seconds] : report.stage_seconds) {
        append(text, "%-12s %9.3f %5.1f %%\n", stage.c_str(), seconds, 100.0 * per(seconds, report.seconds));
    }
    append(text, "%-12s %9.3f\n\n", "all", report.seconds);
    if (report.render) {
        append_render(text, report);
    } else {
        append(text, "paths    %s\n", short_count(report.paths).c_str());
    }
    if (report.forecast) {
        append(text, "forecast %.1f s for %.1f %%; it took %.1f s\n", report.forecast->goal_seconds,
               100.0 * report.forecast->goal_error, report.seconds);
    }
    if (report.record_file) {
        append(text, "kept     %s records in %s, %s of them from before\n",
               short_count(report.record_file->saved).c_str(), report.record_file->file.c_str(),
               short_count(report.record_file->loaded).c_str());
    }
    append(text, "memory   %.0f MB at the most\n", static_cast<double>(peak_memory()) * 1e-6);
    if (report.shown_with) {
        append(text, "shown    %s on %s (%s), exposure %+.2f EV\n", report.shown_with->view.c_str(),
               report.shown_with->display.c_str(), report.shown_with->config.c_str(), report.shown_with->exposure);
    }
    for (const std::string& file : report.written) {
        text.append("wrote    ").append(file).append("\n");
    }
    return text;
}

void check_text_path(const std::string& path)
{
    if (path.empty()) {
        return;
    }
    std::error_code ignored;
    if (std::filesystem::exists(path, ignored) && !std::filesystem::is_regular_file(path, ignored)) {
        throw Error(ErrorCode::io, "cannot write '" + path + "': it is not a regular file");
    }
    const std::string temporary = temporary_name(path);
    std::FILE* file = std::fopen(temporary.c_str(), "w");
    if (file == nullptr) {
        fail_write(path, errno);
    }
    std::fclose(file);
    ::unlink(temporary.c_str());
}

void write_text_file(const std::string& path, const std::string& text)
{
    const std::string temporary = temporary_name(path);
    std::FILE* file = std::fopen(temporary.c_str(), "w");
    if (file == nullptr) {
        fail_write(path, errno);
    }
    errno = 0;
    const bool written = std::fwrite(text.data(), 1, text.size(), file) == text.size();
    const bool closed = std::fclose(file) == 0;
    if (!written || !closed || std::rename(temporary.c_str(), path.c_str()) != 0) {
        const int error = errno;
        ::unlink(temporary.c_str());
        fail_write(path, error);
    }
}

}  // namespace rcs::service
