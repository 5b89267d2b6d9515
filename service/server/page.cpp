#include "server/page.h"

#include <cstdlib>
#include <sstream>
#include <vector>

#include <nlohmann/json.hpp>

#include "wire/errors.h"

namespace rcs::service {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kJobs = 50, kFrames = 24;              // that the page shows; of each job
constexpr std::uint64_t kLargestPicture = 16 << 20;  // as a thumbnail [bytes]
const Caller kViewer{"page", true};

/// "JOB_STATE_FAILED" as "failed".
std::string short_state(std::string name)
{
    name.erase(0, name.find("STATE_") + 6);
    for (char& c : name) c = c == '_' ? '-' : static_cast<char>(c - 'A' + 'a');
    return name;
}

bool shows(const v1::OutputFile& file) { return !file.name().ends_with(".exr") && file.size() <= kLargestPicture; }

Json frame_json(const v1::FrameStatus& frame, std::uint64_t job)
{
    Json json = {{"number", frame.number()},
                 {"state", short_state(v1::FrameState_Name(frame.state()))},
                 {"attempts", frame.attempts()},
                 {"seconds", frame.seconds()},
                 {"error_estimate", frame.error_estimate()},
                 {"reason", frame.error().message()},
                 {"warnings", Json::array()},
                 {"picture", ""}};
    for (const std::string& warning : frame.warnings()) json["warnings"].push_back(warning);
    for (const v1::OutputFile& file : frame.files()) {
        if (!shows(file)) continue;
        json["picture"] = "/picture/" + std::to_string(job) + "/" + std::to_string(frame.number()) + "/" + file.name();
        break;
    }
    return json;
}

Json progress_json(const v1::Progress& progress, std::uint64_t job)
{
    Json json = {{"frame", progress.frame()},
                 {"stage", progress.stage()},
                 {"fraction", progress.fraction()},
                 {"elapsed", progress.elapsed_seconds()}};
    if (progress.has_eta_seconds()) json["eta"] = progress.eta_seconds();
    if (progress.has_error_estimate()) json["error_estimate"] = progress.error_estimate();
    if (progress.preview_number() > 0) {
        json["preview"] = "/preview/" + std::to_string(job) + "/" + std::to_string(progress.frame()) + "?" +
                          std::to_string(progress.preview_number());
    }
    return json;
}

Json status_json(const Service& service)
{
    const v1::HealthReply health = service.health();
    Json json = {
        {"serving", health.serving()}, {"message", health.message()},       {"workers", health.workers()},
        {"busy", health.busy()},       {"waiting", health.queued_frames()}, {"uptime", health.uptime_seconds()},
        {"jobs", Json::array()}};
    v1::ListRequest list;
    list.set_limit(kJobs);
    const v1::ListReply jobs = service.queue().list(list, "");
    for (const v1::JobStatus& listed : jobs.jobs()) {
        const v1::JobStatus status = service.status(listed.job(), kViewer);
        Json job = {{"job", status.job()},
                    {"state", short_state(v1::JobState_Name(status.state()))},
                    {"scene", status.scene()},
                    {"owner", status.owner()},
                    {"priority", status.priority()},
                    {"submitted", status.submitted_ms()},
                    {"finished", status.finished_ms()},
                    {"frames", status.frames()},
                    {"completed", status.frames_completed()},
                    {"failed", status.frames_failed()},
                    {"reason", status.error().message()},
                    {"running", Json::array()},
                    {"shown", Json::array()}};
        for (const v1::Progress& progress : status.running())
            job["running"].push_back(progress_json(progress, status.job()));
        v1::JobRequest request;
        request.set_job(status.job());
        request.set_frames(kFrames);
        const v1::JobReply details = service.queue().details(request);
        for (const v1::FrameStatus& frame : details.frames()) job["shown"].push_back(frame_json(frame, status.job()));
        json["jobs"].push_back(job);
    }
    return json;
}

std::vector<std::string> parts_of(const std::string& path)
{
    std::vector<std::string> parts;
    std::istringstream text(path);
    for (std::string part; std::getline(text, part, '/');) parts.push_back(part);
    return parts;
}

HttpAnswer picture(const Service& service, std::uint64_t job, int frame, const std::string& name)
{
    v1::FetchRequest request;
    request.set_job(job);
    request.set_frame(frame);
    request.set_name(name);
    v1::FetchReply part = service.fetch(request, kViewer);
    if (!shows(part.file())) throw ServiceError(v1::ERROR_CODE_NOT_FOUND, "no picture to show");
    std::string bytes = part.data();
    while (bytes.size() < part.file().size() && !part.data().empty()) {
        request.set_offset(bytes.size());
        part = service.fetch(request, kViewer);
        bytes += part.data();
    }
    return {200, name.ends_with(".png") ? "image/png" : "image/jpeg", bytes};
}

}  // namespace

HttpAnswer page_answer(const Service& service, const std::string& path)
{
    try {
        const auto parts = parts_of(path);
        const auto number = [&](std::size_t i) { return std::strtoll(parts[i].c_str(), nullptr, 10); };
        if (path == "/") return {200, "text/html; charset=utf-8", status_page_sources().at("page.html")};
        if (path == "/status.json") {
            return {200, "application/json", status_json(service).dump(-1, ' ', false, Json::error_handler_t::replace)};
        }
        if (path == "/metrics") return {200, "text/plain; version=0.0.4", service.stats(true).prometheus()};
        if (parts.size() == 4 && parts[1] == "preview") {
            v1::PreviewRequest request;
            request.set_job(static_cast<std::uint64_t>(number(2)));
            request.set_frame(static_cast<int>(number(3)));
            return {200, "image/jpeg", service.preview(request, kViewer).jpeg()};
        }
        if (parts.size() == 5 && parts[1] == "picture") {
            return picture(service, static_cast<std::uint64_t>(number(2)), static_cast<int>(number(3)), parts[4]);
        }
        return {404, "text/plain", "there is nothing here\n"};
    } catch (const ServiceError& e) {
        return {e.code() == v1::ERROR_CODE_NOT_FOUND ? 404 : 500, "text/plain", std::string(e.what()) + "\n"};
    }
}

}  // namespace rcs::service
