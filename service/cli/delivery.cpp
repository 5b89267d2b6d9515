#include "cli/delivery.h"

#include <filesystem>
#include <utility>
#include <vector>

#include "batch/delivered_name.h"
#include "batch/frames.h"
#include "cli/job_run.h"
#include "process/printable.h"
#include "rcs/error.h"

namespace rcs::service {
namespace {

constexpr std::size_t kMostHoles = 20;  // that are named

}  // namespace

Delivery::Delivery(Client& client, std::uint64_t job, std::map<std::string, std::string> patterns,
                   std::function<void(const std::string&)> written, std::function<void(const std::string&)> warned)
    : client_(client),
      job_(job),
      patterns_(std::move(patterns)),
      written_(std::move(written)),
      warned_(std::move(warned))
{
}

void Delivery::take(const v1::FrameStatus& frame)
{
    if (frame.state() != v1::FRAME_STATE_COMPLETED || !taken_.insert(frame.number()).second) return;
    for (const v1::OutputFile& file : frame.files()) {
        const auto pattern = patterns_.find(file.name());
        if (pattern == patterns_.end()) continue;
        const std::string path = path_of_frame(pattern->second, frame.number());
        client_.fetch(job_, frame.number(), file.name(), path);
        written_(path);
    }
    for (const std::string& warning : frame.warnings()) warned_(warning);
}

void Delivery::take_new()
{
    for_each_ended(client_, job_, first_open_, [&](std::uint32_t, const v1::FrameStatus& frame) { take(frame); });
}

std::string Delivery::take_all(std::optional<int> only)
{
    std::string holes;
    std::size_t missing = 0, all = 0;
    for_each_frame(client_, job_, [&](const v1::FrameStatus& frame) {
        if (only && frame.number() != *only) return;
        ++all;
        take(frame);
        if (frame.state() == v1::FRAME_STATE_COMPLETED || ++missing > kMostHoles) return;
        holes.append(missing > 1 ? "; " : "").append("frame ").append(std::to_string(frame.number())).append(" ");
        holes.append(state_text(frame.state()));
        if (frame.has_error()) holes.append(": ").append(printable(frame.error().message()));
    });
    if (missing == 0 && all > 0) return "";
    const std::string job = "job " + std::to_string(job_);
    if (all == 0) throw Error(ErrorCode::not_found, job + " has no frame " + std::to_string(only.value_or(0)));
    if (missing > kMostHoles) holes += "; and " + std::to_string(missing - kMostHoles) + " more";
    return job + ", " + std::to_string(missing) + " of " + std::to_string(all) +
           (all == 1 ? " frame has" : " frames have") + " no pictures: " + holes;
}

std::string path_of_output(const std::string& folder, const v1::Output& output, int frames)
{
    // What a server says is not trusted with other folders.
    return (std::filesystem::path(folder) / delivered_name(output.file_name(), output.name(), frames)).string();
}

}  // namespace rcs::service
