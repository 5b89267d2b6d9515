#include <bit>
#include <cstring>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "gbuffer/shading.h"
#include "gbuffer/views.h"
#include "rcs/render.h"
#include "support/effect_scenes.h"
#include "support/session.h"

namespace rcs {
namespace {

using test::add_halves;
using test::add_material;
using test::add_mesh;
using test::add_surface;
using test::lit_room;
using test::metal;
using test::panel;
using test::panel_room;

/// Two samples in all pixels, smooth or not.
RenderOptions small(int size = 48)
{
    RenderOptions options;
    options.width = options.height = size;
    options.aa = 2;
    options.effects.with.set(Effect::anti_aliasing);
    return options;
}

RenderResult render_with(const Scene& scene, const RenderOptions& options, const Camera& camera)
{
    return test::render_view(scene, camera, options);
}

RenderResult render_with(const Scene& scene, const RenderOptions& options = small())
{
    return render_with(scene, options, scene.cameras.at(0));
}

RenderOptions all(RenderOptions options)
{
    options.effects = parse_effects("all");
    return options;
}

/// Bit by bit; NaN equals itself. @param but  a layer that may differ
void expect_same(const LayeredImage& a, const LayeredImage& b, const std::string& but = "")
{
    for (const auto& [name, layer] : a.layers) {
        if (name == but) continue;
        ASSERT_TRUE(b.layers.contains(name)) << name;
        const std::vector<float>& other = b.layers.at(name).pixels;
        ASSERT_EQ(layer.pixels.size(), other.size()) << name;
        std::size_t different = 0;
        for (std::size_t i = 0; i < other.size(); ++i)
            different +=
                layer.pixels[i] != other[i] && !(layer.pixels[i] != layer.pixels[i] && other[i] != other[i]) ? 1 : 0;
        EXPECT_EQ(different, 0u) << name;
    }
}

double most_loss(const EffectPlan& plan)
{
    double loss = 0.0;
    for (const PlannedEffect& e : plan.effects) loss = std::max(loss, e.loss);
    return loss;
}

bool uses_shader(const EffectCounts& counts, const char* define)
{
    return std::any_of(counts.shaders.begin(), counts.shaders.end(),
                       [&](const std::string& s) { return s.find(define) != std::string::npos; });
}

TEST(EffectRender, ADiffuseRoomDoesNothingForGlossAlphaOrSky)
{
    for (const SplatMethod method : {SplatMethod::tiles, SplatMethod::quads}) {
        RenderOptions options = small();
        options.splat = method;
        const RenderResult r = render_with(lit_room(), options);
        const EffectCounts& n = r.stats.counts;
        EXPECT_GT(n.punctual_rays, 0u);
        EXPECT_GT(n.hit_lamp_rays, 0u);
        EXPECT_GT(n.splats, 0u);
        EXPECT_GT(n.record_bytes, 0u);
        EXPECT_EQ(uses_shader(n, "RCS_SPLAT_ERRORS"), method == SplatMethod::quads);
        EXPECT_EQ(n.area_rays + n.peak_rays + n.highlight_rays + n.hit_sky_rays, 0u);
        EXPECT_EQ(n.alpha_tests + n.peeled_layers + n.hit_textures + n.normal_maps, 0u);
        EXPECT_EQ(n.shading_bytes + n.radiance_bytes + n.glossy_splats + n.lobe_passes, 0u);
        EXPECT_EQ(r.stats.traced.rays + r.stats.traced.shadow_rays + r.stats.light_cache.rays, 0u);
        EXPECT_FALSE(uses_shader(n, "RCS_SPLAT_GLOSSY"));
        // All of it is there where it is asked for.
        const EffectCounts m = render_with(lit_room(), all(options)).stats.counts;
        EXPECT_GT(m.hit_sky_rays, 0u);
        EXPECT_GT(m.shading_bytes, 0u);
        EXPECT_GT(m.radiance_bytes, 0u);
        EXPECT_GT(m.glossy_splats, 0u);
        EXPECT_GT(m.lobe_passes, 0u);
        EXPECT_EQ(uses_shader(m, "RCS_SPLAT_GLOSSY"), method == SplatMethod::quads);
        EXPECT_EQ(n.gl_bytes < m.gl_bytes, method == SplatMethod::quads);
    }
}

TEST(EffectRender, WhatDoesNotReflectCostsAGBuffer)
{
    Scene unlit = lit_room();
    unlit.materials[0].unlit = true;
    Scene dark = test::room(0.5f);
    Scene shining;
    add_mesh(shining, test::box({-2, 0, -2}, {2, 3, 2}, add_material(shining, glm::vec3(0.0f), glm::vec3(1.0f)),
                                test::Facing::inwards));
    shining.cameras = dark.cameras;
    for (const Scene* scene : {&unlit, &dark, &shining}) {
        const RenderResult r = render_with(*scene);
        const EffectCounts& n = r.stats.counts;
        EXPECT_EQ(n.gbuffers, 2u);
        EXPECT_EQ(n.direct_passes + n.splats + n.glossy_splats + n.lobe_passes + n.error_passes, 0u);
        EXPECT_EQ(n.punctual_rays + n.area_rays + n.hit_lamp_rays + n.hit_sky_rays + n.record_bytes, 0u);
        EXPECT_EQ(r.stats.records.hemisphere_rays + r.stats.records.shadow_rays, 0u);
        // The one difference is the number of records, which bring nothing.
        expect_same(r.image, render_with(*scene, all(small())).image, "records");
    }
}

TEST(EffectRender, NarrowLobesTakeNoRadianceAndWideOnesNoRays)
{
    const RenderResult mirror = render_with(panel_room(metal(0.0f)));
    EXPECT_GT(mirror.stats.traced.rays, 0u);
    EXPECT_EQ(mirror.stats.counts.radiance_bytes + mirror.stats.counts.glossy_splats, 0u);
    EXPECT_GT(mirror.stats.counts.shading_bytes, 0u);
    const RenderResult rough = render_with(panel_room(metal(0.8f)));
    EXPECT_EQ(rough.stats.traced.rays + rough.stats.counts.lobe_passes, 0u);
    EXPECT_GT(rough.stats.counts.radiance_bytes, 0u);
}

Scene masked(float left, float right)
{
    Scene scene = lit_room();
    Material material;
    material.base_color = glm::vec3(0.5f);
    material.alpha_mode = AlphaMode::mask;
    material.double_sided = true;
    material.base_color_texture = add_halves(scene, {1, 1, 1, left}, {1, 1, 1, right});
    add_mesh(scene, panel(add_surface(scene, material)));
    return scene;
}

TEST(EffectRender, RaysAskOnlySurfacesThatMayLetThemThrough)
{
    EXPECT_GT(render_with(masked(1.0f, 0.0f)).stats.counts.alpha_tests, 0u);
    const RenderResult opaque = render_with(masked(1.0f, 1.0f));
    EXPECT_EQ(opaque.stats.counts.alpha_tests, 0u);
    EXPECT_EQ(opaque.stats.counts.shading_bytes, 0u);
    const RenderResult asked = render_with(masked(1.0f, 1.0f), all(small()));
    EXPECT_GT(asked.stats.counts.alpha_tests, 0u);
    expect_same(opaque.image, asked.image);

    RenderOptions without = small();
    without.effects.without.set(Effect::alpha_mask);
    const RenderResult closed = render_with(masked(1.0f, 0.0f), without);
    EXPECT_EQ(closed.stats.counts.alpha_tests + closed.stats.counts.peeled_layers, 0u);
}

TEST(EffectRender, FetchesAtHitsOnlyWhatVaries)
{
    const auto textured = [](glm::vec4 left, glm::vec4 right) {
        Scene scene = lit_room();
        Material material;
        material.base_color_texture = add_halves(scene, left, right);
        Mesh carpet = test::quad({-1.0f, 0.01f, -1.9f}, {0, 0, 1.8f}, {2, 0, 0}, add_surface(scene, material));
        carpet.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
        add_mesh(scene, carpet);
        return scene;
    };
    EXPECT_GT(render_with(textured({1, 0, 0, 1}, {0, 1, 0, 1})).stats.counts.hit_textures, 0u);
    const Scene uniform = textured({0.8f, 0.3f, 0.1f, 1}, {0.8f, 0.3f, 0.1f, 1});
    const RenderResult r = render_with(uniform);
    EXPECT_EQ(r.stats.counts.hit_textures, 0u);
    const RenderResult fetched = render_with(uniform, all(small()));
    EXPECT_GT(fetched.stats.counts.hit_textures, 0u);
    expect_same(r.image, fetched.image);

    RenderOptions means = small();
    means.effects.without.set(Effect::hit_textures);
    EXPECT_EQ(render_with(textured({1, 0, 0, 1}, {0, 1, 0, 1}), means).stats.counts.hit_textures, 0u);
}

TEST(EffectRender, NormalMapsAreFetchedWhereTheyTurnNormals)
{
    const auto bumpy = [](float x) {
        Scene scene = lit_room();
        Material material;
        material.normal_texture = add_halves(scene, {0.5f, 0.5f, 1, 1}, {x, 0.5f, 1, 1});
        add_mesh(scene, panel(add_surface(scene, material)));
        return scene;
    };
    EXPECT_GT(render_with(bumpy(0.8f)).stats.counts.normal_maps, 0u);
    EXPECT_EQ(render_with(bumpy(0.5f)).stats.counts.normal_maps, 0u);
    RenderOptions without = small();
    without.effects.without.set(Effect::normal_maps);
    EXPECT_EQ(render_with(bumpy(0.8f), without).stats.counts.normal_maps, 0u);
}

TEST(EffectRender, WithoutAnEstimateNothingIsSummedForIt)
{
    for (const SplatMethod method : {SplatMethod::tiles, SplatMethod::quads}) {
        RenderOptions options = small();
        options.splat = method;
        const RenderResult with = render_with(lit_room(), options);
        options.effects.without.set(Effect::error_estimate);
        const RenderResult r = render_with(lit_room(), options);
        EXPECT_EQ(r.stats.counts.error_passes, 0u);
        EXPECT_EQ(r.stats.errors.indirect.mean_relative, 0.0);
        EXPECT_FALSE(uses_shader(r.stats.counts, "RCS_SPLAT_ERRORS"));
        EXPECT_EQ(r.stats.counts.gl_bytes < with.stats.counts.gl_bytes, method == SplatMethod::quads);
        const std::vector<float>&a = with.image.layers.at("beauty").pixels, &b = r.image.layers.at("beauty").pixels;
        EXPECT_EQ(a, b);
    }
}

TEST(EffectRender, LayersThatNobodyKeepsAreNotMade)
{
    RenderOptions options = small();
    const RenderResult everything = render_with(lit_room(), options);
    options.layers = std::vector<std::string>{"normal"};
    const RenderResult r = render_with(lit_room(), options);
    EXPECT_EQ(r.image.layers.size(), 2u);
    EXPECT_EQ(r.image.layers.at("normal").pixels, everything.image.layers.at("normal").pixels);
    EXPECT_EQ(r.image.layers.at("beauty").pixels, everything.image.layers.at("beauty").pixels);
    EXPECT_EQ(r.stats.counts.layer_bytes, 48u * 48u * (4u + 3u) * sizeof(float));
    EXPECT_EQ(r.stats.errors.indirect.mean_relative, everything.stats.errors.indirect.mean_relative);
}

TEST(EffectRender, AnEmptyViewIsOnePass)
{
    Scene scene;
    scene.sky_radiance = glm::vec3(0.3f);
    scene.cameras = {look_at_camera("camera", {0, 0, 0}, {0, 0, -1}, 0.8)};
    RenderOptions options = small();
    options.effects = {};
    const RenderResult r = render_with(scene, options);
    EXPECT_EQ(r.stats.counts.gbuffers, 1u);
    expect_same(r.image, render_with(scene, all(small())).image);
}

/// The mean difference of a layer is at most a part of its light.
void expect_within(const LayeredImage& image, const LayeredImage& whole, const char* layer, double part)
{
    const std::vector<float>&a = image.layers.at(layer).pixels, &b = whole.layers.at(layer).pixels;
    double difference = 0.0, light = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        difference += std::abs(static_cast<double>(a[i]) - static_cast<double>(b[i]));
        light += static_cast<double>(b[i]);
    }
    EXPECT_LE(difference, part * light) << layer;
}

/// Changes by no more than the plan says; not at all where it says that nothing is lost.
void expect_true_plan(const Scene& scene, const Camera& camera, int bounces)
{
    RenderOptions options = small();
    options.bounces = bounces;
    const RenderResult planned = render_with(scene, options, camera);
    const RenderResult whole = render_with(scene, all(options), camera);
    const double loss = most_loss(planned.stats.plan);
    if (loss == 0.0)
        expect_same(planned.image, whole.image);
    else
        expect_within(planned.image, whole.image, "indirect", loss);
    // Anti-aliasing only where it shows.
    options.effects = {};
    const RenderResult shared = render_with(scene, options, camera);
    expect_within(shared.image, whole.image, "beauty", std::max(loss, most_loss(shared.stats.plan)));
}

TEST(EffectRender, AllChangesNoBuiltInScene)
{
    for (const std::string& name : demo_scene_names()) {
        const Scene scene = load_scene(name);
        SCOPED_TRACE(name);
        expect_true_plan(scene, scene.cameras[0], 1);
        if (name == "demo:spheres" || name == "demo:sphere-light") expect_true_plan(scene, scene.cameras[0], 3);
    }
}

TEST(EffectRender, AllChangesNoSharedScene)
{
    const std::filesystem::path folder(RCS_SCENES_DIR);
    if (!std::filesystem::exists(folder / "sponza.glb")) GTEST_SKIP() << folder << " has no sponza.glb";
    for (const char* file : {"cornell-box.glb", "cornell-box-draco.glb", "cornell-animated.glb", "sponza.glb",
                             "sibenik.glb", "castle.glb"}) {
        const Scene scene = load_scene(folder / file);
        for (const Camera& camera : scene.cameras) {
            SCOPED_TRACE(std::string(file) + ", " + camera.name);
            expect_true_plan(scene, camera, 1);
        }
    }
}

TEST(EffectRender, BouncesLeftOutStayWithinTheirBound)
{
    // The same light everywhere, so that the part of the power is the part of every pixel.
    const Scene scene = test::lit_sphere(0.1f);
    RenderOptions options = small();
    options.bounces = 16;
    const RenderResult r = render_with(scene, options);
    EXPECT_EQ(r.stats.plan.bounces, 4);
    EXPECT_GT(most_loss(r.stats.plan), 0.0);
    expect_true_plan(scene, scene.cameras[0], 16);
}

/// Two rooms, one behind the other, with a door between them at x in [0, 1]; a mirror in the second one.
Scene two_rooms()
{
    Scene scene;
    const int wall = add_material(scene, glm::vec3(0.5f), glm::vec3(0.0f), true);
    add_mesh(scene, test::box({-3, 0, -8}, {3, 3, 3}, wall, test::Facing::inwards));
    add_mesh(scene, test::quad({-3, 0, -2}, {3, 0, 0}, {0, 3, 0}, wall));
    add_mesh(scene, test::quad({1, 0, -2}, {2, 0, 0}, {0, 3, 0}, wall));
    add_mesh(scene, test::quad({-2.5f, 0.8f, -7}, {1.2f, 0, 0}, {0, 1.4f, 0}, add_surface(scene, metal(0.0f))));
    scene.lights = {test::point_light({-1.0, 2.6, 1.0}, glm::vec3(4.0f)),
                    test::point_light({0.5, 2.6, -5.0}, glm::vec3(4.0f))};
    return scene;
}

TEST(EffectRender, AWalkIntoARoomWithAMirror)
{
    const Scene scene = two_rooms();
    constexpr int kFrames = 10;
    const RenderOptions options = small(40);
    ThreadPool pool(2);
    Session session(test::shared_gl(), pool);
    session.show(scene);
    int first_seen = -1, first_planned = -1, outside = 0, hidden = 0;
    for (int frame = 0; frame < kFrames; ++frame) {
        SCOPED_TRACE(frame);
        // At first the door is out of sight, then the wall hides the mirror, then the camera goes through the door.
        const double t = static_cast<double>(frame) / (kFrames - 1);
        const glm::dvec3 eye(-2.0 + 2.6 * std::min(1.0, 1.5 * t), 1.5, 2.5 - 6.0 * std::max(0.0, t - 0.3));
        const glm::dvec3 target = frame == 0 ? glm::dvec3(-2.0, 1.5, 5.0) : glm::dvec3(-1.9, 1.5, -7.0);
        const Camera camera = look_at_camera("walk", eye, target, 0.9);
        bool seen = false;
        for (const View& view : make_views(camera, options.width, options.height, options.aa)) {
            const GBuffer g = render_gbuffer(session.gl(), session.rays(options.effects), view, 1.0f, pool);
            for (std::size_t i = 0; i < g.size(); ++i) seen = seen || g.instance[i] == 3u;
        }
        const RenderResult auto_frame = render(session, camera, options);
        const PlannedEffect& lobes = auto_frame.stats.plan[Effect::traced_lobes];
        EXPECT_EQ(lobes.needed, seen) << lobes.reason;
        EXPECT_EQ(auto_frame.stats.traced.rays > 0, seen);
        outside += lobes.reason.find("lies in the view") != std::string::npos ? 1 : 0;
        hidden += lobes.reason.find("none of the picture's samples") != std::string::npos ? 1 : 0;
        if (seen && first_seen < 0) first_seen = frame;
        if (lobes.needed && first_planned < 0) first_planned = frame;
        // No jump: each frame is what it would be with everything on.
        RenderOptions everything = options;
        everything.effects = parse_effects("all");
        expect_same(auto_frame.image, render_with(scene, everything, camera).image);
    }
    EXPECT_EQ(first_planned, first_seen);
    EXPECT_GT(first_seen, 1);
    EXPECT_GT(outside, 0);
    EXPECT_GT(hidden, 0);
}

}  // namespace
}  // namespace rcs
