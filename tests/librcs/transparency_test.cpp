#include "rays/transparency.h"

#include <cmath>

#include <gtest/gtest.h>

#include "rays/shadow_batch.h"
#include "rays/surface.h"
#include "support/scenes.h"
#include "util/random.h"

namespace rcs {
namespace {

enum class Placing { baked, instanced };

/// Panes of 2 x 2 m across z, at z = 0, 1, 2 ..., each with its material; behind them at z = 10 a wall.
struct Panes {
    Scene scene;
    ThreadPool pool{2};

    int add(const Material& material, Placing placing = Placing::baked)
    {
        scene.materials.push_back(material);
        const int index = static_cast<int>(scene.materials.size()) - 1;
        glm::dmat4 move(1.0);
        move[3] = glm::dvec4(0.0, 0.0, count_++, 1.0);
        test::add_mesh(scene, test::quad({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, index), move);
        if (placing == Placing::instanced) {
            Instance far = scene.instances.back();
            far.world_from_object[3] = glm::dvec4(100.0, 0.0, 0.0, 1.0);
            scene.instances.push_back(far);
        }
        return index;
    }
    void add_wall()
    {
        const int grey = test::add_material(scene, glm::vec3(0.5f));
        test::add_mesh(scene, test::quad({-9, -9, 10}, {18, 0, 0}, {0, 18, 0}, grey));
    }
    RayScene rays() { return build_ray_scene(scene, pool); }

private:
    int count_ = 0;
};

Material masked(float alpha)
{
    Material m;
    m.alpha_mode = AlphaMode::mask;
    m.alpha = alpha;
    return m;
}
Material blended(float alpha)
{
    Material m;
    m.alpha_mode = AlphaMode::blend;
    m.alpha = alpha;
    return m;
}
Material tinted(glm::vec3 color)
{
    Material m;
    m.base_color = color;
    m.transmission = 1.0f;
    return m;
}

/// Rays at right angles to the panes, at points all over them.
Ray ray_at(int i, float t_max = std::numeric_limits<float>::infinity())
{
    RandomStream random(static_cast<std::uint64_t>(i) * 77u);
    const float x = 1.8f * random.next() - 0.9f;
    return {{x, 1.8f * random.next() - 0.9f, -1.0f}, {0.0f, 0.0f, 1.0f}, 0.0f, t_max};
}

TEST(Transparency, OpaqueScenesHaveNone)
{
    Panes panes;
    panes.add(Material{});
    Material open;
    open.alpha = 0.2f;  // without a mode, alpha means nothing
    panes.add(open);
    EXPECT_FALSE(panes.rays().has_transparency());
    panes.add(blended(0.5f));
    EXPECT_TRUE(panes.rays().has_transparency());
}

TEST(Transparency, MasksNeverStopARayBelowTheirCutoff)
{
    Panes panes;
    panes.add(masked(0.4f));
    panes.add(masked(0.6f));
    const RayScene rays = panes.rays();
    for (int i = 0; i < 50; ++i) {
        for (const RayFilter filter : {RayFilter::by_chance, RayFilter::everything}) {
            const auto hit = intersect(rays, ray_at(i), filter);
            ASSERT_TRUE(hit);
            EXPECT_EQ(hit->instance, 1u);
        }
        EXPECT_TRUE(occluded(rays, ray_at(i)));
        EXPECT_FALSE(occluded(rays, ray_at(i, 1.5f)));
    }
}

TEST(Transparency, BlendedSurfacesStopTheirShareOfRaysAndAlwaysTheSame)
{
    for (const Placing placing : {Placing::baked, Placing::instanced}) {
        Panes panes;
        panes.add(blended(0.3f), placing);
        panes.add_wall();
        const RayScene rays = panes.rays();
        const int n = 20000;
        int stopped = 0;
        for (int i = 0; i < n; ++i) {
            glm::vec3 weight(0.0f);
            const auto hit = intersect(rays, ray_at(i), RayFilter::by_chance, &weight);
            ASSERT_TRUE(hit);
            EXPECT_EQ(weight, glm::vec3(1.0f));
            stopped += hit->instance == 0;
            EXPECT_EQ(intersect(rays, ray_at(i))->instance, hit->instance);
            EXPECT_EQ(occluded(rays, ray_at(i, 5.0f)), hit->instance == 0);
        }
        // 5 standard deviations of a binomial share.
        EXPECT_NEAR(static_cast<double>(stopped) / n, 0.3, 5.0 * std::sqrt(0.3 * 0.7 / n));
        EXPECT_EQ(intersect(rays, ray_at(0), RayFilter::everything)->instance, 0u);
    }
}

TEST(Transparency, WeightsBringTheTintBackOnAverage)
{
    for (const Placing placing : {Placing::baked, Placing::instanced}) {
        Panes panes;
        const glm::vec3 a(0.9f, 0.5f, 0.2f), b(0.3f, 0.8f, 0.6f);
        panes.add(tinted(a), placing);
        panes.add(blended(0.25f), placing);
        panes.add(tinted(b), placing);
        panes.add_wall();
        const RayScene rays = panes.rays();
        const glm::vec3 expected = a * 0.75f * b;
        const int n = 40000;
        glm::dvec3 mean(0.0);
        for (int i = 0; i < n; ++i) {
            glm::vec3 weight(0.0f);
            const auto hit = intersect(rays, ray_at(i), RayFilter::by_chance, &weight);
            ASSERT_TRUE(hit);
            if (hit->t > 10.0f) mean += glm::dvec3(weight) / static_cast<double>(n);
            // Without chance, all at once.
            const glm::vec3 t = transmittance(rays, ray_at(i, 9.0f));
            for (int c = 0; c < 3; ++c) ASSERT_NEAR(t[c], expected[c], 1e-5f);
        }
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(mean[c], static_cast<double>(expected[c]), 0.01);
        EXPECT_EQ(transmittance(rays, ray_at(1)), glm::vec3(0.0f));
    }
}

TEST(Transparency, ManyLayersStayUnbiasedBeyondTheNotedOnes)
{
    Panes panes;
    for (int i = 0; i < 20; ++i) panes.add(blended(0.1f));
    const RayScene rays = panes.rays();
    const int n = 20000;
    double mean = 0.0;
    for (int i = 0; i < n; ++i) mean += static_cast<double>(transmittance(rays, ray_at(i)).g) / n;
    EXPECT_NEAR(mean, std::pow(0.9, 20), 0.005);
}

TEST(Transparency, PacketsAgreeWithSingleRays)
{
    Panes panes;
    panes.add(tinted({0.9f, 0.5f, 0.2f}), Placing::instanced);
    panes.add(blended(0.5f));
    panes.add(masked(0.1f), Placing::instanced);
    panes.add(tinted({0.3f, 0.8f, 0.6f}));
    panes.add_wall();
    const RayScene rays = panes.rays();
    HitPacket packet{};
    reset(packet.ray);
    ShadowBatch shadow;
    int passed = 0;
    for (int first = 0; first < 800; first += RayPacket::kWidth) {
        shadow.clear();
        for (int i = 0; i < RayPacket::kWidth; ++i) {
            const Ray ray = ray_at(first + i);
            packet.ray.origin_x[i] = ray.origin.x;
            packet.ray.origin_y[i] = ray.origin.y;
            packet.ray.origin_z[i] = ray.origin.z;
            packet.ray.direction_x[i] = ray.direction.x;
            packet.ray.direction_y[i] = ray.direction.y;
            packet.ray.direction_z[i] = ray.direction.z;
            packet.ray.t_max[i] = ray.t_max;
            shadow.add(ray_at(first + i, 9.0f));
        }
        LaneWeights weights;
        intersect(rays, 0xffffu, packet, weights);
        shadow.trace(rays);
        for (int i = 0; i < RayPacket::kWidth; ++i) {
            glm::vec3 weight(0.0f);
            const auto hit = intersect(rays, ray_at(first + i), RayFilter::by_chance, &weight);
            ASSERT_TRUE(hit);
            EXPECT_EQ(hit->instance, packet.instance(i));
            EXPECT_EQ(weight, weights.weight[i]);
            passed += hit->t > 10.0f;
            const std::size_t lane = static_cast<std::size_t>(i);
            EXPECT_TRUE(shadow.is_free(lane));
            EXPECT_NEAR(shadow.transmittance(lane).g, 0.5f * 0.5f * 0.8f, 1e-5f);
        }
    }
    EXPECT_GT(passed, 100);
}

TEST(FindVisible, PeelsLayersOneByOne)
{
    Panes panes;
    panes.add(masked(0.1f));
    panes.add(blended(0.5f));
    panes.add(tinted(glm::vec3(0.5f)));
    panes.add_wall();
    for (Material& m : panes.scene.materials) m.double_sided = true;
    const RayScene rays = panes.rays();
    CameraRay ray{};
    ray.origin = {0.1, 0.2, -1.0};
    ray.direction = {0.0, 0.0, 1.0};
    float after = 0.0f;
    for (const std::uint32_t expected : {1u, 2u, 3u}) {
        const auto hit = find_visible(rays, ray, after);
        ASSERT_TRUE(hit);
        EXPECT_EQ(hit->instance, expected);
        after = hit->t;
    }
    EXPECT_FALSE(find_visible(rays, ray, after));
}

}  // namespace
}  // namespace rcs
