#include <algorithm>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "rcs/option_table.h"
#include "rcs/render.h"
#include "render/frame.h"
#include "render/light_search.h"

namespace rcs {
namespace {

// Views that are so near to each other in number are not looked at one by one: what the next picture finds missing, it
// places itself.
constexpr std::size_t kNear = 4;
// Where a view has come to need so few new records [of those in it], those between it and its neighbours need no more.
constexpr double kFewNew = 0.01;

/// @return part of the view's records that is new
double look_at_view(Session& session, const Camera& camera, const RenderOptions& options, const RenderHooks& hooks,
                    AheadStats& stats)
{
    Frame frame = begin_frame(session, camera, options, hooks);
    try {
        if (frame.needs(Effect::indirect_diffuse) && begin_pass(frame)) {
            draw_gbuffer(frame);
            spread_bounces(frame);
            if (frame.settings.has_lamps) timed(frame, "lamps", [&] { part_lamps(frame); });
            look_around(frame);
            place_plain_records(frame);
        }
    } catch (...) {
        give_back(frame);
        throw;
    }
    const RecordStats& made = frame.stats().records;
    const double part =
        static_cast<double>(made.records) / static_cast<double>(std::max<std::size_t>(1, frame.records.size()));
    ++stats.views;
    stats.records += made.records;
    hand_over(frame);
    session.state().end_view();
    return part;
}

}  // namespace

AheadStats walk_ahead(Session& session, std::span<const Camera> cameras, const RenderOptions& asked,
                      const RenderHooks& hooks)
{
    AheadStats stats;
    if (!session.state().options.keep_records || has_goal(asked)) return stats;
    RenderOptions options = asked;
    options.aa = 1;
    options.denoise = Denoiser::none;
    options.f_stop = options.focus = std::nullopt;
    options.layers.emplace();
    options.motion = std::nullopt;
    const auto look = [&](std::size_t i) { return look_at_view(session, cameras[i], options, hooks, stats); };
    if (std::adjacent_find(cameras.begin(), cameras.end(), std::not_equal_to<>()) == cameras.end()) return stats;
    look(0);
    look(cameras.size() - 1);
    std::vector<std::pair<std::size_t, std::size_t>> between{{0, cameras.size() - 1}};
    while (!between.empty()) {
        const auto [first, last] = between.back();
        between.pop_back();
        if (last - first <= kNear) continue;
        const std::size_t middle = first + (last - first) / 2;
        if (look(middle) <= kFewNew) continue;
        between.emplace_back(middle, last);
        between.emplace_back(first, middle);
    }
    return stats;
}

}  // namespace rcs
