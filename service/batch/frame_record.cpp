#include "batch/frame_record.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <system_error>

#include <nlohmann/json.hpp>

#include "output/stats_json.h"
#include "rcs/error.h"
#include "rcs/fingerprint.h"

namespace rcs::service {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kLayout = 1;  // of these files

FrameFigures figures_of(const Json& json)
{
    FrameFigures f;
    f.seconds = json.at("seconds");
    f.cpu_seconds = json.at("cpu_seconds");
    f.error = json.at("error");
    f.indirect_error = json.at("indirect_error");
    f.records_made = json.at("records_made");
    f.records_reused = json.at("records_reused");
    f.rays = json.at("rays");
    if (json.at("flicker").is_number()) f.flicker = json.at("flicker").get<double>();
    f.exposure = json.at("exposure");
    f.tries = json.at("tries");
    for (const Json& warning : json.at("warnings")) f.warnings.push_back(warning);
    return f;
}

FrameRecord record_of(const Json& json)
{
    FrameRecord record;
    record.number = json.at("frame");
    record.source = json.at("source");
    for (const auto& [name, text] : json.at("depends").items()) record.depends.emplace_back(name, text);
    for (const Json& file : json.at("files"))
        record.files.push_back({file.at("name"), file.at("bytes"), file.at("kept"), file.value("hash", "")});
    record.figures = figures_of(json.at("figures"));
    record.figures.thumbnail = json.at("thumbnail");
    return record;
}

}  // namespace

std::string record_path(const std::string& first_file)
{
    const fs::path file(first_file);
    return (file.parent_path() / ".rcsplat" / (file.filename().string() + ".json")).string();
}

std::optional<FrameRecord> read_frame_record(const std::string& path)
{
    std::ifstream file(path, std::ios::binary);
    if (!file) return std::nullopt;
    try {
        const Json json = Json::parse(file);
        if (json.at("layout") != kLayout) return std::nullopt;
        return record_of(json);
    } catch (const Json::exception&) {
        return std::nullopt;
    }
}

Json to_json(const FrameFigures& f)
{
    return {{"seconds", f.seconds},
            {"cpu_seconds", f.cpu_seconds},
            {"error", f.error},
            {"indirect_error", f.indirect_error},
            {"records_made", f.records_made},
            {"records_reused", f.records_reused},
            {"rays", f.rays},
            {"flicker", f.flicker ? Json(*f.flicker) : Json(nullptr)},
            {"exposure", f.exposure},
            {"tries", f.tries},
            {"warnings", f.warnings}};
}

void write_frame_record(const std::string& path, const FrameRecord& record)
{
    Json depends = Json::object(), files = Json::array();
    for (const auto& [name, text] : record.depends) depends[name] = text;
    for (const FrameFile& file : record.files)
        files.push_back({{"name", file.name}, {"bytes", file.bytes}, {"kept", file.kept}, {"hash", file.hash}});
    const Json json{{"layout", kLayout},
                    {"frame", record.number},
                    {"source", record.source},
                    {"depends", depends},
                    {"files", files},
                    {"figures", to_json(record.figures)},
                    {"thumbnail", record.figures.thumbnail}};
    write_text_file(path, json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
}

std::string file_hash(const std::string& path)
{
    std::ifstream file(path, std::ios::binary);
    if (!file) throw Error(ErrorCode::io, path + ": cannot be read");
    Fingerprint print;
    std::string bytes(1 << 20, '\0');
    do {
        file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
        print.add_bytes(bytes.data(), static_cast<std::size_t>(file.gcount()));
    } while (file);
    return print.text();
}

std::string difference(const Dependencies& was, const Dependencies& is)
{
    std::string words;
    const auto say = [&](const std::string& what) { words.append(words.empty() ? "" : ", ").append(what); };
    const auto find = [](const Dependencies& list, const std::string& name) {
        return std::find_if(list.begin(), list.end(), [&](const auto& entry) { return entry.first == name; });
    };
    for (const auto& [name, text] : is) {
        const auto old = find(was, name);
        if (old != was.end() && old->second == text) continue;
        const bool hash = name == "scene" || name == "camera" || old == was.end();
        say(hash ? name + " has changed" : name + " was " + old->second + ", is " + text);
    }
    for (const auto& [name, text] : was)
        if (find(is, name) == is.end()) say(name + " was " + text);
    return words;
}

std::string missing_file(const FrameRecord& record, const std::vector<FrameFile>& wanted, const std::string& folder)
{
    for (const FrameFile& file : wanted) {
        const auto old = std::find_if(record.files.begin(), record.files.end(),
                                      [&](const FrameFile& f) { return f.name == file.name; });
        if (old == record.files.end()) return file.name + " was not asked for before";
        if (old->kept != file.kept) return file.name + " kept " + old->kept + ", is to keep " + file.kept;
        std::error_code failed;
        const auto bytes = fs::file_size(fs::path(folder) / file.name, failed);
        if (failed) return file.name + " is missing";
        if (bytes != old->bytes) return file.name + " is not the file that was written";
    }
    return {};
}

}  // namespace rcs::service
