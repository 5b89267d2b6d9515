// Scale and place (rows D1 and D2 of the suite) on the scenes that the project is judged by, not on toys alone.
#include <cmath>
#include <filesystem>
#include <functional>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "rcs/ray_scene.h"
#include "rcs/stability.h"
#include "stability/case_run.h"
#include "stability/export_glb.h"
#include "support/session.h"
#include "support/temporary_folder.h"

namespace rcs {
namespace {

RenderOptions options_of_doctor()
{
    RenderOptions options;
    options.width = 160;
    options.height = 120;
    options.aa = 1;
    settings_of(options).rays = 512;
    options.area_samples = options.penumbra_samples = 64;
    return options;
}

class SharedSceneStability : public testing::TestWithParam<std::string> {
protected:
    std::string path = RCS_SCENES_DIR "/" + GetParam() + ".glb";
    ThreadPool pool{2};

    void SetUp() override
    {
        if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is missing";
    }

    void expect_case(const std::string& id)
    {
        const Scene scene = load_scene(path);
        const StabilityOutcome outcome = run_metamorphic_case({test::shared_gl(), pool, "", ""}, id, scene,
                                                              scene.cameras.at(0), options_of_doctor());
        EXPECT_EQ(outcome.verdict, StabilityVerdict::passed) << outcome.figure << ": " << outcome.measured;
    }

    LayeredImage render_file(const std::string& file)
    {
        const Scene scene = load_scene(file);
        return test::render_first(scene, options_of_doctor()).image;
    }
};

TEST_P(SharedSceneStability, HoldsFromTenThousandthToAHundredThousandTimesItsSize) { expect_case("scale"); }

TEST_P(SharedSceneStability, HoldsAThousandKilometresAway) { expect_case("translate"); }

TEST_P(SharedSceneStability, LooksTheSameFromAFileThatPutsItAThousandKilometresAway)
{
    const test::TemporaryFolder folder;
    const std::string far = folder / "far.glb";
    test::write_bytes(far, test::bytes_of(path));
    stability::rewrite_glb(far, [](const std::string& text) {
        nlohmann::json document = nlohmann::json::parse(text);
        nlohmann::json& roots = document["scenes"][document.value("scene", 0)]["nodes"];
        document["nodes"].push_back({{"name", "away"}, {"translation", {1e6, 5e5, -1e6}}, {"children", roots}});
        roots = {document["nodes"].size() - 1};
        return document.dump();
    });
    const LayeredImage here = render_file(path), there = render_file(far);
    for (const char* layer : {"direct", "indirect"})
        EXPECT_LT(stability::difference_of_means(there, here, layer), 0.005) << layer;
    EXPECT_LT(stability::mean_difference(there, here, "direct"), 0.005);
}

INSTANTIATE_TEST_SUITE_P(Scenes, SharedSceneStability, testing::Values("cornell-box", "sponza"), [](const auto& scene) {
    return scene.param == "sponza" ? std::string("sponza") : std::string("cornell");
});

}  // namespace
}  // namespace rcs
