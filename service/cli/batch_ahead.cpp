#include "cli/batch_ahead.h"

#include <algorithm>
#include <span>
#include <string>

#include "rcs/error.h"

namespace rcs::service {
namespace {

// So many: records that twice as many views have not needed are dropped.
constexpr std::size_t kAtATime = 120;

}  // namespace

FramesAhead::FramesAhead(const BatchArguments& arguments, bool is_animated, const std::vector<int>& all)
    : at_a_time_(arguments.task.kind == TaskKind::overture ? all.size() : kAtATime)
{
    // A part with records begins with what its overture has seen.
    const bool is_part = arguments.task.kind == TaskKind::part;
    if (is_animated || (is_part && !arguments.records_file.empty())) return;
    numbers_ = is_part ? frames_of(arguments.task, all) : all;
}

void FramesAhead::look(Session& session, int number, const RenderOptions& options,
                       const std::function<Camera(int)>& camera_of, const std::function<bool(int)>& killed,
                       const RenderHooks& hooks)
{
    const auto here = std::lower_bound(numbers_.begin(), numbers_.end(), number);
    if (here == numbers_.end()) return;
    const std::size_t part = static_cast<std::size_t>(here - numbers_.begin()) / at_a_time_;
    if (known_ == part) return;
    known_ = part;
    const std::size_t first = part * at_a_time_;
    const auto frames = std::span(numbers_).subspan(first, std::min(at_a_time_, numbers_.size() - first));
    if (std::any_of(frames.begin(), frames.end(), killed)) return;
    std::vector<Camera> cameras;
    for (const int frame : frames) {
        try {
            cameras.push_back(camera_of(frame));
        } catch (const Error&) {  // that frame will fail
        }
    }
    AheadStats found;
    try {
        found = walk_ahead(session, cameras, options, hooks);
    } catch (const Error& e) {
        if (e.code() == ErrorCode::cancelled) throw;
        if (hooks.log) hooks.log(LogLevel::info, std::string("no records are placed beforehand: ") + e.what());
    }
    if (found.views > 0 && hooks.log)
        hooks.log(LogLevel::info, std::to_string(found.records) + " records placed beforehand, in " +
                                      std::to_string(found.views) + " of the views of frames " +
                                      std::to_string(frames.front()) + " to " + std::to_string(frames.back()));
}

}  // namespace rcs::service
