// Views of one session go on from the samples of lamps and along lobes that the pixels of the view before took.
#include "session/kept_samples.h"

#include <cmath>
#include <cstdint>
#include <numeric>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "rcs/error.h"
#include "rcs/render.h"
#include "session/session_state.h"
#include "support/effect_scenes.h"
#include "support/scenes.h"
#include "support/session.h"

namespace rcs {
namespace {

/// A lamp with a penumbra, and a floor that shines.
Scene shining_room(float lamp = 6.0f)
{
    Scene scene = test::furnished_room();
    for (Material& material : scene.materials)
        if (material.emission.x > 0.0f) material.emission = glm::vec3(lamp);
    scene.lights.clear();
    Material floor = test::metal(0.25f);
    floor.metallic = 0.5f;
    test::add_mesh(scene,
                   test::quad({-1.99f, 0.01f, -1.99f}, {0, 0, 3.98f}, {3.98f, 0, 0}, test::add_surface(scene, floor)));
    return scene;
}

RenderOptions small(int aa = 1) { return test::options_of_size(96, 96, aa); }

/// Of a slow walk to the right.
Camera camera_at(const Scene& scene, int view)
{
    Camera camera = scene.cameras[0];
    camera.world_from_view[3] += 0.003 * view * camera.world_from_view[0];
    return camera;
}

struct Walk {
    ThreadPool pool;
    Session session;

