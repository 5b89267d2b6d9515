#include <string>

#include <gtest/gtest.h>

#include "rcs/error.h"
#include "rcs/metrics.h"
#include "report/converged.h"
#include "report/paths.h"
#include "support/scenes.h"
#include "support/temporary_folder.h"
#include "support/tracing.h"

namespace rcs::service {
namespace {

constexpr int kSize = 12;

struct Room {
    Scene scene = test::furnished_room();
    ThreadPool pool{2};
    RayScene rays = build_ray_scene(scene, pool);
    View view = test::view_of(scene.cameras[0], kSize, kSize);
    test::TemporaryFolder folder;
};

bool go_on(std::string_view, float) { return true; }

void expect_same(const LayeredImage& a, const LayeredImage& b)
{
    ASSERT_EQ(a.layers.size(), b.layers.size());
    for (const auto& [name, layer] : a.layers) EXPECT_EQ(layer.pixels, b.layers.at(name).pixels) << name;
}

TEST(Rounds, DoubleUntilTheyAreLarge)
{
    std::vector<int> ends;
    for (int samples = 0; samples < 1000; samples += next_round(samples)) ends.push_back(samples + next_round(samples));
    EXPECT_EQ(ends, (std::vector<int>{16, 32, 64, 128, 256, 512, 768, 1024}));
    for (const int end : ends) EXPECT_TRUE(is_round(end));
    for (const int none : {0, 15, 48, 300, 384}) EXPECT_FALSE(is_round(none)) << none;
}

TEST(GrowingPaths, GoesOnAfterAnInterruptionAsIfThereHadBeenNone)
{
    Room room;
    GrowingPaths whole(room.folder / "whole.exr", "key", room.view, {});
    for (int round = 0; round < 3; ++round) whole.add_round(room.rays, room.pool, go_on);
    {
        GrowingPaths first(room.folder / "part.exr", "key", room.view, {});
        first.add_round(room.rays, room.pool, go_on);
        const auto stop = [](std::string_view, float fraction) { return fraction < 0.5f; };
        EXPECT_THROW(first.add_round(room.rays, room.pool, stop), Error);
    }
    GrowingPaths second(room.folder / "part.exr", "key", room.view, {});
    EXPECT_EQ(second.samples(), 16) << "the round that was cut off does not count";
    EXPECT_GT(second.seconds(), 0.0);
    for (int round = 0; round < 2; ++round) second.add_round(room.rays, room.pool, go_on);
    EXPECT_EQ(second.samples(), 64);
    expect_same(second.image(), whole.image());
}

TEST(GrowingPaths, TakesNothingFromAnotherScene)
{
    Room room;
    GrowingPaths(room.folder / "p.exr", "one", room.view, {}).add_round(room.rays, room.pool, go_on);
    EXPECT_EQ(GrowingPaths(room.folder / "p.exr", "one", room.view, {}).samples(), 16);
    EXPECT_EQ(GrowingPaths(room.folder / "p.exr", "other", room.view, {}).samples(), 0);
}

TEST(Converge, ReachesTheErrorThatIsWantedAndKnowsItsOwn)
{
    Room room;
    const double wanted = 0.03;
    const ConvergedReference reference = converge(room.rays, room.view, {.samples = 4096, .seed = 5},
                                                  {room.folder.path(), "key"}, wanted, room.pool, {}, go_on);
    EXPECT_LE(reference.error, wanted);
    EXPECT_LT(reference.paths, 4096) << "stops when it is good enough";
    // What it says of itself holds against a much better image of another seed: to a third, with 144 pixels.
    const LayeredImage truth = test::trace(room.scene, kSize, {.samples = 8192, .seed = 99});
    const double error = compare_images(reference.image, truth, "indirect").mean_relative_error;
    EXPECT_NEAR(error, reference.error, 0.35 * reference.error);
}

TEST(Converge, GoesOnToABetterErrorFromWhatIsKept)
{
    Room room;
    const auto converged = [&](const std::string& folder, double wanted) {
        std::filesystem::create_directories(room.folder / folder);
        return converge(room.rays, room.view, {.samples = 4096}, {room.folder / folder, "key"}, wanted, room.pool, {},
                        go_on);
    };
    const ConvergedReference coarse = converged("a", 0.3);
    const ConvergedReference continued = converged("a", 0.03);
    const ConvergedReference direct = converged("b", 0.03);
    EXPECT_LT(coarse.paths, continued.paths);
    EXPECT_EQ(continued.paths, direct.paths);
    EXPECT_EQ(continued.error, direct.error);
    expect_same(continued.image, direct.image);
}

TEST(Converge, WarnsWhenItMayTakeNoMorePaths)
{
    Room room;
    std::string warning;
    const auto log = [&](LogLevel level, std::string_view line) {
        if (level == LogLevel::warning) warning = line;
    };
    const ConvergedReference reference =
        converge(room.rays, room.view, {.samples = 64}, {room.folder.path(), "key"}, 1e-4, room.pool, log, go_on);
    EXPECT_EQ(reference.paths, 64);
    EXPECT_NE(warning.find("64 paths a pixel, the most allowed"), std::string::npos) << warning;
}

}  // namespace
}  // namespace rcs::service
