#include "placement/renewal.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include <glm/gtc/matrix_transform.hpp>

#include "rcs/render.h"
#include "records/gather.h"
#include "records/record_bytes.h"
#include "records/watch.h"
#include "session/session_state.h"
#include "support/scenes.h"
#include "support/session.h"
#include "util/color.h"

namespace rcs {
namespace {

RenderOptions small()
{
    RenderOptions options;
    options.width = options.height = 48;
    options.aa = 1;
    return options;
}

RecordSettings settings()
{
    RenderOptions options = small();
    return {.rays = settings_of(options).rays};
}

/// The block of the furnished room moved along the floor.
Scene moved_by(double distance)
{
    Scene scene = test::furnished_room();
    scene.instances[1].world_from_object = glm::translate(glm::dmat4(1.0), glm::dvec3(distance, 0.0, 0.0));
    return scene;
}

Scene with_lamp(Scene scene)
{
    scene.lights.push_back(test::point_light({-1.5, 2.0, 1.0}, {3.0f, 1.0f, 0.5f}));
    return scene;
}

struct Walk {
    ThreadPool pool{2};
    Session session{test::shared_gl(), pool, {.keep_records = true, .watch_records = true}};

    RenderOptions options = small();

    RenderResult show(const Scene& scene)
    {
        session.show(scene);
        return render(session, scene.cameras[0], options);
    }
};

double mean_of(const LayeredImage& image, const char* layer)
{
    const Image& pixels = image.layers.at(layer);
    double sum = 0.0;
    for (const float value : pixels.pixels) sum += static_cast<double>(value);
    return sum / static_cast<double>(pixels.pixels.size());
}

TEST(RecordWatcher, SeesNothingChangeInTheSameSceneAndAllOfALamp)
{
    Walk walk;
    walk.show(moved_by(0.0));
    std::vector<Record> records = walk.session.records();
    std::vector<std::uint32_t> all(records.size());
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint32_t>(i);
    RecordStats stats;
    for (const Record& change :
         RecordWatcher({walk.session.rays()}, settings()).look(records, all, {.now = 7}, walk.pool, stats)) {
        EXPECT_EQ(change.irradiance, glm::vec3(0.0f));
        EXPECT_EQ(change.noise, 0.0f);
        EXPECT_EQ(change.translation_gradient[0], glm::vec3(0.0f));
    }
    EXPECT_EQ(records.front().watch.state, 7u);

    const Scene lit = with_lamp(moved_by(0.0));
    const RayScene rays = build_ray_scene(lit, walk.pool);
    std::vector<Record> fresh = records;
    RecordGatherer({rays}, settings()).renew(fresh, all, walk.pool, stats);
    const std::vector<Record> changes =
        RecordWatcher({rays}, settings()).look(records, all, {.now = 8}, walk.pool, stats);
    double told = 0.0, truth = 0.0;
    for (std::size_t i = 0; i < all.size(); ++i) {
        told += static_cast<double>(luminance(changes[i].irradiance));
        truth += static_cast<double>(luminance(fresh[i].irradiance - records[i].irradiance));
    }
    EXPECT_GT(truth, 0.0);
    EXPECT_NEAR(told / truth, 1.0, 0.05);
}

TEST(RecordWatcher, SparesRecordsThatAChangeCannotReachAndTellsTheSame)
{
    const auto with_pebble_at = [](double distance) {
        Scene scene = moved_by(distance);
        glm::dmat4& matrix = scene.instances[1].world_from_object;
        matrix = glm::scale(matrix, glm::dvec3(0.2));
        return scene;
    };
    Walk walk;
    walk.show(with_pebble_at(0.0));
    std::vector<Record> records = walk.session.records();
    std::vector<std::uint32_t> all(records.size());
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint32_t>(i);
    walk.session.show(with_pebble_at(0.1));
    const RecordWatcher watcher({walk.session.rays()}, settings());
    const SceneStates states = walk.session.state().states();
    ASSERT_EQ(states.changes.size(), 1u);
    RecordStats spared, none_spared;
    std::vector<Record> copy = records;
    const std::vector<Record> some = watcher.look(records, all, states, walk.pool, spared);
    const std::vector<Record> each = watcher.look(copy, all, {.now = states.now}, walk.pool, none_spared);
    EXPECT_EQ(none_spared.looked_again, all.size());
    EXPECT_LT(spared.looked_again, all.size() * 9 / 10);
    EXPECT_LT(spared.hemisphere_rays, none_spared.hemisphere_rays / 2) << "also most rays of those looked at";
    std::size_t changed = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
        ASSERT_EQ(some[i].irradiance, each[i].irradiance) << i;
        ASSERT_EQ(some[i].noise, each[i].noise) << i;
        ASSERT_EQ(records[i].watch.seen, copy[i].watch.seen) << i;
        EXPECT_EQ(records[i].watch.state, states.now);
        changed += each[i].irradiance != glm::vec3(0.0f);
    }
    EXPECT_GT(changed, 0u);
    EXPECT_LT(changed, spared.looked_again);

