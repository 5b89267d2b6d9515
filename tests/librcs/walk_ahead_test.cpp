// Records placed for views to come.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <numeric>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "rcs/rcs.h"
#include "session/session_state.h"

namespace rcs {
namespace {

constexpr int kViews = 13;

RenderOptions small_options()
{
    RenderOptions options;
    options.width = 120, options.height = 90;
    options.aa = 1;
    return options;
}

Session atrium(bool keeps = true)
{
    Session session({.keep_records = keeps});
    session.show(load_scene("demo:atrium"));
    return session;
}

Scene atrium_at(double time)
{
    SceneChoice choice;
    choice.source = "demo:atrium";
    choice.time = time;
    return load_scene(choice);
}

/// On a way through the hall, at its end much nearer to what it looks at.
std::vector<Camera> way(const Session& session)
{
    const Camera begin = choose_camera(session.scene(), {});
    std::vector<Camera> cameras(kViews, begin);
    for (int i = 0; i < kViews; ++i) {
        const double part = i / static_cast<double>(kViews - 1);
        cameras[static_cast<std::size_t>(i)].world_from_view[3] +=
            part * (1.5 * begin.world_from_view[0] - 3.0 * begin.world_from_view[2]);
    }
    return cameras;
}

AheadStats ahead_of(Session& session, const std::vector<Camera>& cameras, const RenderOptions& options,
                    const RenderHooks& hooks = {})
{
    const auto camera_of = [&](std::size_t i) -> std::optional<Camera> { return cameras[i]; };
    return walk_ahead(session, cameras.size(), camera_of, options, hooks);
}

struct Walked {
    std::uint64_t made = 0;
    double changed = 0.0;  ///< of the first view's indirect light, by the views after it
};

Walked walk(Session& session)
{
    Walked walked;
    std::vector<Image> first;
    std::vector<Camera> cameras = way(session);
    cameras.push_back(cameras.front());
    for (const Camera& camera : cameras) {
        RenderResult result = render(session, camera, small_options());
        walked.made += result.stats.records.records;
        if (camera == cameras.front()) first.push_back(std::move(result.image.layers.at("indirect")));
    }
    double all = 0.0;
    for (std::size_t i = 0; i < first[0].pixels.size(); ++i) {
        walked.changed += static_cast<double>(std::abs(first[1].pixels[i] - first[0].pixels[i]));
        all += static_cast<double>(first[0].pixels[i]);
    }
    walked.changed /= all;
    return walked;
}

TEST(WalkAhead, WhatAViewShowsHangsLittleOnThoseAfterIt)
{
    Session plain = atrium(), prepared = atrium();
    const AheadStats ahead = ahead_of(prepared, way(prepared), small_options());
    EXPECT_EQ(ahead.views, 5) << "the ends, the middle, and between those";
    EXPECT_EQ(ahead.records, prepared.records().size());
    const Walked before = walk(plain), after = walk(prepared);
    EXPECT_LT(after.made, before.made / 4);
    EXPECT_LT(after.changed, before.changed / 2.0);
    EXPECT_GT(before.changed, 0.005) << "the others do bring records that this view sees";
    EXPECT_LT(static_cast<double>(ahead.records + after.made), 1.3 * static_cast<double>(before.made));
}

RenderOptions aimed_at(double error)
{
    RenderOptions options = small_options();
    options.quality = TargetError{error};
    return options;
}

/// Of the views of a way, made one after the other.
struct Aimed {
    double worst = 0.0, mean = 0.0;  ///< estimated errors of indirect light
    std::uint64_t rays = 0;
    std::vector<std::vector<float>> pictures;
};

Aimed walk_to_goal(Session& session, double error)
{
    Aimed aimed;
    for (const Camera& camera : way(session)) {
        const RenderResult result = render(session, camera, aimed_at(error));
        aimed.worst = std::max(aimed.worst, result.stats.errors.indirect.mean_relative);
        aimed.mean += result.stats.errors.indirect.mean_relative / kViews;
        aimed.rays += result.stats.records.hemisphere_rays + result.stats.records.looks;
        aimed.pictures.push_back(result.image.layers.at("indirect").pixels);
    }
    return aimed;
}

TEST(WalkAhead, BringsRecordsToATargetThatAllViewsThenKeep)
{
    constexpr double kTarget = 0.08;
    Session apart = atrium(false), prepared = atrium();
    const AheadStats ahead = ahead_of(prepared, way(prepared), aimed_at(kTarget));
    EXPECT_GT(ahead.views, 2);
    EXPECT_GT(ahead.error, 0.5 * kTarget);
    EXPECT_LT(ahead.error, kTarget);
    const Aimed alone = walk_to_goal(apart, kTarget), after = walk_to_goal(prepared, kTarget);
    EXPECT_LT(alone.worst, 1.15 * kTarget);
    EXPECT_LT(after.worst, 1.15 * kTarget);
    EXPECT_LT(static_cast<double>(after.rays), 0.25 * static_cast<double>(alone.rays));
}

TEST(WalkAhead, ToATargetGivesTheSameBitsForAnyNumberOfThreads)
{
    const auto with = [](int threads) {
        Session session({.threads = threads, .keep_records = true});
        session.show(load_scene("demo:atrium"));
        ahead_of(session, way(session), aimed_at(0.08));
        return walk_to_goal(session, 0.08).pictures;
    };
    EXPECT_EQ(with(1), with(3));
}

TEST(WalkAhead, LetsASmallerTargetRefineWhatALargerOneLeft)
{
    Session session = atrium();
    ahead_of(session, way(session), aimed_at(0.12));
    const Aimed coarse = walk_to_goal(session, 0.12), fine = walk_to_goal(session, 0.05);
    EXPECT_GT(coarse.worst, 0.05);
    EXPECT_LT(fine.mean, 0.05);
    EXPECT_LT(fine.worst, 1.4 * 0.05) << "in a view whose records cannot come closer";
}

TEST(WalkAhead, ByABudgetTakesAsLongForALookAsAPictureMay)
{
    Session hurried = atrium(), patient = atrium();
    RenderOptions options = small_options();
    const auto rays_in = [&](Session& session, double seconds) {
        options.quality = Budget{seconds};
        EXPECT_GT(ahead_of(session, way(session), options).views, 2);
        return std::accumulate(session.records().begin(), session.records().end(), 0.0,
                               [](double sum, const Record& r) { return sum + r.rays; });
    };
    EXPECT_GT(rays_in(patient, 1.0), 2.0 * rays_in(hurried, 0.1));
}

// Hardly a record is missing the third time: the views between are looked at all the same.
TEST(WalkAhead, ByAnotherBudgetMakesAllViewsBetter)
{
    Session session = atrium();
    RenderOptions options = small_options();
    options.quality = Budget{0.1};
    const AheadStats first = ahead_of(session, way(session), options);
    options.quality = Budget{0.5};
    ahead_of(session, way(session), options);
    const AheadStats third = ahead_of(session, way(session), options);
    EXPECT_EQ(third.views, 5) << "the ends, the middle, and between those";
    EXPECT_LT(third.error, 0.9 * first.error);
}

TEST(WalkAhead, DoesNothingWhereNothingWouldCome)
{
    Session session = atrium(), forgetful = atrium(false);
    const std::vector<Camera> cameras = way(session);
    EXPECT_EQ(ahead_of(session, std::vector<Camera>(4, cameras[0]), small_options()).views, 0);
    EXPECT_EQ(ahead_of(session, {}, small_options()).views, 0);
    EXPECT_EQ(ahead_of(forgetful, cameras, small_options()).views, 0);
    EXPECT_TRUE(session.records().empty());
}

TEST(WalkAhead, KeepsWhatItHasWhenItIsCalledOff)
{
    Session session = atrium();
    const std::vector<Camera> cameras = way(session);
    ahead_of(session, std::vector<Camera>{cameras[0], cameras[kViews - 1]}, small_options());
    const std::size_t records = session.records().size();
    const auto never = [](std::string_view stage, float part) { return stage != "records" || part == 0.0f; };
    try {
        ahead_of(session, cameras, small_options(), {.progress = never});
        ADD_FAILURE() << "it was not called off";
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), ErrorCode::cancelled);
    }
    EXPECT_GE(session.records().size(), records);
    EXPECT_LT(render(session, cameras[0], small_options()).stats.records.records, records / 10);
}

