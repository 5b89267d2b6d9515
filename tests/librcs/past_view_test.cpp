#include "gbuffer/past_view.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "support/effect_scenes.h"
#include "support/scenes.h"
#include "support/seen_place.h"
#include "util/random.h"

namespace rcs {
namespace {

constexpr int kSize = 64;

/// The furnished room as its camera sees it from so far to the right of where it stands.
Scene seen_from(double right, Scene scene = test::furnished_room())
{
    Camera& camera = scene.cameras[0];
    camera.world_from_view[3] += right * camera.world_from_view[0];
    return scene;
}

struct TwoViews {
    test::SeenPlace before, now;
    PastPoints points{points_of(before.points, before.view)};
    PastPlaces places{points, now.points, now.view, now.shading, now.pool};

    TwoViews(Scene a, Scene b) : before(std::move(a), kSize), now(std::move(b), kSize) {}
    int seen() const
    {
        int count = 0;
        for (std::size_t i = 0; i < now.points.size(); ++i) count += places[i].is_seen() ? 1 : 0;
        return count;
    }
};

TEST(PastPlaces, LieWhereThePointsWere)
{
    const TwoViews views(seen_from(0.0), seen_from(0.05));
    EXPECT_GT(views.seen(), kSize * kSize * 8 / 10);
    for (std::size_t i = 0; i < views.now.points.size(); ++i) {
        if (!views.places[i].is_seen() || !views.places[i].is_whole) continue;
        const glm::dvec3 at = views.points.camera_position + glm::dvec3(views.places.mean(views.points.position, i));
        EXPECT_LE(glm::length(at - glm::dvec3(views.now.points.scene_position(i))),
                  0.26 * static_cast<double>(views.now.points.footprint[i]));
        for (const std::size_t pixel : views.places.around(i))
            EXPECT_EQ(views.before.points.instance[pixel], views.now.points.instance[i]);
    }
}

TEST(PastPlaces, OfTheSameViewAreItsPixels)
{
    const TwoViews views(seen_from(0.0), seen_from(0.0));
    for (std::size_t i = 0; i < views.now.points.size(); ++i) {
        if (!views.places[i].is_seen()) continue;
        EXPECT_EQ(views.places.nearest(i), i);
        EXPECT_LE(glm::length(views.places.mean(views.points.position, i) - views.now.points.position(i)), 1e-4f);
    }
}

TEST(PastPlaces, HandOnWhatLiesAtThePointInTheMean)
{
    const TwoViews views(seen_from(0.0), seen_from(0.05));
    for (std::size_t i = 0; i < views.now.points.size(); i += 97) {
        if (!views.places[i].is_seen()) continue;
        glm::vec3 sum(0.0f);
        constexpr int kDraws = 4000;
        for (int draw = 0; draw < kDraws; ++draw)
            sum += views.points.position[views.places.drawn(i, mix64(static_cast<std::uint64_t>(draw)))];
        const float pixel = views.now.points.footprint[i];
        EXPECT_LE(glm::length(sum / static_cast<float>(kDraws) - views.places.mean(views.points.position, i)),
                  0.05f * pixel);
    }
}

TEST(PastPlaces, AreNotWhereSomethingElseWasSeen)
{
    // The block hides another part of the walls, and has gone from where it stood.
    Scene moved = test::furnished_room();
    moved.instances[1].world_from_object[3].x += 0.7;
    const TwoViews views(test::furnished_room(), moved);
    int hidden = 0;
    for (std::size_t i = 0; i < views.now.points.size(); ++i) {
        if (views.before.points.instance[i] == views.now.points.instance[i]) continue;
        ++hidden;
        EXPECT_FALSE(views.places[i].is_seen()) << i;
    }
    EXPECT_GT(hidden, 100);
    const TwoViews away(seen_from(0.0), seen_from(3.0));
    EXPECT_LT(away.seen(), views.seen() / 2) << "outside of the picture";
}

TEST(PastPlaces, BesideEdgesThoseThatSawTheSurfaceStandForTheOthers)
{
    const TwoViews views(seen_from(0.0), seen_from(0.05));
    int in_part = 0;
    for (std::size_t i = 0; i < views.now.points.size(); ++i) {
        if (!views.places[i].is_seen()) continue;
        EXPECT_EQ(views.places.views(i, 0.0f), views.places[i].is_whole ? 16 : 4);
        if (views.places[i].is_whole) continue;
        ++in_part;
        const GBuffer& g = views.now.points;
        const auto apart = [&](std::size_t pixel) {
            return glm::vec3(views.points.camera_position - g.camera_position) + views.points.position[pixel] -
                   g.position(i);
        };
        for (const std::size_t pixel : views.places.around(i)) {
            EXPECT_EQ(views.before.points.instance[pixel], g.instance[i]);
            EXPECT_LE(glm::length(apart(pixel)), 2.01f * g.footprint[i]) << i;
            EXPECT_LE(std::abs(glm::dot(apart(pixel), g.geometric_normal[i])), 0.26f * g.footprint[i]) << i;
        }
    }
    EXPECT_GT(in_part, 60);
    EXPECT_LT(in_part, views.seen() / 4);
}

TEST(PastPlaces, LobesLagWhereTheyAreNarrowAndMatter)
{
    const auto floor_of = [](float roughness, double right) {
        Scene scene = test::furnished_room();
        test::add_mesh(scene, test::quad({-1.9f, 0.01f, -1.9f}, {0, 0, 3.8f}, {3.8f, 0, 0},
                                         test::add_surface(scene, test::metal(roughness))));
        return seen_from(right, scene);
    };
    for (const float roughness : {0.1f, 0.6f}) {
        const TwoViews views(floor_of(roughness, 0.0), floor_of(roughness, 0.02));
        for (std::size_t i = 0; i < views.now.points.size(); ++i) {
            if (!views.places[i].is_seen()) continue;
            int before = views.places.views(i, 0.0f);
            EXPECT_EQ(before, views.places[i].is_whole ? 16 : 4) << "what is reflected evenly stays";
            for (const float part : {0.001f, 0.01f, 0.1f, 1.0f}) {
                const int next = views.places.views(i, part);
                EXPECT_LE(next, before);
                before = next;
            }
            if (views.now.points.instance[i] != 3) continue;
            if (roughness < 0.2f)
                EXPECT_EQ(before, 1) << "a mirror shows each view another light";
            else
                EXPECT_GT(views.places.views(i, 0.05f), 1) << "a dim wide lobe hardly changes";
        }
    }
}

std::array<glm::vec3, 4> grey(float a, float b, float c, float d)
{
    return {glm::vec3(a), glm::vec3(b), glm::vec3(c), glm::vec3(d)};
}

TEST(PastPlaces, EvenIsWhatDiffersByLittleOrByNoise)
{
    EXPECT_TRUE(is_even(grey(1.0f, 1.1f, 1.05f, 1.0f), 0.0f, 1.0f));
    EXPECT_FALSE(is_even(grey(1.0f, 1.1f, 1.5f, 1.0f), 0.0f, 1.0f)) << "the edge of a shadow";
    EXPECT_TRUE(is_even(grey(1.0f, 1.1f, 1.5f, 1.0f), 0.0f, 5.0f)) << "beside so much light";
    EXPECT_TRUE(is_even(grey(1.0f, 1.1f, 1.5f, 1.0f), 0.25f, 1.0f)) << "noise";
    const glm::vec3 red(1.0f, 0.0f, 0.0f), green(0.0f, 0.2973f, 0.0f);
    EXPECT_FALSE(is_even({red, red, green, green}, 0.0f, 0.2126f)) << "of the same luminance";
}

TEST(PastPlaces, ExactlyEvenIsWhatChangesAsOnAPlane)
{
    EXPECT_TRUE(is_exactly_even(grey(1.0f, 1.04f, 1.03f, 1.07f), 1.0f));
    EXPECT_FALSE(is_exactly_even(grey(1.0f, 1.05f, 1.0f, 1.0f), 1.0f)) << "the corner of a shadow";
    EXPECT_FALSE(is_exactly_even(grey(1.0f, 1.2f, 1.0f, 1.2f), 1.0f)) << "its edge";
}

TEST(PastPlaces, AreNotBetweenMuchCoarserPixels)
{
    Scene near = test::furnished_room();
    near.cameras[0].yfov *= 0.3;
    const TwoViews views(test::furnished_room(), near);
    EXPECT_EQ(views.seen(), 0);
    EXPECT_GT(TwoViews(near, near).seen(), kSize * kSize * 8 / 10);
}

TEST(PastPlaces, MixesByVariance)
{
    const PastMix equal = mix_of(1.0f, 1.0f, 0.1f);
    EXPECT_FLOAT_EQ(equal.weight, 0.5f);
    EXPECT_FLOAT_EQ(equal.variance, 0.5f);
    float variance = 1.0f;
    for (int view = 0; view < 50; ++view) variance = mix_of(variance, 4.0f, 0.25f).variance;
    EXPECT_NEAR(variance, 0.25f / 1.75f * 4.0f, 1e-3f) << "w / (2 - w) of what a view's samples have";
}

}  // namespace
}  // namespace rcs
