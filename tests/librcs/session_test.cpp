#include "rcs/session.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <glm/gtc/matrix_transform.hpp>

#include "rcs/error.h"
#include "rcs/render.h"
#include "session/session_state.h"
#include "support/scenes.h"
#include "support/session.h"

namespace rcs {
namespace {

RenderOptions small(int bounces = 1)
{
    RenderOptions options;
    options.width = options.height = 48;
    options.aa = 1;
    options.bounces = bounces;
    return options;
}

Session borrowed(ThreadPool& pool, bool keep_records = false)
{
    return Session(test::shared_gl(), pool, {.keep_records = keep_records});
}

void expect_same(const LayeredImage& a, const LayeredImage& b)
{
    ASSERT_EQ(a.layers.size(), b.layers.size());
    for (const auto& [name, layer] : a.layers) EXPECT_TRUE(layer.pixels == b.layers.at(name).pixels) << name;
}

const Validity& of(const RenderStats& stats, SessionPart part) { return stats.kept[static_cast<std::size_t>(part)]; }

Camera moved(Camera camera)
{
    camera.world_from_view[3].x += 0.2;
    return camera;
}

TEST(Session, ShowsNothingAtFirstAndSaysSo)
{
    Session session;
    EXPECT_FALSE(session.has_scene());
    try {
        render(session, Camera{}, small());
        FAIL();
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), ErrorCode::not_found);
    }
}

TEST(Session, AViewIsTheSameBitsWhateverWasRenderedBefore)
{
    const Scene scene = test::furnished_room();
    ThreadPool pool(2);
    Session session = borrowed(pool);
    session.show(scene);
    const Camera here = scene.cameras[0], there = moved(here);
    for (const int bounces : {1, 3}) {
        render(session, there, small(bounces));
        const RenderResult after_others = render(session, here, small(bounces));
        EXPECT_TRUE(of(after_others.stats, SessionPart::ray_scene).kept);
        EXPECT_FALSE(of(after_others.stats, SessionPart::records).kept);
        EXPECT_TRUE(session.state().contacts.empty());
        const RenderResult again = render(session, here, small(bounces));
        const RenderResult alone = test::render_view(scene, here, small(bounces));
        expect_same(after_others.image, alone.image);
        expect_same(again.image, alone.image);
    }
}

TEST(Session, KeepsTheLightCacheForTheSameViewAlone)
{
    const Scene scene = test::furnished_room();
    ThreadPool pool(2);
    Session session = borrowed(pool);
    session.show(scene);
    EXPECT_GT(render(session, scene.cameras[0], small(3)).stats.light_cache.rays, 0u);
    const RenderStats same = render(session, scene.cameras[0], small(3)).stats;
    EXPECT_EQ(same.light_cache.rays, 0u);
    EXPECT_TRUE(of(same, SessionPart::light_cache).kept);
    const RenderStats other = render(session, moved(scene.cameras[0]), small(3)).stats;
    EXPECT_GT(other.light_cache.rays, 0u);
    EXPECT_FALSE(of(other, SessionPart::light_cache).kept);
    EXPECT_EQ(of(other, SessionPart::light_cache).why, "the view is another");
    EXPECT_GT(render(session, moved(scene.cameras[0]), small(4)).stats.light_cache.rays, 0u);
    session.forget_light();
    EXPECT_GT(render(session, moved(scene.cameras[0]), small(4)).stats.light_cache.rays, 0u);
}

TEST(Session, AnotherLampOrSkyLeavesTheAccelerationStructure)
{
    const Scene scene = test::furnished_room();
    const std::vector<std::function<void(Scene&)>> changes{
        [](Scene& s) { s.lights.push_back(test::point_light({0.3, 1.9, 0.2}, glm::vec3(2.0f, 1.0f, 0.5f))); },
        [](Scene& s) { s.lights.clear(), s.sky_radiance = glm::vec3(0.5f); },
        [](Scene& s) {
            s.environment.width = 2, s.environment.height = 1;
            s.environment.radiance = {glm::vec3(1.0f), glm::vec3(0.2f)};
        }};
    for (const auto& change : changes) {
        ThreadPool pool(2);
        Session session = borrowed(pool, true);
        session.show(scene);
        render(session, scene.cameras[0], small(2));
        EXPECT_FALSE(session.records().empty());
        Scene lit = scene;
        change(lit);
        session.show(lit);
        EXPECT_TRUE(session.validity(SessionPart::ray_scene).kept);
        EXPECT_FALSE(session.validity(SessionPart::records).kept);
        EXPECT_EQ(session.validity(SessionPart::light_cache).why, "lamps or the sky have changed");
        EXPECT_TRUE(session.records().empty());
        const RenderResult result = render(session, scene.cameras[0], small(2));
        EXPECT_EQ(of(result.stats, SessionPart::ray_scene).why, "only lamps or the sky have changed");
        expect_same(result.image, test::render_view(lit, scene.cameras[0], small(2)).image);
    }
}

