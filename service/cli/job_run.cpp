#include "cli/job_run.h"

#include <cctype>
#include <cstdio>

#include "process/printable.h"
#include "rcs/error.h"
#include "wire/errors.h"

namespace rcs::service {
namespace {

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
    const v1::JobStatus end = client.watch(job, [&](const v1::JobStatus& status) {
        if (status.running_size() > 0) {
            bar.show(printable(status.running(0).stage()), status.running(0).stage_fraction());
        } else if (status.state() == v1::JOB_STATE_QUEUED) {
            bar.show("queued", 0.0f);
        }
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

std::string state_text(v1::JobState state) { return lower_name(v1::JobState_Name(state), "JOB_STATE_"); }
std::string state_text(v1::FrameState state) { return lower_name(v1::FrameState_Name(state), "FRAME_STATE_"); }

}  // namespace rcs::service
