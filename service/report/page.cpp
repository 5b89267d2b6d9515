#include "report/page.h"

#include <algorithm>
#include <cstdio>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include "rcs/version.h"
#include "report/encoding.h"
#include "report/headline.h"
#include "report/pictures.h"
#include "report/table.h"

namespace rcs::service {
namespace {

using Json = nlohmann::ordered_json;

std::string number_text(double value, const char* format)
{
    char text[32];
    std::snprintf(text, sizeof text, format, value);
    return text;
}

std::string data_uri(const std::string& jpeg) { return "data:image/jpeg;base64," + base64(jpeg); }

/// What the page calls a point: its number, or its paths.
std::string name_of(const AccuracyReport& report, std::size_t index)
{
    const Measurement& m = report.points[index];
    return m.is_render() ? std::to_string(index + 1) : std::to_string(m.paths) + " paths";
}

std::string title_of(const AccuracyReport& report, std::size_t index)
{
    const Measurement& m = report.points[index];
    return name_of(report, index) + ": " + m.label + ", " + duration_text(m.seconds) + ", error " +
           percent_text(cost_of(m, report.reference.error).error);
}

std::string tabs(const AccuracyReport& report)
{
    std::string html;
    for (std::size_t i = 0; i < report.points.size(); ++i) {
        const Measurement& m = report.points[i];
        html += "<button role=\"tab\" type=\"button\" id=\"tab-" + std::to_string(i) + "\" aria-controls=\"panel\"" +
                (m.is_render() ? "" : " class=\"traced\"") + " title=\"" + html_escape(title_of(report, i)) + "\">" +
                name_of(report, i) + "</button>\n";
    }
    return html;
}

std::string rows(const AccuracyReport& report)
{
    const std::vector<bool> best = on_front(report);
    std::string html;
    for (std::size_t i = 0; i < report.points.size(); ++i) {
        const Measurement& m = report.points[i];
        const std::string mark = best[i] ? " <span class=\"front-mark\" title=\"on the Pareto front\">●</span>" : "";
        html += "<tr><td>" + name_of(report, i) + mark + "</td><th scope=\"row\">" + html_escape(m.label) + "</th>";
        for (const std::string& cell :
             {duration_text(m.seconds), duration_text(m.processor_seconds),
              m.is_render() ? std::to_string(m.records) : std::string("–"),
              percent_text(cost_of(m, report.reference.error).error), percent_text(m.indirect.mean_relative_error),
              percent_text(m.indirect.median_relative_error), percent_text(m.indirect.p95_relative_error),
              number_text(m.indirect.relmse, "%.2g"), number_text(m.indirect.ratio_of_means, "%.4f"),
              percent_text(m.beauty.mean_relative_error), number_text(m.beauty.relmse, "%.2g"),
              number_text(m.beauty.flip, "%.3f"),
              m.estimated_error ? percent_text(*m.estimated_error) : std::string("–")})
            html += "<td>" + cell + "</td>";
        html += "</tr>\n";
    }
    return html;
}

/// What the same settings take for the final picture: as many times the pixels, though records grow slower. [s]
double final_seconds(const AccuracyReport& report, const Measurement& m)
{
    const double pixels = static_cast<double>(report.width) * report.height;
    return m.seconds * static_cast<double>(report.final_width) * report.final_height / pixels;
}

/// What a reader copies to have this picture; "" for the path tracer's, whose options differ.
std::string command_of(const AccuracyReport& report, const Measurement& m)
{
    return m.is_render() && !report.command.empty() ? report.command + " " + m.label + " -o picture.exr" : "";
}

Json facts(const AccuracyReport& report, const Measurement& m)
{
    Json facts = Json::array();
    const auto add = [&](const char* name, const std::string& value) { facts.push_back({name, value}); };
    add("mean relative error", percent_text(cost_of(m, report.reference.error).error));
    add("... as measured, with the reference's noise", percent_text(m.indirect.mean_relative_error));
    add("median", percent_text(m.indirect.median_relative_error));
    add("95 % of the pixels within", percent_text(m.indirect.p95_relative_error));
    add("relMSE", number_text(m.indirect.relmse, "%.2g"));
    add("ratio of means", number_text(m.indirect.ratio_of_means, "%.4f"));
    if (m.estimated_error) add("error it estimated", percent_text(*m.estimated_error));
    add("MRE of the whole picture", percent_text(m.beauty.mean_relative_error));
    add("FLIP of the whole picture", number_text(m.beauty.flip, "%.3f"));
    add("processor time", duration_text(m.processor_seconds));
    if (report.final_width > 0)
        add(("time at " + std::to_string(report.final_width) + " × " + std::to_string(report.final_height)).c_str(),
            "at most about " + duration_text(final_seconds(report, m)));
    if (m.is_render()) add("records", std::to_string(m.records));
    if (m.is_render()) add("rays", number_text(static_cast<double>(m.rays) * 1e-6, "%.1f million"));
    return facts;
}

Json stages(const Measurement& m)
{
    Json stages = Json::array();
    for (const auto& [name, seconds] : m.stage_seconds) {
        stages.push_back(
            {{"name", name}, {"share", m.seconds > 0.0 ? seconds / m.seconds : 0.0}, {"text", duration_text(seconds)}});
    }
    return stages;
}

/// The default settings where they were measured: a user looks at those first.
std::size_t first_shown(const AccuracyReport& report)
{
    const RecordSettings defaults;
    const std::string label = settings_point({}, defaults.error_tolerance, defaults.rays, defaults.noise_target).label;
    const auto found = std::find_if(report.points.begin(), report.points.end(),
                                    [&](const Measurement& m) { return m.label == label; });
    return found == report.points.end() ? 0 : static_cast<std::size_t>(found - report.points.begin());
}

std::string data_of(const AccuracyReport& report)
{
    Json data{{"first", first_shown(report)},
              {"reference",
               {{"picture", data_uri(report.reference.picture)}, {"indirect", data_uri(report.reference.indirect)}}},
              {"points", Json::array()}};
    for (std::size_t i = 0; i < report.points.size(); ++i) {
        const Measurement& m = report.points[i];
        Json images{{"picture", data_uri(m.pictures.picture)},
                    {"indirect", data_uri(m.pictures.indirect)},
                    {"difference", data_uri(m.pictures.difference)}};
        if (!m.pictures.records.empty()) images["records"] = data_uri(m.pictures.records);
        data["points"].push_back({{"name", name_of(report, i)},
                                  {"label", m.label},
                                  {"traced", !m.is_render()},
                                  {"command", command_of(report, m)},
                                  {"facts", facts(report, m)},
                                  {"stages", stages(m)},
                                  {"images", images}});
    }
    return script_text(data.dump(-1, ' ', false, Json::error_handler_t::replace));
}

std::string floor_text(const AccuracyReport& report)
{
    return "The reference has noise of its own: a perfect image would measure about " +
           percent_text(report.reference.error) +
           " (dashed). It is taken off here, in squares; below that line errors are known roughly.";
}

std::string reference_text(const AccuracyReport& report)
{
    const ReferenceSummary& reference = report.reference;
    std::string text =
        "The reference is path traced with the same bounces of light, by code that shares nothing with the "
        "records: " +
        std::to_string(reference.paths) + " paths a pixel in " + duration_text(reference.seconds) +
        ", in two halves of different seeds. Half the difference of the "
        "halves is the error of their mean: " +
        percent_text(reference.error) +
        " of the indirect light "
        "(mean relative error)";
    text += reference.error > reference.wanted_error
                ? "; " + percent_text(reference.wanted_error) + " was wanted, but the paths allowed ran out. "
                : ", where " + percent_text(reference.wanted_error) + " was wanted. ";
    return text +
           "That noise is part of every error measured here, for rendered and path traced images alike; the column "
           "MRE, "
           "the curve and the headline have it taken off: √(measured² − noise²). The path "
           "tracer's points have another seed than the reference.";
}

/// Whether others used the machine while it was measured.
std::string busy_text(const AccuracyReport& report)
{
    constexpr double kBusy = 0.1;
    double most = 0.0;
    for (const Measurement& m : report.points) most = std::max(most, m.others);
    if (most < kBusy) return ", which did little else meanwhile";
    return "; other programs took up to " + percent_text(most) +
           " of the machine meanwhile, and the times are too long";
}

}  // namespace

PlotData plot_of(const AccuracyReport& report)
{
    PlotData data;
    for (std::size_t i = 0; i < report.points.size(); ++i) {
        const Measurement& m = report.points[i];
        const CostPoint cost = cost_of(m, report.reference.error);
        (m.is_render() ? data.renders : data.paths)
            .push_back({cost.seconds, cost.error, name_of(report, i), title_of(report, i)});
    }
    data.front = pareto_front(report.renders());
    data.noise_floor = report.reference.error;
    return data;
}

std::string to_html(const AccuracyReport& report)
{
    const auto& sources = page_sources();
    const std::string title = "What accuracy costs: " + report.scene;
    const std::string subtitle = "camera “" + report.camera + "”, " + std::to_string(report.width) + " × " +
                                 std::to_string(report.height) + " pixels, " + std::to_string(report.aa) +
                                 (report.aa == 1 ? " sample" : " samples") + " a pixel, " +
                                 std::to_string(report.bounces) + (report.bounces == 1 ? " bounce" : " bounces") +
                                 " of indirect light, " + std::to_string(report.threads) + " threads";
    const std::string machine = (report.processor.empty() ? "" : " on " + report.processor) + busy_text(report);
    return fill_page(
        sources.at("page.html"),
        {{"title", html_escape(title)},
         {"subtitle", html_escape(subtitle)},
         {"headline", html_escape(headline(report.renders(), report.paths()))},
         {"css", sources.at("page.css")},
         {"js", sources.at("page.js")},
         {"plot", to_svg(lay_out(plot_of(report)), "Mean relative error of the indirect light against time")},
         {"floor", html_escape(floor_text(report))},
         {"tabs", tabs(report)},
         {"rows", rows(report)},
         {"width", std::to_string(report.width)},
         {"height", std::to_string(report.height)},
         {"largest", percent_text(static_cast<double>(kLargestDifference))},
         {"reference", html_escape(reference_text(report))},
         {"machine", html_escape(machine)},
         {"footer", html_escape(std::string("rcsplat ") + kVersion + ", OpenGL by " + report.gl_renderer)},
         {"data", data_of(report)}});
}

}  // namespace rcs::service