TEST(Session, AnotherPoseOrMaterialTakesAllOfItDown)
{
    const Scene scene = test::furnished_room();
    const std::vector<std::function<void(Scene&)>> changes{
        [](Scene& s) { s.instances.back().world_from_object[3].x += 0.05; },
        [](Scene& s) { s.meshes.front().positions.front().x += 0.01f; },
        [](Scene& s) { s.materials.front().base_color *= 0.5f; },
        [](Scene& s) { s.materials.front().emission = glm::vec3(1.0f); }};
    for (const auto& change : changes) {
        ThreadPool pool(2);
        Session session = borrowed(pool, true);
        session.show(scene);
        render(session, scene.cameras[0], small());
        Scene other = scene;
        change(other);
        session.show(other);
        for (const SessionPart part : {SessionPart::ray_scene, SessionPart::light_cache, SessionPart::records}) {
            EXPECT_FALSE(session.validity(part).kept) << name_of(part);
            EXPECT_EQ(session.validity(part).why, "surfaces have moved or changed");
        }
        expect_same(render(session, scene.cameras[0], small()).image,
                    test::render_view(other, scene.cameras[0], small()).image);
    }
}

TEST(Session, TheSameSceneShownAgainLeavesEverything)
{
    const Scene scene = test::furnished_room();
    ThreadPool pool(2);
    Session session = borrowed(pool, true);
    session.show(scene);
    render(session, scene.cameras[0], small(2));
    session.show(scene);
    const RenderStats stats = render(session, scene.cameras[0], small(2)).stats;
    EXPECT_EQ(stats.records.records, 0u);
    EXPECT_EQ(stats.light_cache.rays, 0u);
    for (const Validity& part : stats.kept) EXPECT_TRUE(part.kept) << part.why;
}

TEST(Session, KeepsRecordsAsLongAsTheOptionsThatTheyDependOn)
{
    const Scene scene = test::furnished_room();
    ThreadPool pool(2);
    Session session = borrowed(pool, true);
    session.show(scene);
    const RenderStats first = render(session, scene.cameras[0], small()).stats;
    const std::size_t records = session.records().size();
    EXPECT_EQ(records, first.records.records);
    const RenderStats walk = render(session, moved(scene.cameras[0]), small()).stats;
    EXPECT_TRUE(of(walk, SessionPart::records).kept);
    EXPECT_LT(walk.records.records, records / 2);
    EXPECT_EQ(session.records().size(), records + walk.records.records);
    RenderOptions finer = small();
    settings_of(finer).error_tolerance = 0.1f;
    const RenderStats other = render(session, scene.cameras[0], finer).stats;
    EXPECT_FALSE(of(other, SessionPart::records).kept);
    EXPECT_NE(of(other, SessionPart::records).why.find("accuracy 0.2"), std::string::npos)
        << of(other, SessionPart::records).why;
    EXPECT_GT(other.records.records, records);
}

TEST(Session, LaysRecordsOutOfSightAsideAndForgetsThemInTime)
{
    const Scene scene = test::furnished_room();
    ThreadPool pool(2);
    Session session = borrowed(pool, true);
    session.show(scene);
    Camera aside = scene.cameras[0];
    aside.world_from_view = glm::rotate(aside.world_from_view, 1.2, glm::dvec3(0.0, 1.0, 0.0));
    RenderOptions tiny = small();
    tiny.width = tiny.height = 20;
    const std::uint64_t first = render(session, scene.cameras[0], tiny).stats.records.records;
    const std::uint64_t second = render(session, aside, tiny).stats.records.records;
    ASSERT_GT(second, 4u);
    EXPECT_EQ(session.records().size(), first + second);
    // What was found aside limits the reach of its neighbours: a few holes open, and stay filled.
    const std::uint64_t holes = render(session, scene.cameras[0], tiny).stats.records.records;
    EXPECT_LT(holes, first / 2) << "they come back";
    EXPECT_EQ(render(session, scene.cameras[0], tiny).stats.records.records, 0u) << "all of them are there";
    for (int view = 0; view < 242; ++view) render(session, scene.cameras[0], tiny);
    EXPECT_LT(session.records().size(), first + second + holes) << "a few reach into the picture";
}

