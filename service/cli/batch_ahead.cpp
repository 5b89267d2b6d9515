#include "cli/batch_ahead.h"

#include <algorithm>
#include <chrono>
#include <span>
#include <string>
#include <utility>

#include "cli/batch_settings.h"
#include "rcs/error.h"

namespace rcs::service {
namespace {

// So many: records that twice as many views have not needed are dropped.
constexpr std::size_t kAtATime = 120;
// ... where the scene moves: what happens until then changes the light of what is placed beforehand.
constexpr std::size_t kAtATimeInMotion = 24;

}  // namespace

FramesAhead::FramesAhead(const BatchArguments& arguments, bool is_animated, const std::vector<int>& all)
    : at_a_time_(is_animated                                 ? kAtATimeInMotion
                 : arguments.task.kind == TaskKind::overture ? all.size()
                                                             : kAtATime)
{
    if (!keeps_records(arguments, is_animated)) return;
    // A part with records begins with what its overture has seen: all of it where the scene stands still.
    const bool is_part = arguments.task.kind == TaskKind::part;
    if (is_part && !is_animated && !arguments.records_file.empty()) return;
    // Where it moves, an overture makes frames that lie far apart, and each moment of a shutter is a scene to follow.
    if (is_animated && (arguments.task.kind == TaskKind::overture || arguments.shutter.blurs())) return;
    numbers_ = is_part ? frames_of(arguments.task, all) : all;
}

std::span<const int> FramesAhead::part_of(int number) const
{
    const auto here = std::lower_bound(numbers_.begin(), numbers_.end(), number);
    if (here == numbers_.end()) return {};
    const std::size_t first = static_cast<std::size_t>(here - numbers_.begin()) / at_a_time_ * at_a_time_;
    return std::span(numbers_).subspan(first, std::min(at_a_time_, numbers_.size() - first));
}

AheadStats FramesAhead::look(Session& session, int number, const RenderOptions& options,
                             const std::function<Camera(int)>& camera_of, const std::function<bool(int)>& killed,
                             const RenderHooks& hooks)
{
    if (!is_new(number)) return {};
    std::span<const int> frames = part_of(number);
    known_ = frames.front();
    if (std::any_of(frames.begin(), frames.end(), killed)) return {};
    if (std::exchange(is_again_, false))
        frames = {std::lower_bound(frames.begin(), frames.end(), number), frames.end()};
    const auto camera = [&](std::size_t i) -> std::optional<Camera> {
        try {
            return camera_of(frames[i]);
        } catch (const Error&) {
            return std::nullopt;  // that frame will fail
        }
    };
    using Clock = std::chrono::steady_clock;
    const Clock::time_point began = Clock::now();
    const auto count = [&] { seconds_ += std::chrono::duration<double>(Clock::now() - began).count(); };
    AheadStats found;
    try {
        found = walk_ahead(session, frames.size(), camera, options, hooks);
        if (found.views > 0) count();
    } catch (const Error& e) {
        count();
        if (e.code() == ErrorCode::cancelled) throw;
        session.forget_light();  // it may be half up to date
        if (hooks.log) hooks.log(LogLevel::info, std::string("no records are placed beforehand: ") + e.what());
    }
    if (found.views > 0 && hooks.log)
        hooks.log(LogLevel::info, std::to_string(found.records) + " records placed beforehand, in " +
                                      std::to_string(found.views) + " of the views of frames " +
                                      std::to_string(frames.front()) + " to " + std::to_string(frames.back()));
    return found;
}

}  // namespace rcs::service
