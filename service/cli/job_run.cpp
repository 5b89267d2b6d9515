#include "cli/job_run.h"

#include <cctype>
#include <cstdio>

#include <nlohmann/json.hpp>

#include "process/printable.h"
#include "rcs/error.h"
#include "rcs/version.h"
#include "report/encoding.h"
#include "wire/errors.h"

namespace rcs::service {
namespace {

constexpr std::uint32_t kPage = 500;  // frames that are asked for at a time

bool has_ended(v1::FrameState state)
{
    return state == v1::FRAME_STATE_COMPLETED || state == v1::FRAME_STATE_FAILED || state == v1::FRAME_STATE_CANCELLED;
}

std::string lower_name(std::string name, const std::string& prefix)
{
    if (name.starts_with(prefix)) name.erase(0, prefix.size());
    for (char& c : name) c = c == '_' ? '-' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return name;
}

}  // namespace

v1::SubmitReply submit(Client& client, const RequestedJob& requested, ProgressBar& bar)
{
    if (!requested.uploads.empty()) {
        bar.show("upload", 0.0f);
        client.upload(requested.uploads, [&](float fraction) { bar.show("upload", fraction); });
    }
    return client.submit(requested.job);
}

v1::JobStatus follow(Client& client, std::uint64_t job, ProgressBar& bar,
                     const std::function<void(const v1::JobStatus&)>& news)
{
    const std::string name = "job " + std::to_string(job);
    const v1::JobStatus end = client.watch(job, [&](const v1::JobStatus& status) {
        bar.show(name, static_cast<float>(status.fraction()), progress_text(status));
        if (news) news(status);
    });
    bar.finish();
    return end;
}

void for_each_frame(Client& client, std::uint64_t job, const std::function<void(const v1::FrameStatus&)>& use)
{
    for (std::uint32_t first = 0;;) {
        const v1::JobReply reply = client.details(job, first);
        if (reply.frames_size() == 0) return;
        for (const v1::FrameStatus& frame : reply.frames()) use(frame);
        first += static_cast<std::uint32_t>(reply.frames_size());
    }
}

void for_each_ended(Client& client, std::uint64_t job, std::uint32_t& first_open,
                    const std::function<void(std::uint32_t, const v1::FrameStatus&)>& use)
{
    for (std::uint32_t index = first_open;;) {
        const v1::JobReply reply = client.details(job, index, kPage);
        bool any = false;
        for (const v1::FrameStatus& frame : reply.frames()) {
            const bool ended = has_ended(frame.state());
            if (ended) use(index, frame);
            any = any || ended;
            if (index == first_open && ended) ++first_open;
            ++index;
        }
        if (!any) return;  // frames are begun in their order
    }
}

std::string progress_text(const v1::JobStatus& status)
{
    std::string text = state_text(status.state());
    if (status.frames() > 1) {
        text += ", " + std::to_string(status.frames_completed()) + " of " + std::to_string(status.frames()) + " frames";
    } else if (status.running_size() > 0) {
        text = printable(status.running(0).stage());
    }
    if (status.frames_failed() > 0) text += ", " + std::to_string(status.frames_failed()) + " failed";
    const bool first = !status.has_error_estimate() && status.running_size() > 0;
    if (first && status.running(0).has_error_estimate())
        text += ", error " + percent_text(status.running(0).error_estimate());
    if (status.has_error_estimate()) text += ", error " + percent_text(status.error_estimate());
    if (status.has_eta_seconds()) text += ", about " + duration_text(status.eta_seconds()) + " to go";
    return text;
}

std::string state_text(v1::JobState state) { return lower_name(v1::JobState_Name(state), "JOB_STATE_"); }
std::string state_text(v1::FrameState state) { return lower_name(v1::FrameState_Name(state), "FRAME_STATE_"); }

void print_job_json(const std::string& command, std::uint64_t job, const nlohmann::ordered_json& what)
{
    nlohmann::ordered_json json{{"version", kVersion}, {"command", command}, {"job", job}};
    json.update(what);
    std::printf("%s\n", json.dump(2).c_str());
}

}  // namespace rcs::service