TEST(WalkAhead, StopsBeforeRecordsWouldBeDropped)
{
    Session session({.keep_records = true, .most_records = 2000});
    session.show(load_scene("demo:atrium"));
    const AheadStats ahead = ahead_of(session, way(session), small_options());
    EXPECT_EQ(ahead.views, 2);
    EXPECT_LE(session.records().size(), 2000u);
}

TEST(WalkAhead, PlacesWhatFollowsASceneThatMoves)
{
    Session session({.keep_records = true, .watch_records = true});
    session.show(atrium_at(0.1));
    const std::vector<Camera> cameras = way(session);
    ahead_of(session, cameras, small_options());
    session.show(atrium_at(0.2));
    const RecordStats last = render(session, cameras[kViews - 1], small_options()).stats.records;
    EXPECT_GT(last.watched, 500u);
    EXPECT_LT(last.records + last.renewed, last.watched / 4);
}

/// Views ahead look at no contacts; the next that shows some looks at those alone, and knows which hold another light.
TEST(WalkAhead, KeepsGathersAtContactsWhoseLightHasChanged)
{
    Session session({.keep_records = true, .watch_records = true});
    session.show(atrium_at(0.9));
    const std::vector<Camera> cameras = way(session);
    constexpr int kMany = 14;  // more views than contacts outlive unseen
    for (int view = 0; view < kMany; ++view) render(session, cameras[0], small_options());
    const std::vector<Record>& contacts = session.state().contacts;
    const auto count = [&](const auto& is) { return std::count_if(contacts.begin(), contacts.end(), is); };
    const auto is_shown = [](const Record& r) { return r.watch.is_shown; };
    const auto is_behind = [&](const Record& r) { return r.watch.state != session.state().scene_number; };
    const std::ptrdiff_t before = count([](const Record&) { return true; });
    ASSERT_GT(before, 100);
    EXPECT_EQ(count(is_shown), before);
    session.show(atrium_at(1.2));  // the lamp is on
    ahead_of(session, cameras, small_options());
    EXPECT_GT(std::ssize(contacts), before * 3 / 4);
    EXPECT_EQ(count(is_behind), std::ssize(contacts));

    RenderHooks until_splats;
    until_splats.progress = [](std::string_view stage, float) { return stage != "splat"; };
    EXPECT_THROW(render(session, cameras[0], small_options(), until_splats), Error);
    EXPECT_LT(count(is_behind), before / 20) << "none but those that lie in one place with another";
    EXPECT_LT(count(is_shown), std::ssize(contacts)) << "some see the lamp";
    EXPECT_GT(count(is_shown), 0) << "some do not";

    Camera turned = cameras[0];
    turned.world_from_view[2] = -turned.world_from_view[2], turned.world_from_view[0] = -turned.world_from_view[0];
    session.show(atrium_at(1.3));
    render(session, turned, small_options());
    EXPECT_GT(count(is_behind), before / 2) << "it sees none of them";
}

TEST(WalkAhead, TakesNothingFromWhatViewsBeforeItHave)
{
    Session session = atrium();
    const std::vector<Camera> cameras = way(session);
    const auto rays_at_contacts = [&] { return render(session, cameras[0], small_options()).stats.contact_rays; };
    EXPECT_GT(rays_at_contacts(), 0u);
    for (int i = 0; i < 4; ++i)  // twenty looks: contacts are forgotten after twelve views
        ahead_of(session, cameras, small_options());
    EXPECT_EQ(rays_at_contacts(), 0u);
}

}  // namespace
}  // namespace rcs
