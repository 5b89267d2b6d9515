#include "server/page.h"

#include <cstdlib>
#include <cstring>
#include <sstream>
#include <vector>

#include <nlohmann/json.hpp>

#include "wire/errors.h"

namespace rcs::service {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kJobs = 50, kFrames = 250;  // in an answer
const Caller kViewer{"page", true};

/// "JOB_STATE_FAILED" as "failed".
std::string short_state(std::string name)
{
    name.erase(0, name.find("STATE_") + 6);
    for (char& c : name) c = c == '_' ? '-' : static_cast<char>(c - 'A' + 'a');
    return name;
}

Json frame_json(const v1::FrameStatus& frame, std::uint64_t job)
{
    Json json = {{"number", frame.number()}, {"state", short_state(v1::FrameState_Name(frame.state()))}};
    if (frame.attempts() > 1) json["attempts"] = frame.attempts();
    if (frame.seconds() > 0.0) json["seconds"] = frame.seconds();
    if (frame.error_estimate() > 0.0) json["error"] = frame.error_estimate();
    if (frame.has_error()) json["reason"] = frame.error().message();
    for (const std::string& warning : frame.warnings()) json["warnings"].push_back(warning);
    const std::string place = std::to_string(job) + "/" + std::to_string(frame.number());
    if (frame.files_size() > 0) json["thumbnail"] = "/thumbnail/" + place;
    for (const v1::OutputFile& file : frame.files())
        json["files"].push_back({{"name", file.name()}, {"path", "/picture/" + place + "/" + file.name()}});
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

Json job_json(const v1::JobStatus& status)
{
    Json job = {{"job", status.job()},
                {"state", short_state(v1::JobState_Name(status.state()))},
                {"scene", status.scene()},
                {"owner", status.owner()},
                {"priority", status.priority()},
                {"submitted", status.submitted_ms()},
                {"started", status.started_ms()},
                {"finished", status.finished_ms()},
                {"frames", status.frames()},
                {"completed", status.frames_completed()},
                {"failed", status.frames_failed()},
                {"reason", status.error().message()},
                {"fraction", status.fraction()},
                {"labels", Json::object()},
                {"running", Json::array()}};
    if (status.has_eta_seconds()) job["eta"] = status.eta_seconds();
    if (status.has_error_estimate()) job["error_estimate"] = status.error_estimate();
    for (const std::uint64_t other : status.waits_for()) job["waits_for"].push_back(other);
    if (status.frames_delivered() > 0) job["delivered"] = status.frames_delivered();
    if (!status.delivery_error().empty()) job["delivery_error"] = status.delivery_error();
    for (const auto& [name, value] : status.labels()) job["labels"][name] = value;
    for (const v1::Progress& progress : status.running())
        job["running"].push_back(progress_json(progress, status.job()));
    return job;
}

/// @param before  only jobs with smaller numbers; 0: all
Json status_json(const Service& service, std::uint64_t before)
{
    const v1::HealthReply health = service.health();
    Json json = {
        {"serving", health.serving()}, {"message", health.message()},       {"workers", health.workers()},
        {"busy", health.busy()},       {"waiting", health.queued_frames()}, {"uptime", health.uptime_seconds()},
        {"seal", health.seal()},       {"paused", health.paused()},         {"jobs", Json::array()}};
    if (health.has_eta_seconds()) json["eta"] = health.eta_seconds();
    v1::ListRequest list;
    list.set_limit(kJobs);
    list.set_before(before);
    const v1::ListReply jobs = service.queue().list(list, "");
    for (const v1::JobStatus& listed : jobs.jobs())
        json["jobs"].push_back(job_json(service.status(listed.job(), kViewer)));
    json["more"] = jobs.more();
    return json;
}

Json frames_json(const Service& service, std::uint64_t job, std::uint32_t first)
{
    service.status(job, kViewer);  // it is there
    v1::JobRequest request;
    request.set_job(job);
    request.set_first_frame(first);
    request.set_frames(kFrames);
    Json json = {{"frames", Json::array()}};
    const v1::JobReply reply = service.queue().details(request);
    for (const v1::FrameStatus& frame : reply.frames()) json["frames"].push_back(frame_json(frame, job));
    return json;
}

std::vector<std::string> parts_of(const std::string& path)
{
    std::vector<std::string> parts;
    std::istringstream text(path);
    for (std::string part; std::getline(text, part, '/');) parts.push_back(part);
    return parts;
}

std::string media_type(const std::string& name)
{
    if (name.ends_with(".png")) return "image/png";
    return name.ends_with(".exr") ? "image/x-exr" : "image/jpeg";
}

/// @param name  of a picture; "": the small one that the frame's worker made
HttpAnswer picture(const Service& service, std::uint64_t job, int frame, const std::string& name)
{
    const std::string path = service.picture_path(job, frame, name);
    return {200, media_type(path), "", path};
}

/// The page is one file.
std::string page()
{
    const auto& sources = status_page_sources();
    std::string page = sources.at("page.html");
    for (const auto& [mark, name] : {std::pair("/*page.css*/", "page.css"), {"/*page.js*/", "page.js"}})
        page.replace(page.find(mark), std::strlen(mark), sources.at(name));
    return page;
}

}  // namespace

HttpAnswer page_answer(const Service& service, const std::string& path)
{
    try {
        const auto parts = parts_of(path);
        const auto number = [&](std::size_t i) { return std::strtoll(parts[i].c_str(), nullptr, 10); };
        if (path == "/") return {200, "text/html; charset=utf-8", page()};
        const auto json = [](const Json& value) -> HttpAnswer {
            return {200, "application/json", value.dump(-1, ' ', false, Json::error_handler_t::replace)};
        };
        if (parts.size() >= 2 && parts[1] == "status.json")
            return json(status_json(service, parts.size() == 3 ? static_cast<std::uint64_t>(number(2)) : 0));
        if (parts.size() == 4 && parts[1] == "frames")
            return json(
                frames_json(service, static_cast<std::uint64_t>(number(2)), static_cast<std::uint32_t>(number(3))));
        if (path == "/metrics") return {200, "text/plain; version=0.0.4", service.stats(true).prometheus()};
        if (parts.size() == 4 && parts[1] == "preview") {
            v1::PreviewRequest request;
            request.set_job(static_cast<std::uint64_t>(number(2)));
            request.set_frame(static_cast<int>(number(3)));
            return {200, "image/jpeg", service.preview(request, kViewer).jpeg()};
        }
        if (parts.size() == 4 && parts[1] == "thumbnail")
            return picture(service, static_cast<std::uint64_t>(number(2)), static_cast<int>(number(3)), "");
        if (parts.size() == 5 && parts[1] == "picture")
            return picture(service, static_cast<std::uint64_t>(number(2)), static_cast<int>(number(3)), parts[4]);
        return {404, "text/plain", "there is nothing here\n"};
    } catch (const ServiceError& e) {
        return {e.code() == v1::ERROR_CODE_NOT_FOUND ? 404 : 500, "text/plain", std::string(e.what()) + "\n"};
    }
}

}  // namespace rcs::service