    // What is known of the rays that were spared goes on to hold.
    walk.session.show(with_pebble_at(0.25));
    const RecordWatcher later({walk.session.rays()}, settings());
    const SceneStates then_states = walk.session.state().states();
    const std::vector<Record> some_then = later.look(records, all, then_states, walk.pool, spared);
    const std::vector<Record> each_then = later.look(copy, all, {.now = then_states.now}, walk.pool, none_spared);
    for (std::size_t i = 0; i < all.size(); ++i) {
        ASSERT_EQ(some_then[i].irradiance, each_then[i].irradiance) << i;
        ASSERT_EQ(records[i].watch.seen, copy[i].watch.seen) << i;
        records[i].watch.state = states.now;
    }

    // Without knowing what happened meanwhile, and where light may be another, all are looked at.
    const auto looked_at = [&](std::span<const SceneChange> changes, std::uint32_t now) {
        RecordStats stats;
        std::vector<Record> others = records;
        watcher.look(others, all, {.now = now, .changes = changes, .box = states.box}, walk.pool, stats);
        return stats.looked_again;
    };
    const SceneChange nowhere{.state = states.now + 1}, lamps{.state = states.now + 1, .everywhere = true};
    EXPECT_EQ(looked_at({&nowhere, 1}, states.now + 1), 0u);
    EXPECT_EQ(looked_at({&lamps, 1}, states.now + 1), all.size());
    EXPECT_EQ(looked_at({&nowhere, 1}, states.now + 2), all.size());
    const SceneChange then[] = {lamps, {.state = states.now + 2}};
    EXPECT_EQ(looked_at(then, states.now + 2), all.size());
    const SceneChange all_over{.state = states.now + 1, .where = {states.box}};
    EXPECT_EQ(looked_at({&all_over, 1}, states.now + 1), all.size());
}

TEST(RecordWatcher, LooksEverywhereWhereASurfaceThatShinesMoves)
{
    Walk walk;
    const auto shine = [](Scene s) {
        const Mesh& mesh = s.meshes[static_cast<std::size_t>(s.instances[1].mesh)];
        s.materials[static_cast<std::size_t>(mesh.material)].emission = glm::vec3(1.0f);
        return s;
    };
    walk.show(shine(moved_by(0.0)));
    EXPECT_TRUE(walk.session.state().states().changes.empty());
    walk.session.show(shine(moved_by(0.1)));
    EXPECT_TRUE(walk.session.state().states().changes.back().everywhere);
    walk.session.show(moved_by(0.1));
    EXPECT_TRUE(walk.session.state().states().changes.back().everywhere) << "it has gone out";
    walk.session.show(moved_by(0.2));
    const SceneChange change = walk.session.state().states().changes.back();
    EXPECT_FALSE(change.everywhere);
    ASSERT_EQ(change.where.size(), 2u) << "where it was and where it is";
    EXPECT_NEAR(change.where[1].min.x - change.where[0].min.x, 0.1, 1e-6);
    walk.session.show(with_lamp(moved_by(0.3)));
    EXPECT_TRUE(walk.session.state().states().changes.back().everywhere) << "both at once";
}

TEST(Renewal, RecordsThatAreKeptHoldWhatTheyWouldGather)
{
    Walk walk;
    walk.show(moved_by(0.0));
    for (const double distance : {0.01, 0.02, 0.04}) {
        const std::vector<Record> before = walk.session.records();
        const RenderStats stats = walk.show(moved_by(distance)).stats;
        EXPECT_GT(stats.records.watched, 0u);
        EXPECT_LT(stats.records.renewed, stats.records.watched / 2) << distance;
        const std::uint32_t now = walk.session.state().scene_number;
        std::vector<Record> kept;
        for (const Record& r : walk.session.records())
            if (r.watch.gathered < now && r.watch.state == now) kept.push_back(r);
        ASSERT_GT(kept.size(), before.size() / 2) << distance;
        std::vector<Record> again = kept;
        std::vector<std::uint32_t> all(kept.size());
        for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint32_t>(i);
        RecordStats uncounted;
        RecordGatherer({walk.session.rays()}, settings()).renew(again, all, walk.pool, uncounted);
        double sum = 0.0, off = 0.0, absolute = 0.0;
        for (std::size_t i = 0; i < kept.size(); ++i) {
            const double e = static_cast<double>(luminance(again[i].irradiance));
            const double difference = static_cast<double>(luminance(kept[i].irradiance)) - e;
            sum += e;
            off += difference;
            absolute += std::abs(difference);
        }
        EXPECT_NEAR(off / sum, 0.0, 0.01) << distance;
        EXPECT_LT(absolute / sum, 0.03) << distance << ": more than the noise that records may have";
    }
}

TEST(Renewal, RecordsWhoseRaysMeetNothingNewKeepTheirBits)
{
    Walk walk;
    walk.show(moved_by(0.0));
    const std::vector<Record> before = walk.session.records();
    walk.show(moved_by(0.001));
    std::size_t same = 0;
    for (const Record& r : walk.session.records())
        for (const Record& old : before)
            same += r.position == old.position && r.irradiance == old.irradiance && r.noise == old.noise;
    EXPECT_GT(same, before.size() / 4);
}

TEST(Renewal, TheFrameAfterALampOrAnObjectHasNoTraceOfBefore)
{
    const Scene scenes[] = {moved_by(0.0), with_lamp(moved_by(0.0)), moved_by(0.0), moved_by(0.8)};
    Walk walk;
    RenderResult before = walk.show(scenes[0]);
    for (int i = 1; i < 4; ++i) {
        RenderResult now = walk.show(scenes[i]);
        EXPECT_GT(now.stats.records.watched, 0u);
        const double alone = mean_of(test::render_first(scenes[i], small()).image, "indirect");
        const double change = std::abs(alone - mean_of(before.image, "indirect"));
        if (i < 3) {
            EXPECT_GT(change, 0.05 * alone);
            EXPECT_NEAR(mean_of(now.image, "indirect"), alone, 0.01 * (change + alone)) << i;
        }
        EXPECT_NEAR(mean_of(now.image, "indirect"), alone, 0.03 * alone) << i << ": noise of few records";
        EXPECT_EQ(now.stats.unserved_pixels, 0u);
        before = std::move(now);
    }
}

/// Sum of the light that gathers at contacts hold, and what the same rays bring now.
glm::dvec2 light_at_contacts(Walk& walk, const std::vector<Record>& contacts)
{
    std::vector<Record> again = contacts;
    std::vector<std::uint32_t> all(again.size());
    std::iota(all.begin(), all.end(), 0u);
    RecordSettings few = settings();
    few.rays = 16;
    RecordStats uncounted;
    RecordGatherer({walk.session.rays()}, few).renew(again, all, walk.pool, uncounted);
    glm::dvec2 sum(0.0);
    for (std::size_t i = 0; i < again.size(); ++i)
        sum += glm::dvec2(luminance(contacts[i].irradiance), luminance(again[i].irradiance));
    return sum;
}

TEST(Renewal, GathersAtContactsStayAndFollowTheScene)
{
    Walk walk;
    const std::uint64_t first = walk.show(moved_by(0.0)).stats.contact_rays;
    const std::vector<Record>& contacts = walk.session.state().contacts;
    ASSERT_GT(contacts.size(), 100u);
    const std::size_t gathers = contacts.size();
    EXPECT_EQ(walk.show(moved_by(0.0)).stats.contact_rays, 0u);
    EXPECT_GT(first, 16 * contacts.size() - 1);
    EXPECT_EQ(contacts.size(), gathers);
    EXPECT_GT(walk.show(moved_by(0.01)).stats.contact_rays, 0u) << "some see the block move";
    const glm::dvec2 dark = light_at_contacts(walk, contacts);
    EXPECT_NEAR(dark.x, dark.y, 0.06 * dark.y) << "noise of few rays";
    EXPECT_GT(walk.show(with_lamp(moved_by(0.01))).stats.contact_rays, 0u);
    const glm::dvec2 bright = light_at_contacts(walk, contacts);
    EXPECT_GT(bright.y, 1.5 * dark.y);
    EXPECT_NEAR(bright.x, bright.y, 0.06 * bright.y);
    walk.options.min_reach = 10.0f;
    EXPECT_GT(walk.show(with_lamp(moved_by(0.01))).stats.contact_rays, first / 2) << "other options, other gathers";
    walk.session.forget_light();
    EXPECT_TRUE(contacts.empty());
}

TEST(Renewal, RecordsOnOrInsideWhatMovedGo)
{
    Walk walk;
    walk.show(moved_by(0.0));
    const auto on_block = [](const Record& r) { return r.watch.instance == 1; };
    const std::vector<Record> before = walk.session.records();
    ASSERT_GT(std::count_if(before.begin(), before.end(), on_block), 0);
    walk.show(moved_by(0.3));
    const std::uint32_t now = walk.session.state().scene_number;
    const std::vector<Record>& records = walk.session.records();
    const auto is_old = [&](const Record& r) { return on_block(r) && r.watch.gathered < now; };
    EXPECT_TRUE(std::none_of(records.begin(), records.end(), is_old));
    // Nothing moves on: they stay, and are watched once something else changes.
    EXPECT_EQ(walk.show(moved_by(0.3)).stats.records.records, 0u);
    walk.show(with_lamp(moved_by(0.3)));
    const auto is_watched = [&](const Record& r) { return on_block(r) && !r.watch.seen.empty(); };
    EXPECT_TRUE(std::any_of(records.begin(), records.end(), is_watched));
}

TEST(Renewal, RecordsWithRadianceOutliveViewsThatTakeNone)
{
    // A glossy block, and beside it a wall, seen alone: there gathers keep no radiance.
    const auto room = [](float light, bool wall_alone) {
        Scene scene = moved_by(0.0);
        const int mesh = scene.instances[1].mesh;
        Material& block =
            scene.materials[static_cast<std::size_t>(scene.meshes[static_cast<std::size_t>(mesh)].material)];
        block.metallic = 1.0f, block.roughness = 0.7f;
        scene.lights.push_back(test::point_light({-1.5, 2.0, 1.0}, light * glm::vec3(3.0f, 1.0f, 0.5f)));
        if (wall_alone) scene.cameras[0].yfov *= 0.25, scene.cameras[0].lens_shift.y = 1.4;
        return scene;
    };
    Walk walk;
    walk.show(room(0.1f, false));
    const std::vector<Record>& records = walk.session.records();
    ASSERT_TRUE(std::any_of(records.begin(), records.end(), [](const Record& r) { return !r.radiance.empty(); }));
    // So faint that records take the change on where it is sure enough.
    const Scene wall = room(0.12f, true);
    const RenderResult now = walk.show(wall);
    ASSERT_FALSE(now.stats.plan.needs(Effect::glossy_records));
    EXPECT_GT(now.stats.records.watched, now.stats.records.renewed);
    EXPECT_GT(now.stats.records.renewed, 0u);
    const double alone = mean_of(test::render_first(wall, small()).image, "indirect");
    EXPECT_NEAR(mean_of(now.image, "indirect"), alone, 0.05 * alone) << "noise of few records";
    EXPECT_EQ(walk.show(room(0.13f, false)).stats.unserved_pixels, 0u);
}

TEST(Renewal, EveryRecordIsGatheredAgainOnceItsLifeIsOver)
{
    Walk walk;
    walk.options.width = walk.options.height = 12;
    walk.show(moved_by(0.0));
    const std::uint32_t first = walk.session.state().scene_number;
    std::uint64_t renewed = 0;
    for (int frame = 1; frame <= 512; ++frame) {
        Scene scene = moved_by(0.0);
        scene.instances[1].world_from_object[3].y += 1e-9 * frame;
        const RenderStats stats = walk.show(scene).stats;
        renewed += stats.records.renewed;
        EXPECT_LT(stats.records.renewed, stats.records.watched / 3) << "they take turns";
    }
    EXPECT_GT(renewed, 0u);
    for (const Record& r : walk.session.records()) {
        if (r.watch.state == walk.session.state().scene_number) {
            EXPECT_GT(r.watch.gathered, first);
        }
    }
}

TEST(Renewal, RecordsOfAFileFollowOnceItIsKnownWhatTheySee)
{
    Walk first;
    first.options.width = first.options.height = 64;  // of smaller pictures, chance says whether looks do good
    first.show(moved_by(0.0));
    const std::string file = to_bytes({"scene", "settings"}, first.session.records());
    const auto frame_after = [&](bool watched) {
        Walk later;
        later.options = first.options;
        later.session.show(moved_by(0.0));
        later.session.begin_with(parse_records(file, "file").records);
        if (watched) begin_watching(later.session, moved_by(0.0).cameras[0], later.options);
        return later.show(moved_by(0.3));
    };
    const RenderStats with = frame_after(true).stats, without = frame_after(false).stats;
    const RenderStats by_session = first.show(moved_by(0.3)).stats;
    EXPECT_EQ(without.records.watched, 0u) << "all went";
    EXPECT_LT(2 * with.records.records, without.records.records);
    EXPECT_EQ(with.records.watched, by_session.records.watched);
    EXPECT_EQ(with.records.renewed, by_session.records.renewed);
    EXPECT_NEAR(double(with.records.records), double(by_session.records.records), 10.0) << "rays are a session's own";
}

TEST(Renewal, ASessionThatDoesNotWatchDropsAll)
{
    ThreadPool pool(2);
    Session session(test::shared_gl(), pool, {.keep_records = true});
    for (const double distance : {0.0, 0.1}) {
        session.show(moved_by(distance));
        EXPECT_TRUE(session.records().empty());
        render(session, moved_by(distance).cameras[0], small());
        EXPECT_TRUE(session.records().front().watch.seen.empty());
    }
}

}  // namespace
}  // namespace rcs