TEST(Session, KeepsWhereToLookForLightWhereRecordsAreKept)
{
    const Scene scene = test::furnished_room();
    ThreadPool pool(2);
    for (const bool keep : {true, false}) {
        Session session = borrowed(pool, keep);
        session.show(scene);
        for (int views = 1; views <= 2; ++views) {
            render(session, scene.cameras[0], small());
            ASSERT_EQ(session.state().guide.has_value(), keep);
            if (keep) {
                EXPECT_EQ(session.state().guide->views, views);
            }
        }
        session.forget_light();
        EXPECT_FALSE(session.state().guide.has_value());
    }
}

TEST(Session, JudgesTheErrorAnewWhereRecordsAreOthers)
{
    const Scene scene = test::furnished_room();
    ThreadPool pool(2);
    Camera aside = scene.cameras[0];
    aside.world_from_view = glm::rotate(aside.world_from_view, 1.2, glm::dvec3(0.0, 1.0, 0.0));
    for (const bool keep : {true, false}) {
        Session session = borrowed(pool, keep);
        session.show(scene);
        const RenderStats first = render(session, scene.cameras[0], small()).stats;
        ASSERT_GT(first.probe_rays, 0u);
        const RenderStats again = render(session, scene.cameras[0], small()).stats;
        EXPECT_EQ(again.probe_rays, keep ? 0u : first.probe_rays);
        EXPECT_DOUBLE_EQ(again.errors.indirect.mean_relative, first.errors.indirect.mean_relative);
        EXPECT_GT(render(session, aside, small()).stats.probe_rays, 0u) << "most of it was never seen";
        session.forget_light();
        EXPECT_GT(render(session, scene.cameras[0], small()).stats.probe_rays, 0u);
    }
}

TEST(Session, KeepsNoMoreRecordsThanItMay)
{
    const Scene scene = test::furnished_room();
    ThreadPool pool(2);
    Session free = borrowed(pool, true);
    free.show(scene);
    const Camera here = scene.cameras[0], there = moved(here);
    render(free, here, small(1));
    const std::size_t of_one = free.records().size();
    render(free, there, small(1));
    const std::size_t of_both = free.records().size();
    ASSERT_GT(of_both, of_one);
    for (const std::size_t most : {of_both - 1, of_one / 2}) {
        Session session(test::shared_gl(), pool, {.keep_records = true, .most_records = most});
        session.show(scene);
        render(session, here, small(1));
        const RenderResult bounded = render(session, there, small(1));
        EXPECT_LE(session.records().size(), most);
        EXPECT_EQ(session.records().empty(), most == of_one / 2) << "those in sight stay if they are few enough";
        EXPECT_EQ(bounded.stats.unserved_pixels, 0u);
    }
}

TEST(Session, AsksSurfacesAgainWhereTheChoiceOfEffectsIsAnother)
{
    const Scene scene = test::furnished_room();
    ThreadPool pool(2);
    Session session = borrowed(pool);
    session.show(scene);
    const RayScene* const plain = &session.rays();
    EXPECT_EQ(&session.rays(), plain);
    EffectChoice without;
    without.without.set(Effect::more_bounces);
    session.rays(without);
    EXPECT_FALSE(session.validity(SessionPart::ray_scene).kept);
    EXPECT_EQ(session.validity(SessionPart::ray_scene).why, "the scene is new");
    without.without.set(Effect::instancing);
    session.rays(without);
    EXPECT_EQ(session.validity(SessionPart::ray_scene).why,
              "alpha, transmission, normal maps or instancing are chosen otherwise");
}

