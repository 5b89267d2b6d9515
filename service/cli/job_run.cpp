#include "cli/job_run.h"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <regex>
#include <set>

#include "rcs/error.h"
#include "wire/errors.h"

namespace rcs::service {
namespace {

constexpr std::size_t kMostFrames = 10'000;  // of a job

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

v1::JobStatus follow(Client& client, std::uint64_t job, ProgressBar& bar)
{
    const v1::JobStatus end = client.watch(job, [&](const v1::JobStatus& status) {
        if (status.running_size() > 0) {
            bar.show(status.running(0).stage(), status.running(0).stage_fraction());
        } else if (status.state() == v1::JOB_STATE_QUEUED) {
            bar.show("queued", 0.0f);
        }
    });
    bar.finish();
    if (end.state() == v1::JOB_STATE_CANCELLED) {
        throw ServiceError(v1::ERROR_CODE_CANCELLED, "job " + std::to_string(job) + " was cancelled");
    }
    if (end.state() == v1::JOB_STATE_FAILED) throw ServiceError(end.error().code(), end.error().message());
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

bool has_frame_pattern(const std::string& path) { return path.find('#') != path.npos; }

std::string path_of_frame(const std::string& pattern, int number)
{
    const std::size_t begin = pattern.find('#');
    if (begin == pattern.npos) return pattern;
    const std::size_t end = std::min(pattern.find_first_not_of('#', begin), pattern.size());
    std::string digits = std::to_string(std::abs(number));
    digits.insert(0, end - begin > digits.size() ? end - begin - digits.size() : 0, '0');
    return pattern.substr(0, begin) + (number < 0 ? "-" : "") + digits + pattern.substr(end);
}

std::vector<int> parse_frames(const std::string& text)
{
    static const std::regex part(R"(^(-?\d{1,7})(?:(?:-|\.\.)(-?\d{1,7})(?:[x:](\d{1,7}))?)?$)");
    const auto refuse = [&](const std::string& why) {
        throw Error(ErrorCode::bad_argument, "--frames " + text + " " + why);
    };
    std::set<int> frames;
    for (std::size_t begin = 0; begin <= text.size();) {
        const std::size_t end = std::min(text.find(',', begin), text.size());
        std::smatch found;
        const std::string one = text.substr(begin, end - begin);
        if (!std::regex_match(one, found, part)) refuse("is no list of frames such as 1-100x2,150");
        const int first = std::stoi(found[1]);
        const int last = found[2].matched ? std::stoi(found[2]) : first;
        const int step = found[3].matched ? std::stoi(found[3]) : 1;
        if (last < first || step < 1) refuse("has a range that runs backwards, or a step of 0");
        for (int i = first; i <= last; i += step) {
            if (!frames.insert(i).second) refuse("has frame " + std::to_string(i) + " twice");
            if (frames.size() > kMostFrames) refuse("has more than 10000 frames");
        }
        begin = end + 1;
    }
    return {frames.begin(), frames.end()};
}

std::string state_text(v1::JobState state) { return lower_name(v1::JobState_Name(state), "JOB_STATE_"); }
std::string state_text(v1::FrameState state) { return lower_name(v1::FrameState_Name(state), "FRAME_STATE_"); }

}  // namespace rcs::service
