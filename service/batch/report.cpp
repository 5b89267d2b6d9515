#include "batch/report.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <optional>

#include <nlohmann/json.hpp>

#include "rcs/version.h"
#include "report/encoding.h"

namespace rcs::service {
namespace {

using Json = nlohmann::ordered_json;

// A page shows so many pictures at the most, evenly taken: each is some kilobytes.
constexpr std::size_t kMostPictures = 240;

/// What all frames that were rendered took on average [s]; 0 without any.
double mean_of(const BatchReport& report, double FrameFigures::* value)
{
    double sum = 0.0;
    std::size_t count = 0;
    for (const FrameResult& frame : report.frames) {
        if (frame.end != FrameEnd::rendered && frame.end != FrameEnd::kept) continue;
        sum += frame.figures.*value;
        ++count;
    }
    return count > 0 ? sum / static_cast<double>(count) : 0.0;
}

std::string text_of(double value, const char* format)
{
    char text[64];
    std::snprintf(text, sizeof text, format, value);
    return text;
}

bool is_there(const FrameResult& frame) { return frame.end == FrameEnd::rendered || frame.end == FrameEnd::kept; }

struct Series {
    const char* name;
    const char* unit;
    std::function<std::optional<double>(const FrameFigures&)> value;
};

const std::vector<Series>& all_series()
{
    static const std::vector<Series> list{
        {"time", "s", [](const FrameFigures& f) { return f.seconds; }},
        {"error of the picture, estimated", "%", [](const FrameFigures& f) { return 100.0 * f.error; }},
        {"records made", "", [](const FrameFigures& f) { return static_cast<double>(f.records_made); }},
        {"records reused", "", [](const FrameFigures& f) { return static_cast<double>(f.records_reused); }},
        {"change from the frame before", "%",
         [](const FrameFigures& f) { return f.flicker ? std::optional(100.0 * *f.flicker) : std::nullopt; }}};
    return list;
}

/// One curve over the frames, from 0 up.
std::string curve(const BatchReport& report, const Series& series)
{
    constexpr double kWidth = 720, kHeight = 120, kLeft = 64, kTop = 8, kBelow = 20;
    std::vector<std::pair<int, double>> points;
    double most = 0.0;
    for (const FrameResult& frame : report.frames) {
        const auto value = is_there(frame) ? series.value(frame.figures) : std::nullopt;
        if (!value) continue;
        points.emplace_back(frame.number, *value);
        most = std::max(most, *value);
    }
    if (points.empty()) return {};
    const double first = points.front().first, span = std::max(1.0, points.back().first - first);
    const auto x = [&](double number) { return kLeft + (number - first) / span * (kWidth - kLeft - 12); };
    const auto y = [&](double value) {
        return kTop + (1.0 - (most > 0.0 ? value / most : 0.0)) * (kHeight - kTop - kBelow);
    };
    std::string line, dots;
    for (const auto& [number, value] : points) {
        line += text_of(x(number), "%.1f") + "," + text_of(y(value), "%.1f") + " ";
        if (points.size() <= 120)
            dots += "<circle cx=\"" + text_of(x(number), "%.1f") + "\" cy=\"" + text_of(y(value), "%.1f") +
                    "\" r=\"2.5\"><title>frame " + std::to_string(number) + ": " + text_of(value, "%.3g") + " " +
                    series.unit + "</title></circle>";
    }
    const std::string name = html_escape(series.name);
    const auto mark = [](double at_x, double at_y, const char* anchor, const std::string& text) {
        return "<text x=\"" + text_of(at_x, "%.1f") + "\" y=\"" + text_of(at_y, "%.1f") + "\" text-anchor=\"" + anchor +
               "\">" + text + "</text>";
    };
    const char* const format = most < 0.01 ? "%.0e" : most < 1000.0 ? "%.3g" : "%.0f";  // as wide as there is room
    const std::string unit = *series.unit == '\0' ? "" : std::string(" ") + series.unit;
    return "<figure><figcaption>" + name + "</figcaption><svg viewBox=\"0 0 720 120\" role=\"img\" aria-label=\"" +
           name + " over the frames\"><path class=\"axis\" d=\"M64 8V100H712\"/>" +
           mark(kLeft - 6, kTop + 8, "end", text_of(most, format) + unit) +
           mark(kLeft - 6, kHeight - kBelow, "end", "0") +
           mark(kLeft, kHeight - 5, "middle", std::to_string(points.front().first)) +
           mark(x(points.back().first), kHeight - 5, "end", std::to_string(points.back().first)) +
           "<polyline points=\"" + line + "\"/>" + dots + "</svg></figure>\n";
}

std::string log_of(const FrameResult& frame)
{
    if (frame.log.empty()) return {};
    return "<details><summary>log</summary><pre>" + html_escape(frame.log) + "</pre></details>";
}

std::string failures(const BatchReport& report)
{
    std::string rows;
    for (const FrameResult& frame : report.frames) {
        if (frame.end != FrameEnd::failed && frame.end != FrameEnd::left) continue;
        const std::string why = frame.end == FrameEnd::failed ? frame.error : "the batch ended before it";
        rows += "<tr><td>" + std::to_string(frame.number) + "</td><td>" + name_of(frame.end) + "</td><td>" +
                html_escape(why) + log_of(frame) + "</td></tr>\n";
    }
    if (rows.empty()) return {};
    return "<section aria-labelledby=\"failed\"><h2 id=\"failed\">Frames that are not "
           "there</h2><table><thead><tr><th>frame"
           "</th><th>state</th><th>reason</th></tr></thead><tbody>" +
           rows + "</tbody></table></section>\n";
}

std::string rows(const BatchReport& report)
{
    std::string html;
    for (const FrameResult& frame : report.frames) {
        const FrameFigures& f = frame.figures;
        html += "<tr><td>" + std::to_string(frame.number) + "</td><td>" + name_of(frame.end) + "</td><td>" +
                html_escape(frame.end == FrameEnd::failed ? frame.error : frame.why) + "</td>";
        if (is_there(frame))
            html += "<td>" + duration_text(f.seconds) + "</td><td>" + percent_text(f.error) + "</td><td>" +
                    percent_text(f.indirect_error) + "</td><td>" + std::to_string(f.records_made) + "</td><td>" +
                    std::to_string(f.records_reused) + "</td><td>" + (f.flicker ? percent_text(*f.flicker) : "–") +
                    "</td>";
        else
            html += "<td></td><td></td><td></td><td></td><td></td><td></td>";
        html += "</tr>\n";
    }
    return html;
}

std::string warnings(const BatchReport& report)
{
    std::map<std::string, std::size_t> counts;
    for (const FrameResult& frame : report.frames)
        for (const std::string& warning : frame.figures.warnings) ++counts[warning];
    if (counts.empty()) return {};
    std::string list;
    for (const auto& [text, count] : counts)
        list += "<li>" + html_escape(text) + " (" + std::to_string(count) + (count == 1 ? " frame" : " frames") +
                ")</li>\n";
    return "<section aria-labelledby=\"warnings\"><h2 id=\"warnings\">Warnings</h2><ul>" + list + "</ul></section>\n";
}

std::string removed(const BatchReport& report)
{
    std::string list;
    for (const std::string& line : report.removed) list += "<li>" + html_escape(line) + "</li>\n";
    if (list.empty()) return {};
    return "<section aria-labelledby=\"removed\"><h2 id=\"removed\">Earlier nights</h2><ul>" + list +
           "</ul></section>\n";
}

std::string cost(const BatchReport& report)
{
    const std::string ahead =
        report.ahead_seconds > 0.0 ? ", what they share " + duration_text(report.ahead_seconds) : "";
    const std::string processor = duration_text(report.cpu_seconds) + " of processor time";
    const std::string machine = "From " + report.began + " to " + report.ended + ": " + duration_text(report.seconds) +
                                ", " + processor + " with " + std::to_string(report.threads) + " threads, at most " +
                                text_of(static_cast<double>(report.peak_memory) / 1e6, "%.0f MB") + " of memory.";
    const std::string tasks = "Until " + report.ended + ", in tasks: frames took " + duration_text(report.seconds) +
                              " one after the other, " + processor + ".";
    const std::string server = "From " + report.began + " to " + report.ended + ": " + duration_text(report.seconds) +
                               ", by the render server at " + report.server + ", which took " + processor +
                               " for its frames.";
    return (!report.server.empty() ? server
            : report.threads > 0   ? machine
                                   : tasks) +
           " A frame took " + duration_text(mean_of(report, &FrameFigures::seconds)) + " on average" + ahead +
           ". Next night: all " + std::to_string(report.frames.size()) + " frames anew would take about " +
           duration_text(forecast_seconds(report)) + (report.threads > 0 ? "." : " of one machine's time.");
}

std::string movie(const BatchReport& report)
{
    const std::string name(kMovieFile);
    return report.has_movie ? "<p><a href=\"" + name + "\">" + name + "</a> shows them in full size.</p>" : "";
}

/// Frames as the page's script takes them.
std::string pictures(const BatchReport& report)
{
    const std::size_t step = picture_step(report.frames.size());
    Json list = Json::array();
    for (std::size_t i = 0; i < report.frames.size(); i += step) {
        const FrameResult& frame = report.frames[i];
        if (!is_there(frame) || frame.figures.thumbnail.empty()) continue;
        list.push_back({{"frame", frame.number},
                        {"text", "frame " + std::to_string(frame.number) + ", " + duration_text(frame.figures.seconds) +
                                     ", error " + percent_text(frame.figures.error)},
                        {"image", "data:image/jpeg;base64," + frame.figures.thumbnail}});
    }
    return Json{{"fps", report.fps / static_cast<double>(step)}, {"frames", list}}.dump();
}

}  // namespace

std::vector<std::string> report_files() { return {"report.json", "report.html", kMovieFile}; }

std::string report_record_path(const std::string& folder)
{
    return record_path((std::filesystem::path(folder) / "report.html").string());
}

std::size_t picture_step(std::size_t frames)
{
    return std::max<std::size_t>(1, (frames + kMostPictures - 1) / kMostPictures);
}

std::string name_of(FrameEnd end)
{
    switch (end) {
        case FrameEnd::rendered:
            return "rendered";
        case FrameEnd::kept:
            return "done before";
        case FrameEnd::failed:
            return "failed";
        case FrameEnd::left:
            return "not reached";
    }
    return {};
}

std::string line_of(const FrameResult& result, bool explain)
{
    const std::string line = "frame " + std::to_string(result.number) + ": ";
    const FrameFigures& f = result.figures;
    switch (result.end) {
        case FrameEnd::failed:
            return line + "failed: " + result.error;
        case FrameEnd::kept:
            return line + (explain ? "done before, and nothing it depends on has changed" : "done before");
        case FrameEnd::left:
            return line + "to be rendered: " + result.why;
        case FrameEnd::rendered:
            break;
    }
    return line + "rendered in " + duration_text(f.seconds) + ", error " + percent_text(f.error) + ", records " +
           std::to_string(f.records_made) + " made, " + std::to_string(f.records_reused) + " reused" +
           (explain ? "; " + result.why : "");
}

std::size_t BatchReport::count(FrameEnd end) const
{
    return static_cast<std::size_t>(
        std::count_if(frames.begin(), frames.end(), [&](const FrameResult& frame) { return frame.end == end; }));
}

double cpu_of_rendered(const BatchReport& report)
{
    double sum = 0.0;
    for (const FrameResult& frame : report.frames)
        if (frame.end == FrameEnd::rendered) sum += frame.figures.cpu_seconds;
    return sum;
}

double forecast_seconds(const BatchReport& report)
{
    return static_cast<double>(report.frames.size()) * mean_of(report, &FrameFigures::seconds) + report.ahead_seconds;
}

void add_up(BatchReport& report)
{
    report.threads = 0;
    report.seconds = report.cpu_seconds = 0.0;
    for (const FrameResult& frame : report.frames) {
        if (!is_there(frame)) continue;
        report.seconds += frame.figures.seconds;
        report.cpu_seconds += frame.figures.cpu_seconds;
    }
}

std::string headline(const BatchReport& report)
{
    const std::size_t there = report.count(FrameEnd::rendered) + report.count(FrameEnd::kept);
    const std::size_t all = report.frames.size();
    std::string text =
        std::to_string(there) + " of " + std::to_string(all) + (all == 1 ? " frame is there" : " frames are there");
    if (there == all) text = all == 1 ? "The frame is there" : "All " + std::to_string(all) + " frames are there";
    for (const FrameEnd end : {FrameEnd::failed, FrameEnd::left, FrameEnd::rendered, FrameEnd::kept})
        if (report.count(end) > 0) text += ", " + std::to_string(report.count(end)) + " " + name_of(end);
    return text;
}

Json to_json(const BatchReport& report)
{
    Json frames = Json::array();
    for (const FrameResult& frame : report.frames) {
        Json json{{"frame", frame.number}, {"state", name_of(frame.end)}, {"why", frame.why}};
        if (!frame.error.empty()) json["error"] = frame.error;
        if (!frame.log.empty()) json["log"] = frame.log;
        if (is_there(frame)) {
            json["files"] = frame.files;
            json["figures"] = to_json(frame.figures);
        }
        frames.push_back(std::move(json));
    }
    return {{"rcsplat", kVersion},
            {"scene", report.scene},
            {"command", report.command},
            {"fps", report.fps},
            {"width", report.width},
            {"height", report.height},
            {"threads", report.threads},
            {"independent_frames", report.independent},
            {"server", report.server.empty() ? Json(nullptr) : Json(report.server)},
            {"began", report.began},
            {"ended", report.ended},
            {"seconds", report.seconds},
            {"cpu_seconds", report.cpu_seconds},
            {"ahead_seconds", report.ahead_seconds},
            {"peak_memory_bytes", report.peak_memory},
            {"movie", report.has_movie ? Json(kMovieFile) : Json(nullptr)},
            {"removed", report.removed},
            {"counts",
             {{"frames", report.frames.size()},
              {"rendered", report.count(FrameEnd::rendered)},
              {"kept", report.count(FrameEnd::kept)},
              {"failed", report.count(FrameEnd::failed)},
              {"left", report.count(FrameEnd::left)}}},
            {"forecast_seconds", forecast_seconds(report)},
            {"frames", frames}};
}

std::string to_html(const BatchReport& report)
{
    std::string curves;
    for (const Series& series : all_series()) curves += curve(report, series);
    const auto& sources = batch_page_sources();
    return fill_page(sources.at("batch.html"),
                     {{"title", html_escape("Frames of " + report.scene)},
                      {"subtitle", std::to_string(report.width) + " × " + std::to_string(report.height) + " pixels, " +
                                       text_of(report.fps, "%g") + " frames a second"},
                      {"headline", html_escape(headline(report) + ".")},
                      {"command", html_escape(report.command)},
                      {"css", sources.at("batch.css")},
                      {"js", sources.at("batch.js")},
                      {"failures", failures(report)},
                      {"movie", movie(report)},
                      {"warnings", warnings(report)},
                      {"removed", removed(report)},
                      {"cost", html_escape(cost(report))},
                      {"curves", curves},
                      {"rows", rows(report)},
                      {"footer", html_escape(std::string("rcsplat ") + kVersion)},
                      {"data", script_text(pictures(report))}});
}

}  // namespace rcs::service
