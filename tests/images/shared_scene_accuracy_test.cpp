// The accuracy that the project promises at default settings (1000 x 1000, one bounce, pixel centres), on the two
// scenes it is judged by, against path tracing every 20th pixel of every 20th row with 4096 paths.

#include <cstdio>
#include <filesystem>
#include <ostream>
#include <string>

#include <gtest/gtest.h>

#include "rcs/gl_context.h"
#include "rcs/metrics.h"
#include "rcs/reference.h"
#include "rcs/render.h"
#include "support/session.h"

namespace rcs {
namespace {

struct Case {
    const char* file;
    const char* camera;
    double indirect_mre, direct_mre;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.file; }

class SharedSceneAccuracy : public testing::TestWithParam<Case> {};

TEST_P(SharedSceneAccuracy, AtDefaultSettingsIsWithinThePromisedLimits)
{
    const Case& c = GetParam();
    const std::string path = std::string(RCS_SCENES_DIR "/") + c.file;
    if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is missing";
    const Scene scene = load_scene(path);
    const Camera camera = find_camera(scene, c.camera);
    ThreadPool pool;
    Session session(test::shared_gl(), pool);
    session.show(scene);
    const RayScene& rays = session.rays();
    RenderOptions options;
    options.aa = 1;
    const RenderResult result = render(session, camera, options);
    EXPECT_EQ(result.stats.unserved_pixels, 0u);

    ReferenceOptions trace;
    trace.samples = 4096;
    trace.stride = 20;
    const LayeredImage reference = render_reference(rays, {camera, options.width, options.height}, trace, pool);
    const ErrorMetrics indirect = compare_images(result.image, reference, "indirect");
    const ErrorMetrics direct = compare_images(result.image, reference, "direct");
    const ErrorMetrics emission = compare_images(result.image, reference, "emission");
    std::printf("%s: indirect MRE %.4f bias %+.4f, direct MRE %.4f bias %+.4f\n", c.file, indirect.mean_relative_error,
                indirect.ratio_of_means - 1.0, direct.mean_relative_error, direct.ratio_of_means - 1.0);
    EXPECT_EQ(indirect.pixels, 2500u);
    EXPECT_LE(indirect.mean_relative_error, c.indirect_mre);
    EXPECT_NEAR(indirect.ratio_of_means, 1.0, 0.01);
    EXPECT_LE(direct.mean_relative_error, c.direct_mre);
    EXPECT_NEAR(direct.ratio_of_means, 1.0, 0.005);
    EXPECT_EQ(emission.mean_relative_error, 0.0);
}

INSTANTIATE_TEST_SUITE_P(Scenes, SharedSceneAccuracy,
                         testing::Values(Case{"sponza.glb", "atrium", 0.12, 0.005},
                                         Case{"sibenik.glb", "nave", 0.08, 0.04}),
                         [](const auto& c) { return std::string(c.param.camera); });

}  // namespace
}  // namespace rcs
