#include "report/measurement.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <nlohmann/json.hpp>

#include "output/stats_json.h"
#include "rcs/error.h"

namespace rcs::service {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kResult = "/point.json";
constexpr std::pair<const char*, std::string PointPictures::*> kPictures[] = {
    {"/picture.jpg", &PointPictures::picture},
    {"/indirect.jpg", &PointPictures::indirect},
    {"/difference.jpg", &PointPictures::difference},
    {"/records.jpg", &PointPictures::records}};

ErrorMetrics metrics_from(const Json& json)
{
    ErrorMetrics metrics;
    metrics.pixels = json.at("pixels");
    metrics.not_finite = json.at("not_finite");
    for (const MetricRow& row : metric_table()) {
        // What may be undefined may also be of a later version than the file.
        if (std::isnan(row.if_null) && !json.contains(row.name)) continue;
        const Json& value = json.at(row.name);
        metrics.*row.value = value.is_null() ? row.if_null : value.get<double>();
    }
    return metrics;
}

Measurement measurement_from(const Json& json)
{
    Measurement m;
    m.label = json.at("label");
    m.paths = json.at("paths_per_pixel");
    m.seconds = json.at("seconds");
    m.processor_seconds = json.at("processor_seconds");
    m.others = json.at("others_share_of_machine");
    for (const Json& stage : json.at("stages")) m.stage_seconds.emplace_back(stage.at("name"), stage.at("seconds"));
    m.records = json.at("records");
    m.rays = json.at("rays");
    if (!json.at("estimated_error").is_null()) m.estimated_error = json.at("estimated_error").get<double>();
    m.indirect = metrics_from(json.at("indirect"));
    m.beauty = metrics_from(json.at("beauty"));
    return m;
}

std::string read_bytes(const std::string& path)
{
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

}  // namespace

double without_noise(double measured, double noise)
{
    constexpr double kLeast = 0.1;
    const double square = measured * measured - noise * noise;
    return std::max(kLeast * measured, std::sqrt(std::max(0.0, square)));
}

CostPoint cost_of(const Measurement& m, double noise)
{
    return {m.seconds, without_noise(m.indirect.mean_relative_error, noise)};
}

std::vector<CostPoint> costs_of(const std::vector<Measurement>& measurements, bool renders, double noise)
{
    std::vector<CostPoint> costs;
    for (const Measurement& m : measurements) {
        if (m.is_render() == renders) costs.push_back(cost_of(m, noise));
    }
    return costs;
}

Json to_json(const Measurement& m)
{
    Json json{{"label", m.label},
              {"paths_per_pixel", m.paths},
              {"seconds", m.seconds},
              {"processor_seconds", m.processor_seconds},
              {"others_share_of_machine", m.others},
              {"stages", Json::array()}};
    for (const auto& [stage, seconds] : m.stage_seconds)
        json["stages"].push_back({{"name", stage}, {"seconds", seconds}});
    json["records"] = m.records;
    json["rays"] = m.rays;
    json["estimated_error"] = m.estimated_error ? Json(*m.estimated_error) : Json(nullptr);
    json["indirect"] = to_json(m.indirect);
    json["beauty"] = to_json(m.beauty);
    return json;
}

void save(const std::string& folder, const Measurement& measurement)
{
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) throw Error(ErrorCode::io, "cannot make the folder " + folder + ": " + error.message());
    for (const auto& [name, picture] : kPictures) {
        if (!(measurement.pictures.*picture).empty()) write_text_file(folder + name, measurement.pictures.*picture);
    }
    write_text_file(folder + kResult, to_json(measurement).dump(1));
}

std::optional<Measurement> load_measurement(const std::string& folder)
{
    if (!std::filesystem::is_regular_file(folder + kResult)) return std::nullopt;
    try {
        Measurement measurement = measurement_from(Json::parse(read_bytes(folder + kResult)));
        for (const auto& [name, picture] : kPictures) measurement.pictures.*picture = read_bytes(folder + name);
        return measurement;
    } catch (const Json::exception& e) {
        throw Error(ErrorCode::bad_file,
                    folder + kResult + " is damaged (" + e.what() + "); remove it to measure anew");
    }
}

}  // namespace rcs::service
