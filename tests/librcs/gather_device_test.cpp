// Gathers whose rays a graphics device traces against those of the processor.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "device/ray_caster.h"
#include "gbuffer/shading.h"
#include "gbuffer/views.h"
#include "rcs/error.h"
#include "rcs/metrics.h"
#include "rcs/option_table.h"
#include "rcs/scene_choice.h"
#include "records/gather_choice.h"
#include "support/effect_scenes.h"
#include "support/session.h"
#include "support/temporary_folder.h"

namespace rcs {
namespace {

/// A part of what the device's records are off by.
struct Agreement {
    double irradiance = 0.0;  ///< of records: those within 1e-4 relative
    double gradients = 0.0;   ///< ... within 1e-3 of the longer of gradient and irradiance over distance
    std::size_t records = 0;
};

bool within(glm::vec3 a, glm::vec3 b, float tolerance, float floor)
{
    return glm::length(a - b) <= tolerance * std::max(glm::length(a), floor);
}

Agreement compare(const std::vector<Record>& expected, const std::vector<Record>& got)
{
    Agreement result;
    result.records = expected.size();
    for (std::size_t i = 0; i < expected.size(); ++i) {
        const Record &a = expected[i], &b = got[i];
        const double share = 1.0 / static_cast<double>(expected.size());
        if (within(a.irradiance, b.irradiance, 1e-4f, 0.0f)) result.irradiance += share;
        bool close = true;
        for (std::size_t c = 0; c < 3; ++c) {
            const float e = a.irradiance[static_cast<glm::length_t>(c)];
            close = close && within(a.rotation_gradient[c], b.rotation_gradient[c], 1e-3f, e) &&
                    within(a.translation_gradient[c], b.translation_gradient[c], 1e-3f, e / a.harmonic_mean_distance);
        }
        if (close) result.gradients += share;
    }
    return result;
}

/// Records at all of the first camera's pixels that see something. @param side  a quarter of the picture's width [px]
Agreement agreement(const Scene& scene, int side)
{
    ThreadPool pool(2);
    const RayScene rays = build_ray_scene(scene, pool);
    const View view = make_views(scene.cameras.at(0), 4 * side, 3 * side, 1)[0];
    const GBuffer gbuffer = render_gbuffer(test::shared_gl(), rays, view, 1.0f, pool);
    std::vector<std::uint32_t> pixels;
    for (std::uint32_t p = 0; p < gbuffer.size(); ++p)
        if (gbuffer.covered(p)) pixels.push_back(p);
    RecordSettings settings;
    RecordStats stats, on_device;
    RayCaster caster(test::shared_gl(), rays);
    const auto expected = gather_records(LitScene(rays), gbuffer, pixels, settings, pool, stats);
    const auto got =
        gather_records(LitScene(rays, nullptr, nullptr, nullptr, &caster), gbuffer, pixels, settings, pool, on_device);
    EXPECT_TRUE(caster.works());
    EXPECT_GE(caster.counts().rays, stats.hemisphere_rays);
    EXPECT_EQ(stats.hemisphere_rays, on_device.hemisphere_rays);
    // Roundings decide rarely, leaves that let rays through less so.
    EXPECT_LT(caster.counts().asked, caster.counts().rays / 10);
    return compare(expected, got);
}

void expect_agreement(const Scene& scene, const std::string& name, int side = 10)
{
    const Agreement found = agreement(scene, side);
    EXPECT_GT(found.records, 100u) << name;
    EXPECT_GE(found.irradiance, 0.999) << name;
    EXPECT_GE(found.gradients, 0.999) << name;
}

Scene scaled(Scene scene, double factor)
{
    for (Instance& instance : scene.instances)
        instance.world_from_object = glm::dmat4(glm::dmat3(factor)) * instance.world_from_object;
    for (Instance& instance : scene.instances) instance.world_from_object[3].w = 1.0;
    for (Camera& camera : scene.cameras) camera.world_from_view[3] *= glm::dvec4(factor, factor, factor, 1.0);
    scene.lights.clear();
    scene.sky_radiance = glm::vec3(1.0f, 2.0f, 3.0f);
    return scene;
}

/// Boxes that share a mesh: turned, stretched, mirrored.
Scene boxes()
{
    Scene scene = test::lit_room();
    const int red = test::add_material(scene, {0.7f, 0.2f, 0.1f});
    test::add_mesh(scene, test::box({-0.3f, 0.0f, -0.3f}, {0.3f, 0.8f, 0.3f}, red, test::Facing::outwards));
    for (int i = 0; i < 5; ++i) {
        Instance copy = scene.instances.back();
        const double turn = 0.7 * i, mirror = i % 2 == 0 ? -1.0 : 1.0;
        copy.world_from_object =
            glm::dmat4(mirror * std::cos(turn), 0.0, -mirror * std::sin(turn), 0.0, 0.0, 0.5 + 0.3 * i, 0.0, 0.0,
                       std::sin(turn), 0.0, std::cos(turn), 0.0, -1.4 + 0.6 * i, 0.0, -1.2, 1.0);
        scene.instances.push_back(copy);
    }
    return scene;
}

Scene veils()
{
    Scene scene = test::lit_room();
    const TextureSlot halves = test::add_halves(scene, glm::vec4(1.0f), glm::vec4(1.0f, 1.0f, 1.0f, 0.0f));
    Material mask, blend, glass;
    mask.alpha_mode = AlphaMode::mask;
    mask.base_color_texture = halves;
    blend.alpha_mode = AlphaMode::blend;
    blend.alpha = 0.4f;
    glass.transmission = 1.0f;
    glass.base_color = {0.9f, 0.5f, 0.2f};
    float z = -1.0f;
    for (const Material& material : {mask, blend, glass})
        test::add_mesh(scene, test::panel(test::add_surface(scene, material), z += 0.4f));
    return scene;
}

TEST(GatherDevice, RecordsAgreeInBuiltInScenes)
{
    for (const std::string& name : demo_scene_names()) expect_agreement(load_scene(name), name);
}

TEST(GatherDevice, RecordsAgreeInSharedScenes)
{
    const std::filesystem::path folder = RCS_SCENES_DIR;
    if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no shared scenes";
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        if (entry.path().extension() != ".glb") continue;
        expect_agreement(load_scene(entry.path().string()), entry.path().filename().string(), 16);
    }
}

TEST(GatherDevice, RecordsAgreeWithInstancesAndVeils)
{
    expect_agreement(boxes(), "boxes");
    expect_agreement(veils(), "veils");
}

TEST(GatherDevice, RecordsAgreeAtAnyScale)
{
    for (const double factor : {1e-3, 1e3})
        expect_agreement(scaled(boxes(), factor), "boxes times " + std::to_string(factor));
}

RenderOptions options_with(GatherMethod method)
{
    RenderOptions options = test::options_of_size(64, 48, 1);
    options.gather = method;
    return options;
}

TEST(GatherDevice, PicturesAgreeAndAreTheSameBitsEachTime)
{
    for (const Scene& scene : {load_scene("demo:cornell"), load_scene("demo:atrium"), boxes(), veils()}) {
        const RenderResult expected = test::render_first(scene, options_with(GatherMethod::processor));
        const RenderResult got = test::render_first(scene, options_with(GatherMethod::device));
        const RenderResult again = test::render_first(scene, options_with(GatherMethod::device), 1);
        EXPECT_EQ(expected.stats.gather_method, "cpu");
        EXPECT_EQ(got.stats.gather_method, "gpu");
        EXPECT_EQ(got.image.metadata.at("rcs:gather"), "gpu");
        const Image& picture = got.image.layers.at("beauty");
        EXPECT_LE(compare_images(got.image, expected.image).mean_relative_error, 0.002) << scene.name;
        EXPECT_EQ(picture.pixels, again.image.layers.at("beauty").pixels) << scene.name;
    }
}

TEST(GatherDevice, AutomaticIsTheProcessorOnASoftwareGL)
{
    if (!test::shared_gl().software()) GTEST_SKIP() << "a hardware GL";
    ThreadPool pool(2);
    const GatherChoice choice = choose_gather(test::shared_gl(), pool);
    EXPECT_FALSE(choice.on_device);
    EXPECT_NE(choice.why.find("software"), std::string::npos) << choice.why;
    const RenderResult result = test::render_first(boxes(), options_with(GatherMethod::automatic));
    EXPECT_EQ(result.stats.gather_method, "cpu");
}

TEST(GatherDevice, AMeasurementIsKeptInTheCacheFolder)
{
    const test::TemporaryFolder folder;
    ::setenv("XDG_CACHE_HOME", (folder / "cache").c_str(), 1);
    ThreadPool pool(2);
    const GatherChoice first = choose_gather(test::shared_gl(), pool, true);
    const GatherChoice second = choose_gather(test::shared_gl(), pool, true);
    EXPECT_NE(first.why.find("measured now"), std::string::npos) << first.why;
    EXPECT_NE(second.why.find("measured before"), std::string::npos) << second.why;
    EXPECT_EQ(first.on_device, second.on_device);
    // What it says decides.
    const std::string path = folder / "cache/rcsplat/gathers";
    std::ifstream kept(path);
    std::string key;
    kept >> key;
    std::ofstream(path) << key << " 10.0 100.0\n";
    EXPECT_TRUE(choose_gather(test::shared_gl(), pool, true).on_device);
    std::ofstream(path) << "no number\n";
    EXPECT_NE(choose_gather(test::shared_gl(), pool, true).why.find("measured now"), std::string::npos);
    ::unsetenv("XDG_CACHE_HOME");
}

TEST(GatherDevice, OptionsThatAreNoneAreRefused)
{
    const auto words = [](const char* key, const char* text) {
        RenderOptions options;
        try {
            set_from_text(find_option(key), options, text);
        } catch (const Error& e) {
            return std::string(e.what());
        }
        return std::string();
    };
    EXPECT_EQ(words("gather", "tpu"), "gather is tpu, expected one of auto, cpu, gpu");
    EXPECT_EQ(words("gather", "gpu"), "");
    EXPECT_EQ(words("device", "64"), "device is 64, expected a whole number in [-1, 63]");
}

TEST(GatherDevice, ADeviceThatIsNotThereIsOneError)
{
    ThreadPool pool(1);
    Session session;
    session.show(boxes());
    RenderOptions options = options_with(GatherMethod::processor);
    options.device = 63;
    try {
        render(session, boxes().cameras[0], options);
        FAIL() << "there are 64 devices";
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), ErrorCode::bad_argument);
        EXPECT_NE(std::string(e.what()).find("device is 63"), std::string::npos) << e.what();
        for (const std::string& name : gl_devices())
            EXPECT_NE(std::string(e.what()).find(name), std::string::npos) << e.what();
    }
}

}  // namespace
}  // namespace rcs
