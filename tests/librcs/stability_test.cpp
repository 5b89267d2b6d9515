// The stability suite as tests: one for each case that rcsplat doctor runs, quick ones here, the others labelled slow.
#include "rcs/stability.h"

#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "rcs/error.h"
#include "stability/export_glb.h"
#include "stability/scenes.h"
#include "support/temporary_folder.h"

namespace rcs {
namespace {

GlContext& gl()
{
    static GlContext context;
    return context;
}

std::vector<StabilityCase> cases_here()
{
    std::vector<StabilityCase> chosen;
    for (const StabilityCase& c : stability_cases())
        if (c.quick == RCS_QUICK_CASES) chosen.push_back(c);
    return chosen;
}

class Stability : public testing::TestWithParam<StabilityCase> {};

TEST_P(Stability, Holds)
{
    ThreadPool pool(2);
    const StabilityOutcome outcome = run_stability_case({gl(), pool, RCS_BIN_DIR "/rcsplat", ""}, GetParam().id);
    if (outcome.verdict == StabilityVerdict::skipped) GTEST_SKIP() << outcome.measured;
    EXPECT_EQ(outcome.verdict, StabilityVerdict::passed)
        << GetParam().name << ": " << GetParam().expectation << "\nfigure " << outcome.figure << " of at most "
        << GetParam().tolerance << ": " << outcome.measured;
    RecordProperty("figure", std::to_string(outcome.figure));
}

INSTANTIATE_TEST_SUITE_P(Cases, Stability, testing::ValuesIn(cases_here()),
                         [](const auto& row) { return row.param.id; });

#if RCS_QUICK_CASES
TEST(StabilityCatalogue, EveryRowSaysWhatItExpectsAndWhy)
{
    std::set<std::string> ids;
    for (const StabilityCase& c : stability_cases()) {
        EXPECT_TRUE(ids.insert(c.id).second) << c.id << " is there twice";
        for (const std::string& words : {c.group, c.name, c.hazard, c.expectation, c.reason})
            EXPECT_FALSE(words.empty()) << c.id;
        EXPECT_GE(c.tolerance, 0.0) << c.id;
    }
    for (const StabilityCase& c : metamorphic_cases()) EXPECT_FALSE(c.name.empty() || c.reason.empty()) << c.id;
    EXPECT_GE(ids.size(), 50u);
}

TEST(StabilityCatalogue, NamesTheCasesThatThereAre)
{
    ThreadPool pool(1);
    try {
        run_stability_case({gl(), pool, "", ""}, "Z9");
        FAIL() << "a case that does not exist has run";
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), ErrorCode::not_found);
        EXPECT_NE(std::string(e.what()).find("A1, A2"), std::string::npos) << e.what();
    }
}

class Metamorphic : public testing::TestWithParam<StabilityCase> {};

TEST_P(Metamorphic, HoldsForARoom)
{
    ThreadPool pool(2);
    RenderOptions options;
    options.width = options.height = 64;
    options.aa = 1;
    settings_of(options).rays = 512;
    options.area_samples = options.penumbra_samples = 64;
    const Scene scene = stability::furnished_room();
    Camera camera = scene.cameras[0];
    camera.lens_shift = {0.2, -0.1};
    const StabilityOutcome outcome = run_metamorphic_case({gl(), pool, "", ""}, GetParam().id, scene, camera, options);
    EXPECT_EQ(outcome.verdict, StabilityVerdict::passed) << outcome.figure << ": " << outcome.measured;
}

INSTANTIATE_TEST_SUITE_P(Cases, Metamorphic, testing::ValuesIn(metamorphic_cases()),
                         [](const auto& row) { return row.param.id; });

TEST(StabilityReproducer, HoldsTheScenePicturesAndTheCommand)
{
    // A picture so coarse that a turned scene does not look the same.
    const test::TemporaryFolder folder;
    ThreadPool pool(2);
    RenderOptions options;
    options.width = 8;
    options.height = 6;
    options.aa = 1;
    settings_of(options).rays = 16;
    settings_of(options).noise_target = 1.0f;
    const Scene scene = load_scene("demo:atrium");
    Camera camera = scene.cameras[0];
    camera.lens_shift = {0.25, 0.0};
    const StabilityOutcome outcome =
        run_metamorphic_case({gl(), pool, "", folder.path()}, "rotate", scene, camera, options);
    ASSERT_EQ(outcome.verdict, StabilityVerdict::failed) << outcome.figure;
    EXPECT_EQ(outcome.saved, folder / "rotate");
    const std::string page = test::bytes_of(folder / "rotate/README.md");
    EXPECT_NE(page.find("rcsplat render scene.glb"), std::string::npos) << page;
    EXPECT_NE(page.find("--size 8x6 --lens-shift 0.25,0"), std::string::npos) << page;
    EXPECT_FALSE(test::bytes_of(folder / "rotate/0.exr").empty());
    EXPECT_EQ(load_scene(folder / "rotate/scene.glb").instances.size(), scene.instances.size());
}

TEST(ExportGlb, GivesBackTheScene)
{
    const test::TemporaryFolder folder;
    Scene scene = stability::furnished_room();
    scene.lights[0].kind = LightKind::spot;
    scene.lights[0].direction = {0, -1, 0};
    scene.lights[0].inner_cone = 0.25f;
    EXPECT_EQ(stability::export_glb(scene, folder / "room.glb"), "");
    const Scene back = load_scene(folder / "room.glb");
    ASSERT_EQ(back.meshes.size(), scene.meshes.size());
    for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
        EXPECT_EQ(back.meshes[i].positions, scene.meshes[i].positions);
        EXPECT_EQ(back.meshes[i].triangles, scene.meshes[i].triangles);
    }
    ASSERT_EQ(back.lights.size(), 1u);
    EXPECT_EQ(back.lights[0].intensity, scene.lights[0].intensity);
    EXPECT_EQ(back.lights[0].inner_cone, scene.lights[0].inner_cone);
    EXPECT_LT(glm::distance(back.lights[0].direction, scene.lights[0].direction), 1e-12);
    EXPECT_EQ(back.cameras[0].yfov, scene.cameras[0].yfov);
    for (std::size_t i = 0; i < scene.materials.size(); ++i)
        for (int c = 0; c < 3; ++c) {
            EXPECT_FLOAT_EQ(back.materials[i].emission[c], scene.materials[i].emission[c]);
            EXPECT_EQ(back.materials[i].base_color[c], scene.materials[i].base_color[c]);
        }
    scene.sky_radiance = glm::vec3(1.0f);
    EXPECT_NE(stability::export_glb(scene, folder / "room.glb").find("sky"), std::string::npos);
}
#endif

}  // namespace
}  // namespace rcs
