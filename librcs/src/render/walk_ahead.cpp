#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "rcs/option_table.h"
#include "rcs/render.h"
#include "render/frame.h"
#include "render/light_search.h"
#include "render/upkeep.h"

namespace rcs {
namespace {

// Between views that are so near to each other in number none is looked at: what a picture finds missing, it places
// itself: in Sponza's walk some 100 records a frame, of 20,000 in view (docs/method.md, Views to come).
constexpr std::size_t kNear = 4;
// Where a view has come to need so few new records [of those in it], and to shoot so few rays [of its records'], those
// between it and its neighbours need no more.
constexpr double kFewNew = 0.01;

/// What a look at a view came to.
struct ViewLook {
    double fresh = 0.0;          // part of the view's records that is new, or of their rays, if that is more
    bool gathers_lamps = false;  // with their light
};

/// New records on what has just moved: the next scene has others.
std::uint64_t of_things_in_motion(const Frame& f)
{
    const SceneStates states = f.session.state().states();
    const std::span<const std::uint32_t> moving = states.in_motion();
    return static_cast<std::uint64_t>(std::count_if(f.records.begin(), f.records.end(), [&](const Record& r) {
        return r.watch.seen.empty() && r.watch.state != states.now &&
               std::binary_search(moving.begin(), moving.end(), r.watch.instance);
    }));
}

/// Rays that made records in view less noisy, over all that they have.
double part_of_refining(const std::vector<Record>& records, const RecordStats& made)
{
    const double all = std::accumulate(records.begin(), records.end(), 0.0,
                                       [](double sum, const Record& r) { return sum + static_cast<double>(r.rays); });
    return all > 0.0 ? static_cast<double>(made.refining_rays) / all : 0.0;
}

ViewLook look_at_view(Session& session, const Camera& camera, const RenderOptions& options, const RenderHooks& hooks,
                      AheadStats& stats)
{
    Frame frame = begin_frame(session, camera, options, hooks);
    std::uint64_t passing = 0;
    try {
        if (frame.needs(Effect::indirect_diffuse) && begin_pass(frame)) {
            draw_gbuffer(frame);
            spread_bounces(frame);
            if (frame.settings.has_lamps) timed(frame, "lamps", [&] { part_lamps(frame); });
            look_around(frame);
            place_plain_records(frame);
            passing = of_things_in_motion(frame);
            watch_records(frame);
        }
    } catch (...) {
        give_back(frame);
        throw;
    }
    const RecordStats& made = frame.stats().records;
    double part = static_cast<double>(made.records - std::min(made.records, passing)) /
                  static_cast<double>(std::max<std::size_t>(1, frame.records.size()));
    // A goal makes those better that are there.
    if (has_goal(options)) part = std::max(part, part_of_refining(frame.records, made));
    ++stats.views;
    stats.records += made.records;
    stats.error = std::max(stats.error, frame.stats().forecast.settled_error);
    // It is no view: what those before it have is no older for it.
    const std::uint32_t view_number = session.state().view_number;
    const bool gathers_lamps = frame.gathered.any();
    hand_over(frame);
    session.state().end_view();
    session.state().view_number = view_number;
    return {part, gathers_lamps};
}

}  // namespace

AheadStats walk_ahead(Session& session, std::size_t views, const CameraFunction& camera_of, const RenderOptions& asked,
                      const RenderHooks& hooks)
{
    AheadStats stats;
    if (!session.state().options.keep_records) return stats;
    RenderOptions options = asked;
    options.aa = 1;
    options.denoise = Denoiser::none;
    options.f_stop = options.focus = std::nullopt;
    options.layers.emplace();
    options.motion = std::nullopt;
    const RenderHooks quiet{.progress = hooks.progress};
    std::map<std::size_t, std::optional<Camera>> cameras;
    const auto camera_at = [&](std::size_t i) {
        const auto [known, is_new] = cameras.try_emplace(i);
        if (is_new) known->second = camera_of(i);
        return known->second;
    };
    const auto look = [&](std::size_t i) {
        const std::optional<Camera> camera = camera_at(i);
        return camera ? look_at_view(session, *camera, options, quiet, stats) : ViewLook{.fresh = 1.0};
    };
    if (views < 2) return stats;
    const std::size_t end = views - 1;
    if (const auto first = camera_at(0); first == camera_at(end) && first == camera_at(end / 2)) {
        if (has_goal(asked)) look(0);  // the first view alone would pay for what all are to show
        return stats;
    }
    // Another view may gather the light of other lamps, and could not use those records.
    if (look(0).gathers_lamps || look(end).gathers_lamps) return stats;
    // Kept or dropped, more would push out what is there.
    const auto is_full = [&] {
        const std::size_t records = std::max<std::size_t>(session.records().size(), stats.records);
        return 2 * records > session.state().options.most_records;
    };
    std::vector<std::pair<std::size_t, std::size_t>> between{{0, end}};
    while (!between.empty() && !is_full()) {
        const auto [first, last] = between.back();
        between.pop_back();
        if (last - first <= kNear) continue;
        const std::size_t middle = first + (last - first) / 2;
        if (look(middle).fresh <= kFewNew) continue;
        between.emplace_back(middle, last);
        between.emplace_back(first, middle);
    }
    return stats;
}

}  // namespace rcs