TEST(Session, TwoAtATimeDoNotCountEachOther)
{
    const Scene room = test::furnished_room(), cornell = load_scene("demo:cornell");
    const auto counts = [](const Scene& scene) {
        Session session({.threads = 2});
        session.show(scene);
        return render(session, scene.cameras[0], small(2)).stats.counts;
    };
    const EffectCounts alone = counts(room);
    std::vector<EffectCounts> together(3);
    std::jthread other([&] {
        for (int i = 0; i < 3; ++i) counts(cornell);
    });
    for (EffectCounts& count : together) count = counts(room);
    other.join();
    EXPECT_GT(alone.hit_lamp_rays, 0u);
    for (const EffectCounts& count : together) {
        EXPECT_EQ(count.hit_lamp_rays, alone.hit_lamp_rays);
        EXPECT_EQ(count.area_rays, alone.area_rays);
        EXPECT_EQ(count.punctual_rays, alone.punctual_rays);
        EXPECT_EQ(count.camera_rays, alone.camera_rays);
        EXPECT_EQ(count.gl_bytes, alone.gl_bytes);
        EXPECT_EQ(count.shaders, alone.shaders);
    }
}

TEST(Session, OfTheOneShotRenderGivesTheSamePicture)
{
    const Scene scene = test::furnished_room();
    const RenderResult result = render(scene, scene.cameras[0], small());
    EXPECT_FALSE(result.records.empty());
    expect_same(result.image, test::render_view(scene, scene.cameras[0], small()).image);
}

TEST(Session, KeepsNoRecordOfAnotherSceneThatNobodyFollows)
{
    ThreadPool pool(2);
    Session session(test::shared_gl(), pool, {.keep_records = true, .watch_records = true});
    const auto room_with_block_at = [](double x) {
        Scene scene = test::furnished_room();
        scene.instances[1].world_from_object = glm::translate(glm::dmat4(1.0), glm::dvec3(x, 0.0, 0.0));
        return scene;
    };
    const auto unwatched = [&] {
        return std::count_if(session.records().begin(), session.records().end(),
                             [](const Record& r) { return r.watch.seen.empty(); });
    };
    const Camera camera = room_with_block_at(0.0).cameras[0];
    Camera away = camera;
    away.world_from_view = camera.world_from_view * glm::rotate(glm::dmat4(1.0), 3.1, glm::dvec3(0.0, 1.0, 0.0));
    for (const double x : {0.0, 0.3}) {
        session.show(room_with_block_at(x));
        render(session, camera, small());
    }
    EXPECT_GT(unwatched(), 0) << "on the block, which may move on";
    Scene lit = room_with_block_at(0.3);
    lit.lights.push_back(test::point_light({-1.5, 2.0, 1.0}, {3.0f, 1.0f, 0.5f}));
    session.show(std::move(lit));
    render(session, away, small());
    EXPECT_EQ(unwatched(), 0);
}

TEST(Session, PassesShareWhatContactsGatheredWhereTheSceneIsWatchedToo)
{
    ThreadPool pool(2);
    RenderOptions options = small(1);
    options.aa = 4;
    const auto contact_rays = [&](SessionOptions of) {
        Session session(test::shared_gl(), pool, of);
        session.show(test::furnished_room());
        return render(session, session.rays().scene().cameras[0], options).stats.contact_rays;
    };
    const std::uint64_t unwatched = contact_rays({.keep_records = true});
    EXPECT_GT(unwatched, 0u);
    EXPECT_EQ(contact_rays({.keep_records = true, .watch_records = true}), unwatched);
}

TEST(Session, ForgetsContactsThatNobodyWatchesOnceTheSceneChanges)
{
    ThreadPool pool(2);
    Session session(test::shared_gl(), pool, {.keep_records = true, .watch_records = true});
    Scene scene = test::furnished_room();
    session.show(scene);
    render(session, scene.cameras[0], small(1));
    std::vector<Record>& contacts = session.state().contacts;
    ASSERT_GT(contacts.size(), 20u);
    const std::size_t before = contacts.size();
    contacts[3].watch.seen.clear();
    contacts[9].watch.seen.clear();
    scene.lights.push_back(test::point_light({0.3, 1.9, 0.2}, glm::vec3(2.0f)));
    session.show(scene);
    EXPECT_EQ(contacts.size(), before - 2);
}

}  // namespace
}  // namespace rcs