    explicit Walk(int threads = 2, bool keeps = true)
        : pool(threads), session(test::shared_gl(), pool, {.keep_records = keeps, .watch_records = keeps})
    {
    }
    RenderResult show(const Scene& scene, int view, const RenderOptions& options)
    {
        session.show(scene);
        return render(session, camera_at(scene, view), options);
    }
};

double mean_of(const RenderResult& result, const char* layer)
{
    const std::vector<float>& values = result.image.layers.at(layer).pixels;
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Mean difference of two layers over the mean of the second.
double difference(const RenderResult& a, const RenderResult& b, const char* layer)
{
    const std::vector<float>&x = a.image.layers.at(layer).pixels, &y = b.image.layers.at(layer).pixels;
    double sum = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) sum += std::abs(static_cast<double>(x[i] - y[i]));
    return sum / static_cast<double>(x.size()) / mean_of(b, layer);
}

/// A view by itself, by another seed than a walk's.
RenderResult alone(const Scene& scene, int view, std::uint64_t seed)
{
    RenderOptions options = small();
    options.seed = seed;
    return test::render_view(scene, camera_at(scene, view), options);
}

/// Two renders that know nothing of each other differ by what both are off. @param bias  of the mean, at the most
void expect_as_good_as_alone(const RenderResult& last, const Scene& scene, int view, const char* layer, double bias,
                             double slack)
{
    const RenderResult one = alone(scene, view, 2), two = alone(scene, view, 3);
    EXPECT_NEAR(mean_of(last, layer), mean_of(one, layer), bias * mean_of(one, layer));
    EXPECT_LT(difference(last, one, layer), slack * difference(two, one, layer));
}

TEST(KeptSamples, SpareViewsOfAStillSceneMostOfTheirs)
{
    const Scene scene = shining_room();
    const RenderOptions options = small();
    Walk walk;
    RenderResult last = walk.show(scene, 0, options);
    const std::uint64_t rays = last.stats.direct_shadow_rays, along_lobes = last.stats.traced.rays;
    ASSERT_GT(along_lobes, 0u);
    for (int view = 1; view <= 20; ++view) last = walk.show(scene, view, options);
    EXPECT_LT(2 * last.stats.direct_shadow_rays, rays);
    EXPECT_LT(3 * last.stats.traced.rays, 2 * along_lobes);

    const RenderResult one = alone(scene, 20, 2), two = alone(scene, 20, 3);
    for (const char* layer : {"direct", "indirect"})
        EXPECT_NEAR(mean_of(last, layer), 0.5 * (mean_of(one, layer) + mean_of(two, layer)), 0.01 * mean_of(one, layer))
            << layer;
    // Two renders that know nothing of each other differ by what both are off.
    EXPECT_LT(difference(last, one, "direct"), 1.05 * difference(two, one, "direct"));
}

/// Close to a lamp light changes from pixel to pixel, but its shape tells by how much where nothing hides it.
TEST(KeptSamples, KnowTheLightOfLampsThatNothingHides)
{
    Scene scene = test::room(0.5f);
    test::add_mesh(scene, test::quad({-0.5f, 2.9f, -1.9f}, {1, 0, 0}, {0, 0, 0.5f},
                                     test::add_material(scene, glm::vec3(0.0f), glm::vec3(9.0f))));
    Walk walk;
    const std::uint64_t rays = walk.show(scene, 0, small()).stats.direct_shadow_rays;
    for (int view = 1; view <= 20; ++view) {
        const RenderResult now = walk.show(scene, 5 * view, small());
        EXPECT_LT(5 * now.stats.direct_shadow_rays, rays) << view;
        if (view % 10 != 0) continue;
        const RenderResult single = test::render_view(scene, camera_at(scene, 5 * view), small());
        EXPECT_LT(difference(now, single, "direct"), 1e-3) << view;
    }
}

/// Of a large lamp behind a panel, while the camera moves by two fifths of a pixel from view to view.
TEST(KeptSamples, LeaveEdgesOfShadowsWhereTheyAre)
{
    Scene scene = test::room(0.5f);
    const int black = test::add_material(scene, glm::vec3(0.0f), glm::vec3(0.0f), true);
    test::add_mesh(scene, test::quad({-1.0f, 2.9f, -1.5f}, {1.2f, 0, 0}, {0, 0, 1.2f},
                                     test::add_material(scene, glm::vec3(0.0f), glm::vec3(9.0f))));
    test::add_mesh(scene, test::quad({-1.0f, 1.9f, -1.9f}, {1, 0, 0}, {0, 0, 1.6f}, black));
    for (const int step : {-3, 3}) {
        Walk walk;
        RenderResult last;
        for (int view = 0; view <= 24; ++view) last = walk.show(scene, step * view, small());
        expect_as_good_as_alone(last, scene, step * 24, "direct", 0.002, 1.05);
    }
}

/// A mirror of that roughness in place of the floor: in such ones lobes turn by their width from view to view.
Scene mirror_room(float roughness)
{
    Scene scene = test::furnished_room();
    test::add_mesh(scene, test::quad({-1.99f, 0.01f, -1.99f}, {0, 0, 3.98f}, {3.98f, 0, 0},
                                     test::add_surface(scene, test::metal(roughness))));
    return scene;
}

/// Eight views on, each so many of a walk's steps from the one before: rays along lobes, over those of the first view.
void expect_to_spare_rays_along_lobes(const Scene& scene, int steps, double most_rays)
{
    Walk walk;
    RenderResult last = walk.show(scene, 0, small());
    const auto along_lobes = static_cast<double>(last.stats.traced.rays);
    for (int view = 1; view <= 8; ++view) last = walk.show(scene, steps * view, small());
    EXPECT_LT(static_cast<double>(last.stats.traced.rays), most_rays * along_lobes);
    expect_as_good_as_alone(last, scene, 8 * steps, "indirect", 0.015, 1.25);
}

/// The images in it move with the viewer as what they are of.
TEST(KeptSamples, AlsoServeImagesInMirrors)
{
    const Scene scene = mirror_room(0.02f);
    expect_to_spare_rays_along_lobes(scene, 4, 0.75);
}

/// What is reflected in a mirror with stripes has none.
TEST(KeptSamples, ServeImagesInMirrorsOfAnyPattern)
{
    Scene scene = mirror_room(0.02f);
    scene.materials.back().base_color_texture = test::add_halves(scene, {1, 1, 1, 1}, {0.6f, 0.7f, 0.8f, 1});
    scene.meshes.back().uvs = {{0, 0}, {0, 10}, {10, 10}, {10, 0}};
    expect_to_spare_rays_along_lobes(scene, 4, 0.75);
}

/// Whether looks along lobes pay is found out once, and fewer pixels look.
TEST(KeptSamples, SpareLooksAlongLobes)
{
    const Scene scene = test::screened_room(0.4f);
    const RenderResult one = alone(scene, 12, 2), two = alone(scene, 12, 3);
    double off = 0.0;
    for (const std::uint64_t seed : {1, 4, 5}) {
        Walk walk;
        RenderOptions options = small();
        options.seed = seed;
        RenderResult last = walk.show(scene, 0, options);
        const std::uint64_t looks = last.stats.traced.looks;
        ASSERT_GT(looks, 0u);
        EXPECT_TRUE(walk.session.state().guide->looks_of_lobes.is_sure);
        for (int view = 1; view <= 12; ++view) {
            last = walk.show(scene, view, options);
            EXPECT_GT(last.stats.traced.looks, 0u) << view;
            EXPECT_LT(3 * last.stats.traced.looks, 2 * looks) << view;
        }
        EXPECT_NEAR(mean_of(last, "indirect"), mean_of(one, "indirect"), 0.05 * mean_of(one, "indirect")) << seed;
        off += (difference(last, one, "indirect") + difference(last, two, "indirect")) / 6.0;
    }
    EXPECT_LT(off, 1.05 * difference(two, one, "indirect"));
}

TEST(KeptSamples, OfOtherLobesShowNoImage)
{
    // Polished to the left, worn to the right: what the left shows sharp the right does not.
    Scene scene = mirror_room(1.0f);
    scene.materials.back().metallic_roughness_texture = test::add_halves(scene, {0, 0.02f, 1, 1}, {0, 0.4f, 1, 1});
    scene.meshes.back().uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    Walk walk;
    RenderResult last;
    for (int view = 0; view <= 5; ++view) last = walk.show(scene, 10 * view, small());
    expect_as_good_as_alone(last, scene, 50, "indirect", 0.015, 1.25);
}

/// Half of the floor is rougher than lobes that rays are traced along.
TEST(KeptSamples, WhereNothingWasTracedAreNotBlack)
{
    Scene scene = mirror_room(1.0f);
    scene.materials.back().metallic_roughness_texture = test::add_halves(scene, {0, 0.4f, 1, 1}, {0, 0.7f, 1, 1});
    scene.meshes.back().uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    Walk walk;
    RenderResult last = walk.show(scene, 0, small());
    ASSERT_GT(last.stats.traced.rays, 0u);
    for (int view = 1; view <= 6; ++view) last = walk.show(scene, view, small());
    const RenderResult single = test::render_view(scene, camera_at(scene, 6), small());
    EXPECT_NEAR(mean_of(last, "indirect"), mean_of(single, "indirect"), 0.015 * mean_of(single, "indirect"));
}

/// Stripes some pixels wide, every other one rougher than lobes that rays are traced along: at their edges the rest of
/// four pixels knows what shows.
TEST(KeptSamples, AtEdgesAreThoseOfAlikeLobes)
{
    Scene scene = mirror_room(1.0f);
    scene.materials.back().metallic_roughness_texture = test::add_halves(scene, {0, 0.5f, 1, 1}, {0, 0.8f, 1, 1});
    scene.meshes.back().uvs = {{0, 0}, {0, 9}, {9, 9}, {9, 0}};
    expect_to_spare_rays_along_lobes(scene, 1, 0.4);
}

/// A view that is given up after a pass leaves samples, but the next one draws others.
TEST(KeptSamples, ViewsThatAreGivenUpDrawOthersThanTheNext)
{
    const Scene scene = shining_room();
    Walk walk;
    walk.show(scene, 0, small(2));
    std::vector<std::uint64_t> numbers;
    for (int view = 1; view <= 3; ++view) {
        RenderHooks hooks;
        hooks.progress = [](std::string_view stage, float) { return stage != "compose"; };
        walk.session.show(scene);
        EXPECT_THROW(render(walk.session, camera_at(scene, view), small(2), hooks), Error);
        numbers.push_back(walk.session.state().sampled);
    }
    EXPECT_LT(numbers[0], numbers[1]);
    EXPECT_LT(numbers[1], numbers[2]);
}

TEST(KeptSamples, PassesGoOnFromTheSamePassBefore)
{
    const Scene scene = shining_room();
    RenderOptions options = small(4);
    options.effects.with.set(Effect::anti_aliasing);
    Walk walk;
    const std::uint64_t rays = walk.show(scene, 0, options).stats.direct_shadow_rays;
    walk.show(scene, 1, options);
    const RenderResult last = walk.show(scene, 2, options);
    EXPECT_LT(2 * last.stats.direct_shadow_rays, rays);
    for (const KeptSamples& pass : walk.session.state().samples) EXPECT_EQ(pass.views, 2u) << "views, not passes";
    const RenderResult single = test::render_view(scene, camera_at(scene, 2), options);
    EXPECT_NEAR(mean_of(last, "direct"), mean_of(single, "direct"), 0.01 * mean_of(single, "direct"));
}

/// Nothing flickers where nothing moves.
TEST(KeptSamples, AreAllThereIsToAViewThatStays)
{
    const Scene scene = shining_room();
    for (const int aa : {1, 4}) {
        Walk walk;
        for (int view = 0; view < 2; ++view) walk.show(scene, view, small(aa));
        const RenderResult before = walk.show(scene, 2, small(aa)), now = walk.show(scene, 2, small(aa));
        EXPECT_EQ(difference(now, before, "direct"), 0.0) << aa;
        EXPECT_LT(difference(now, before, "beauty"), 1e-3) << aa << ": further passes may add records";
        EXPECT_EQ(now.stats.direct_shadow_rays, 0u);
    }
}

/// Where a thing that moves is in no lamp's way.
TEST(KeptSamples, OutliveWhatMovesElsewhere)
{
    const auto at = [](int view) {
        Scene scene = test::room(0.5f);
        test::add_mesh(scene, test::quad({-1.0f, 2.9f, -1.5f}, {0.8f, 0, 0}, {0, 0, 0.8f},
                                         test::add_material(scene, glm::vec3(0.0f), glm::vec3(9.0f))));
        test::add_mesh(scene, test::box({0.6f, 0.3f, -1.4f}, {1.0f, 0.7f, -1.0f},
                                        test::add_material(scene, glm::vec3(0.6f)), test::Facing::outwards));
        scene.instances.back().world_from_object[3].x += 0.02 * view;
        return scene;
    };
    Walk walk;
    const std::uint64_t rays = walk.show(at(0), 0, small()).stats.direct_shadow_rays;
    RenderResult last;
    for (int view = 1; view <= 12; ++view) {
        last = walk.show(at(view), view, small());
        EXPECT_LT(2 * last.stats.direct_shadow_rays, rays) << view;
    }
    expect_as_good_as_alone(last, at(12), 12, "direct", 0.002, 1.05);
}

/// Nothing flickers that stands still, also beside what moves: direct light is what each view alone would have.
TEST(KeptSamples, AreThoseOfAViewAloneWhereTheCameraStands)
{
    const auto at = [](int step) {
        Scene scene = shining_room();
        scene.instances[1].world_from_object[3].x += 0.03 * step;
        return scene;
    };
    for (const int aa : {1, 2}) {
        Walk walk;
        const std::uint64_t rays = walk.show(at(0), 0, small(aa)).stats.direct_shadow_rays;
        for (int step = 1; step <= 3; ++step) {
            const RenderResult now = walk.show(at(step), 0, small(aa));
            const RenderResult single = test::render_view(at(step), camera_at(at(step), 0), small(aa));
            EXPECT_EQ(difference(now, single, "direct"), 0.0) << aa << ", " << step;
            EXPECT_LT(now.stats.direct_shadow_rays, rays) << aa << ", " << step;
        }
    }
}

TEST(KeptSamples, AreOfNoUseOnceALampHasChanged)
{
    const RenderOptions options = small();
    Walk walk;
    const std::uint64_t rays = walk.show(shining_room(6.0f), 0, options).stats.direct_shadow_rays;
    walk.show(shining_room(6.0f), 1, options);
    const RenderResult now = walk.show(shining_room(2.0f), 2, options);
    EXPECT_GT(now.stats.direct_shadow_rays, rays * 9 / 10);
    const RenderResult single = test::render_view(shining_room(2.0f), camera_at(shining_room(), 2), options);
    EXPECT_NEAR(mean_of(now, "direct"), mean_of(single, "direct"), 0.01 * mean_of(single, "direct"));
}

TEST(KeptSamples, AreNotThoseOfAnotherSeed)
{
    const Scene scene = shining_room();
    Walk walk;
    RenderOptions options = small();
    const RenderResult first = walk.show(scene, 0, options);
    options.seed = 2;
    EXPECT_GT(difference(walk.show(scene, 0, options), first, "direct"), 0.0);
}

TEST(KeptSamples, AreOfNoUseToViewsThatSampleOtherwise)
{
    RenderOptions options = small();
    Walk walk;
    const std::uint64_t rays = walk.show(shining_room(), 0, options).stats.direct_shadow_rays;
    options.bounces = 2;
    EXPECT_GT(walk.show(shining_room(), 0, options).stats.direct_shadow_rays, rays * 9 / 10);
}

TEST(KeptSamples, AreKeptByNoSessionWhoseViewsShareNothing)
{
    const Scene scene = shining_room();
    Walk walk(2, false);
    walk.show(scene, 0, small());
    const RenderResult second = walk.show(scene, 1, small()),
                       single = test::render_view(scene, camera_at(scene, 1), small());
    EXPECT_TRUE(second.image.layers.at("beauty").pixels == single.image.layers.at("beauty").pixels);
}

TEST(KeptSamples, GiveTheSameBitsByAnyNumberOfThreads)
{
    const Scene scene = shining_room();
    Walk one(1), three(3);
    for (int view = 0; view < 3; ++view) {
        const RenderResult a = one.show(scene, view, small()), b = three.show(scene, view, small());
        EXPECT_TRUE(a.image.layers.at("beauty").pixels == b.image.layers.at("beauty").pixels) << view;
    }
}

TEST(KeptSamples, TellOfTheirError)
{
    const Scene scene = shining_room();
    Walk walk;
    for (int view = 0; view < 12; ++view) walk.show(scene, view, small());
    const RenderResult last = walk.show(scene, 12, small());
    const RenderResult single = test::render_view(scene, camera_at(scene, 12), small());
    const auto told = [](const RenderResult& result) { return result.stats.errors.image.mean_relative; };
    EXPECT_GT(told(last), 0.6 * told(single));
    EXPECT_LT(told(last), 1.3 * told(single));
}

}  // namespace
}  // namespace rcs
