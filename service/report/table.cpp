#include "report/table.h"

#include <cmath>
#include <cstdio>

#include <nlohmann/json.hpp>

#include "output/stats_json.h"
#include "rcs/version.h"
#include "report/encoding.h"
#include "report/headline.h"

namespace rcs::service {
namespace {

std::string field_of(double value)
{
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", value);
    return text;
}

/// The metrics of a layer, in the order of metric_columns().
std::string metric_fields(const ErrorMetrics& m)
{
    std::string fields;
    for (const MetricRow& row : metric_table()) fields.append(",").append(field_of(m.*row.value));
    return fields;
}

std::string metric_columns(const std::string& layer)
{
    std::string columns;
    for (const MetricRow& row : metric_table()) columns.append(",").append(layer).append("_").append(row.column);
    return columns;
}

}  // namespace

std::vector<bool> on_front(const AccuracyReport& report)
{
    std::vector<std::size_t> renders;
    for (std::size_t i = 0; i < report.points.size(); ++i) {
        if (report.points[i].is_render()) renders.push_back(i);
    }
    std::vector<bool> best(report.points.size(), false);
    for (const std::size_t i : pareto_front(report.renders())) best[renders[i]] = true;
    return best;
}

std::string to_csv(const AccuracyReport& report)
{
    std::string csv =
        "point,method,label,seconds,processor_seconds,others_share_of_machine,records,rays,paths_per_pixel,pareto,"
        "estimated_error" +
        metric_columns("indirect") + metric_columns("beauty") + "\r\n";
    const std::vector<bool> best = on_front(report);
    for (std::size_t i = 0; i < report.points.size(); ++i) {
        const Measurement& m = report.points[i];
        csv += std::to_string(i + 1) + (m.is_render() ? ",splatting," : ",path tracer,") + csv_field(m.label) + "," +
               field_of(m.seconds) + "," + field_of(m.processor_seconds) + "," + field_of(m.others) + "," +
               std::to_string(m.records) + "," + std::to_string(m.rays) + "," + std::to_string(m.paths) + "," +
               (best[i] ? "1" : "0") + "," + (m.estimated_error ? field_of(*m.estimated_error) : "") +
               metric_fields(m.indirect) + metric_fields(m.beauty) + "\r\n";
    }
    return csv;
}

std::string to_text(const AccuracyReport& report)
{
    std::string text = headline(report.renders(), report.paths()) + "\n\n";
    char line[256];
    std::snprintf(line, sizeof line, "%2s %10s %10s %8s %8s %8s %8s %10s  %s\n", "", "seconds", "processor", "MRE",
                  "measured", "median", "p95", "records", "settings");
    text += line;
    const std::vector<bool> best = on_front(report);
    for (std::size_t i = 0; i < report.points.size(); ++i) {
        const Measurement& m = report.points[i];
        std::snprintf(line, sizeof line, "%2zu %10.3f %10.3f %6.2f %% %6.2f %% %6.2f %% %6.1f %% %10llu  ", i + 1,
                      m.seconds, m.processor_seconds, 100.0 * cost_of(m, report.reference.error).error,
                      100.0 * m.indirect.mean_relative_error, 100.0 * m.indirect.median_relative_error,
                      100.0 * m.indirect.p95_relative_error, static_cast<unsigned long long>(m.records));
        text.append(line).append(m.label).append(best[i] || !m.is_render() ? "\n" : " (beaten)\n");
    }
    std::snprintf(line, sizeof line,
                  "\nreference %d paths a pixel in %s; by its own noise a perfect image would measure %.2f %%,\n"
                  "which is taken off from MRE in squares\n",
                  report.reference.paths, duration_text(report.reference.seconds).c_str(),
                  100.0 * report.reference.error);
    return text + line;
}

nlohmann::ordered_json to_json(const AccuracyReport& report)
{
    nlohmann::ordered_json json{{"version", kVersion},           {"command", "accuracy"},   {"scene", report.scene},
                                {"camera", report.camera},       {"width", report.width},   {"height", report.height},
                                {"bounces", report.bounces},     {"aa", report.aa},         {"threads", report.threads},
                                {"processor", report.processor}, {"gl", report.gl_renderer}};
    json["headline"] = headline(report.renders(), report.paths());
    json["reference"] = {{"paths_per_pixel", report.reference.paths},
                         {"seconds", report.reference.seconds},
                         {"mean_relative_error", report.reference.error},
                         {"wanted_mean_relative_error", report.reference.wanted_error}};
    json["points"] = nlohmann::ordered_json::array();
    const std::vector<bool> best = on_front(report);
    for (std::size_t i = 0; i < report.points.size(); ++i) {
        json["points"].push_back(to_json(report.points[i]));
        json["points"].back()["mean_relative_error"] = cost_of(report.points[i], report.reference.error).error;
        json["points"].back()["pareto"] = static_cast<bool>(best[i]);
    }
    return json;
}

}  // namespace rcs::service
