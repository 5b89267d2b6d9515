#include "placement/view_fit.h"

#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "gbuffer/shading.h"
#include "rcs/gl_context.h"
#include "support/scenes.h"

namespace rcs {
namespace {

/// A view's visible points, and a record at every fifth of them.
struct Seen {
    View view;
    GBuffer gbuffer;
    std::vector<Record> records;
};

Seen see(const Scene& scene, const View& view)
{
    static GlContext gl;
    ThreadPool pool(2);
    const RayScene rays = build_ray_scene(scene, pool);
    Seen seen{view, render_gbuffer(gl, rays, view, 1.0f, pool), {}};
    for (std::size_t i = 0; i < seen.gbuffer.size(); i += 5) {
        if (!seen.gbuffer.covered(i)) continue;
        Record r;
        r.position = seen.gbuffer.scene_position(i);
        r.normal = seen.gbuffer.normal(i);
        r.footprint = seen.gbuffer.footprint[i];
        seen.records.push_back(r);
    }
    EXPECT_GT(seen.records.size(), 100u);
    return seen;
}

TEST(ViewFit, ChangesNothingForRecordsOfTheSameView)
{
    const Scene scene = test::furnished_room();
    for (const Projection projection : {Projection::perspective, Projection::orthographic}) {
        View view = test::view_of(scene.cameras[0], 60, 40);
        view.camera.projection = projection;
        view.camera.ymag = 1.2;
        view.camera.lens_shift = {0.1, -0.2};
        view.pixel_offset = {0.3, 0.8};
        const Seen seen = see(scene, view);
        std::vector<Record> records = seen.records;
        fit_to_view(seen.gbuffer, view, false, records);
        for (std::size_t k = 0; k < records.size(); ++k)
            EXPECT_EQ(records[k].footprint, seen.records[k].footprint) << "record " << k;
    }
}

TEST(ViewFit, BringsWhatIsSeenLastWithItsPixels)
{
    const Scene scene = test::furnished_room();
    const View view = test::view_of(scene.cameras[0], 60, 40);
    Seen seen = see(scene, view);
    for (std::size_t k = 0; k < seen.records.size(); ++k) {
        Record& r = seen.records[k];
        r.rays = static_cast<int>(k);
        if (k % 3 != 0) r.watch.geometric_normal = r.normal;  // a third was born nobody knows where
        if (k % 3 == 1) r.position += 100.0f * r.normal;      // a third lies on nothing that is seen
    }
    std::vector<Record> records = seen.records;
    const std::vector<std::uint32_t> pixels = bring_seen_last(seen.gbuffer, view, false, records);
    ASSERT_EQ(records.size(), seen.records.size());
    const std::size_t others = records.size() - pixels.size();
    EXPECT_NEAR(static_cast<double>(pixels.size()), static_cast<double>(records.size()) / 3.0, 2.0);
    for (std::size_t k = 0; k < pixels.size(); ++k) {
        const Record& r = records[others + k];
        EXPECT_EQ(r.rays % 3, 2);
        EXPECT_EQ(r.position, seen.gbuffer.scene_position(pixels[k]));
        EXPECT_TRUE(k == 0 || records[others + k - 1].rays < r.rays) << "in their order";
    }
    for (std::size_t k = 0; k < others; ++k) EXPECT_NE(records[k].rays % 3, 2);
    EXPECT_TRUE(bring_seen_last(seen.gbuffer, view, true, records).empty()) << "they hold no radiance";
}

TEST(ViewFit, FollowsTheSizeOfPixels)
{
    const Scene scene = test::furnished_room();
    const Seen small = see(scene, test::view_of(scene.cameras[0], 30, 20)),
               large = see(scene, test::view_of(scene.cameras[0], 240, 160));
    std::vector<Record> records = small.records;
    fit_to_view(large.gbuffer, large.view, false, records);
    for (std::size_t k = 0; k < records.size(); ++k)
        EXPECT_NEAR(records[k].footprint / small.records[k].footprint, 0.125f, 0.03f)
            << "record " << k;  // the nearest sample is elsewhere
    records = large.records;
    fit_to_view(small.gbuffer, small.view, false, records);
    double ratio = 0.0;
    for (std::size_t k = 0; k < records.size(); ++k)
        ratio += static_cast<double>(records[k].footprint / large.records[k].footprint);
    // At edges the small picture's sample is on another surface: there they stay as they are.
    EXPECT_GT(ratio / static_cast<double>(records.size()), 6.0);
}

TEST(ViewFit, FollowsInLittleStepsWhereTheCameraMoves)
{
    const Scene scene = test::furnished_room();
    const Seen seen = see(scene, test::view_of(scene.cameras[0], 60, 40));
    const auto fitted = [&](float times) {
        std::vector<Record> records = seen.records;
        for (Record& r : records) r.footprint *= times;
        fit_to_view(seen.gbuffer, seen.view, true, records);
        return records;
    };
    for (const auto& [times, left] : {std::pair(1.2f, 1.2f), {1 / 1.2f, 1 / 1.2f}, {1.3f, 1.25f}, {1 / 9.0f, 0.8f}}) {
        const std::vector<Record> records = fitted(times);
        for (std::size_t k = 0; k < records.size(); ++k)
            EXPECT_NEAR(records[k].footprint / seen.records[k].footprint, left, 1e-5f) << times << ", record " << k;
    }
}

TEST(ViewFit, LeavesWhatIsOutOfSightUnlessItIsMuchCoarser)
{
    const Scene scene = test::furnished_room();
    const Seen seen = see(scene, test::view_of(scene.cameras[0], 60, 40));
    const glm::dvec3 eye = camera_position(seen.view.camera), back(seen.view.camera.world_from_view[2]);
    Record behind;
    behind.position = glm::vec3(eye + 2.0 * back);
    const float pixel = static_cast<float>(2.0 * image_plane(seen.view).pixel);
    for (const float footprint : {0.5f * pixel, 20.0f * pixel}) {
        behind.footprint = footprint;
        std::vector<Record> records{behind};
        fit_to_view(seen.gbuffer, seen.view, false, records);
        EXPECT_NEAR(records[0].footprint, std::min(footprint, 2.0f * pixel), 1e-6f);
    }
    behind.position = glm::vec3(eye);
    std::vector<Record> records{behind};
    fit_to_view(seen.gbuffer, seen.view, false, records);
    EXPECT_GT(records[0].footprint, 0.0f) << "in the eye itself";
}

TEST(ViewFit, TakesOutWhatIsNearNothingThatIsSeenAndPutsItBack)
{
    const Scene scene = test::furnished_room();
    Seen seen = see(scene, test::view_of(scene.cameras[0], 60, 40));
    for (std::size_t k = 0; k < seen.records.size(); ++k) {
        seen.records[k].spacing_radius = seen.records[k].footprint;
        seen.records[k].rays = static_cast<int>(k);
    }
    // Something shows through in a corner of the picture alone.
    constexpr int kColumns = 9, kRows = 7;
    const auto column = [](std::size_t i) { return static_cast<int>(i % 60); };
    const auto row = [](std::size_t i) { return static_cast<int>(i / 60); };
    std::vector<int> pixels;
    for (std::size_t i = 0; i < seen.gbuffer.size(); ++i) {
        if (seen.gbuffer.covered(i) && i % 5 == 0) pixels.push_back(static_cast<int>(i));
        if (column(i) >= kColumns || row(i) >= kRows) seen.gbuffer.instance[i] = GBuffer::kNone;
    }
    ASSERT_EQ(pixels.size(), seen.records.size());

    ThreadPool pool(2);
    std::vector<Record> records = seen.records;
    TakenOut taken = take_elsewhere(seen.gbuffer, seen.view, pool, records);
    EXPECT_EQ(records.size() + taken.records.size(), seen.records.size());
    EXPECT_GT(taken.records.size(), seen.records.size() / 2);
    for (const Record& r : taken.records) {
        const auto i = static_cast<std::size_t>(pixels[static_cast<std::size_t>(r.rays)]);
        EXPECT_TRUE(column(i) >= kColumns + 4 || row(i) >= kRows + 4) << "it reaches what is seen, " << i;
    }
    for (const Record& r : records) {
        // Their reach, on oblique surfaces, and the square that a pixel lies in.
        const auto i = static_cast<std::size_t>(pixels[static_cast<std::size_t>(r.rays)]);
        EXPECT_TRUE(column(i) < kColumns + 24 && row(i) < kRows + 24) << "it reaches nothing, " << i;
    }

    Record late;
    late.rays = -1;
    records.push_back(late);
    put_between(std::move(taken), records);
    ASSERT_EQ(records.size(), seen.records.size() + 1);
    for (std::size_t k = 0; k + 1 < records.size(); ++k) EXPECT_EQ(records[k].rays, static_cast<int>(k));
    EXPECT_EQ(records.back().rays, -1);

    Record odd = seen.records.back();
    odd.spacing_radius = std::numeric_limits<float>::quiet_NaN();
    records.assign(1, odd);
    EXPECT_TRUE(take_elsewhere(seen.gbuffer, seen.view, pool, records).records.empty()) << "nobody knows its reach";
}

}  // namespace
}  // namespace rcs
