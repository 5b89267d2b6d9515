// Rays by compute shaders against Embree.
#include "device/ray_caster.h"

#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <epoxy/gl.h>

#include "gl/gl_context_impl.h"
#include "rcs/error.h"
#include "support/effect_scenes.h"
#include "support/scenes.h"
#include "support/session.h"
#include "util/random.h"

namespace rcs {
namespace {

constexpr std::uint32_t kAll = (1u << RayPacket::kWidth) - 1u;

glm::vec3 random_point(RandomStream& random, float size)
{
    const float x = random.next(), y = random.next(), z = random.next();
    return size * (2.0f * glm::vec3(x, y, z) - 1.0f);
}

/// Sixteen rays from around a place, each its own way.
std::vector<HitPacket> random_packets(int count, float size, std::uint64_t seed)
{
    RandomStream random(mix64(seed));
    std::vector<HitPacket> packets(static_cast<std::size_t>(count));
    for (HitPacket& packet : packets) {
        reset(packet.ray);
        for (std::size_t lane = 0; lane < RayPacket::kWidth; ++lane) {
            const glm::vec3 from = random_point(random, size), to = random_point(random, size);
            set_lane(packet.ray, lane, {from, glm::normalize(to - from)});
        }
    }
    return packets;
}

/// One ray a lane, all from one place.
std::vector<HitPacket> packets_towards(glm::vec3 from, const std::vector<glm::vec3>& to)
{
    std::vector<HitPacket> packets((to.size() + RayPacket::kWidth - 1) / RayPacket::kWidth);
    for (HitPacket& packet : packets) reset(packet.ray);
    for (std::size_t i = 0; i < RayPacket::kWidth * packets.size(); ++i)
        set_lane(packets[i / RayPacket::kWidth].ray, i % RayPacket::kWidth,
                 {from, to[std::min(i, to.size() - 1)] - from});
    return packets;
}

struct Traced {
    std::vector<HitPacket> packets;
    std::vector<LaneWeights> weights;

    bool is_hit(std::size_t i) const
    {
        return packets[i / RayPacket::kWidth].geometry[i % RayPacket::kWidth] != RayPacket::kMiss;
    }
    std::size_t size() const { return RayPacket::kWidth * packets.size(); }
};

struct Both {
    Scene scene;
    ThreadPool pool{2};
    RayScene rays;

    explicit Both(Scene s) : scene(std::move(s)), rays(build_ray_scene(scene, pool)) {}

    Traced by_processor(std::vector<HitPacket> packets) const
    {
        Traced t{std::move(packets), {}};
        t.weights.resize(t.packets.size());
        for (std::size_t p = 0; p < t.packets.size(); ++p) intersect(rays, kAll, t.packets[p], t.weights[p]);
        return t;
    }
    Traced by(RayCaster& caster, std::vector<HitPacket> packets)
    {
        Traced t{std::move(packets), {}};
        t.weights.resize(t.packets.size());
        std::vector<AimedPacket> aimed;
        for (std::size_t p = 0; p < t.packets.size(); ++p) aimed.push_back({&t.packets[p], &t.weights[p], kAll});
        caster.intersect(aimed, pool);
        return t;
    }
    Traced by_device(std::vector<HitPacket> packets)
    {
        RayCaster caster(test::shared_gl(), rays);
        Traced traced = by(caster, std::move(packets));
        EXPECT_TRUE(caster.works());
        return traced;
    }
};

/// Rays that do not meet the same surface at the same place, to rounding.
int differing(const Traced& a, const Traced& b)
{
    int count = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const HitPacket &x = a.packets[i / RayPacket::kWidth], &y = b.packets[i / RayPacket::kWidth];
        const int lane = static_cast<int>(i % RayPacket::kWidth);
        if (a.is_hit(i) != b.is_hit(i)) {
            ++count;
            continue;
        }
        if (!a.is_hit(i)) continue;
        const bool same = x.instance(lane) == y.instance(lane) && x.primitive[lane] == y.primitive[lane] &&
                          x.instance_id[lane] == y.instance_id[lane];
        const float t = x.ray.t_max[lane], other = y.ray.t_max[lane];
        const glm::vec3 n(x.normal_x[lane], x.normal_y[lane], x.normal_z[lane]);
        const glm::vec3 m(y.normal_x[lane], y.normal_y[lane], y.normal_z[lane]);
        const bool near = std::abs(t - other) <= 1e-4f * (1.0f + t);
        const bool alike = std::abs(x.u[lane] - y.u[lane]) < 1e-2f && std::abs(x.v[lane] - y.v[lane]) < 1e-2f &&
                           glm::dot(n, m) >= 0.99f * glm::length(n) * glm::length(m);
        count += !(same && near && alike);
    }
    return count;
}

/// Triangles of all sizes, slivers and such without area among them.
Mesh random_triangles(int count, float size, std::uint64_t seed)
{
    RandomStream random(mix64(seed));
    Mesh mesh;
    for (int i = 0; i < count; ++i) {
        const glm::vec3 a = random_point(random, size);
        const float edge = size * std::pow(10.0f, -3.0f * random.next());
        const glm::vec3 b = a + random_point(random, edge);
        glm::vec3 c = a + random_point(random, edge);
        if (i % 50 == 1) c = a + 0.37f * (b - a);                                  // a line
        if (i % 50 == 2) c = a;                                                    // a line, two corners the same
        if (i % 50 == 3) c = 0.5f * (a + b) + random_point(random, 1e-5f * edge);  // a sliver
        for (const glm::vec3 p : {a, b, c}) mesh.positions.push_back(p);
        const auto first = static_cast<std::uint32_t>(3 * i);
        mesh.triangles.emplace_back(first, first + 1, first + 2);
    }
    return mesh;
}

TEST(RayCaster, MeetsRandomAndDegenerateTrianglesWhereEmbreeDoes)
{
    for (const float size : {1.0f, 1e-3f, 1e3f}) {
        Scene scene;
        scene.materials.emplace_back();
        test::add_mesh(scene, random_triangles(4000, size, 3));
        Both both(std::move(scene));
        const std::vector<HitPacket> packets = random_packets(2048, size, 5);
        const Traced expected = both.by_processor(packets);
        const Traced got = both.by_device(packets);
        int hits = 0;
        for (std::size_t i = 0; i < expected.size(); ++i) hits += expected.is_hit(i);
        EXPECT_GT(hits, 10000);
        // Where roundings decide, at edges, the processor does; a sliver's weights are all roundings.
        EXPECT_LE(differing(expected, got), 1) << "size " << size;
    }
}

TEST(RayCaster, NoRayLeaksThroughAnEdgeThatTrianglesShare)
{
    // A sheet without holes, a little bumpy and far from zero, seen from above, so that no edge is a rim; rays to its
    // vertices, and to points along its edges.
    constexpr int kSide = 40;
    Mesh mesh;
    RandomStream random(mix64(11));
    const glm::vec3 far(1000.0f, -300.0f, 50.0f);
    for (int y = 0; y <= kSide; ++y)
        for (int x = 0; x <= kSide; ++x)
            mesh.positions.push_back(far + glm::vec3(static_cast<float>(x) - 20.0f + 0.3f * random.next(),
                                                     static_cast<float>(y) - 20.0f, 0.05f * random.next()));
    std::vector<glm::vec3> to_vertices, to_edges;
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) {
            const auto a = static_cast<std::uint32_t>(y * (kSide + 1) + x), b = a + 1, c = a + kSide + 1, d = c + 1;
            mesh.triangles.emplace_back(a, b, d);
            mesh.triangles.emplace_back(a, d, c);
            if (x == 0 || y == 0) continue;
            to_vertices.push_back(mesh.positions[a]);
            for (const std::uint32_t end : {b, c, d})
                if (x + 1 < kSide && y + 1 < kSide)
                    for (int k = 0; k < 4; ++k)
                        to_edges.push_back(glm::mix(mesh.positions[a], mesh.positions[end], random.next()));
        }
    Scene scene;
    scene.materials.emplace_back();
    test::add_mesh(scene, mesh);
    Both both(std::move(scene));
    const glm::vec3 eye = far + glm::vec3(0.4f, 1.3f, 7.0f);
    const auto leaks = [](const Traced& traced) {
        int count = 0;
        for (std::size_t i = 0; i < traced.size(); ++i) count += !traced.is_hit(i);
        return count;
    };
    EXPECT_EQ(leaks(both.by_device(packets_towards(eye, to_edges))), 0);
    // Where six edges end, each rounded by itself, Embree lets some through, and is asked.
    const std::vector<HitPacket> at_vertices = packets_towards(eye, to_vertices);
    EXPECT_EQ(leaks(both.by_device(at_vertices)), leaks(both.by_processor(at_vertices)));
}

/// One mesh many times: turned, stretched, mirrored; beside one that is used once.
Scene instances()
{
    Scene scene;
    scene.materials.emplace_back();
    test::add_mesh(scene, random_triangles(300, 0.5f, 17));
    RandomStream random(mix64(23));
    for (int i = 0; i < 60; ++i) {
        Instance copy = scene.instances[0];
        glm::dmat4 m(1.0);
        for (glm::length_t c = 0; c < 3; ++c) m[c] = glm::dvec4(glm::dvec3(random_point(random, 1.0f)), 0.0);
        if ((glm::determinant(m) < 0.0) != (i % 2 == 0)) m[0] = -m[0];
        m[3] = glm::dvec4(glm::dvec3(random_point(random, 3.0f)), 1.0);
        copy.world_from_object = m;
        scene.instances.push_back(copy);
    }
    test::add_mesh(scene, random_triangles(300, 3.0f, 19));
    return scene;
}

TEST(RayCaster, MeetsInstancesAsEmbreeDoes)
{
    Both both(instances());
    const std::vector<HitPacket> packets = random_packets(2048, 3.0f, 29);
    const Traced expected = both.by_processor(packets);
    RayCaster caster(test::shared_gl(), both.rays);
    EXPECT_EQ(differing(expected, both.by(caster, packets)), 0);
    EXPECT_LT(caster.counts().asked, caster.counts().rays / 50);
    int instanced = 0;
    for (const HitPacket& p : expected.packets)
        for (const std::uint32_t id : p.instance_id) instanced += id != RayPacket::kMiss;
    EXPECT_GT(instanced, 2000);
}

Scene panes()
{
    Scene scene;
    const TextureSlot halves = test::add_halves(scene, glm::vec4(1.0f), glm::vec4(1.0f, 1.0f, 1.0f, 0.0f));
    Material mask, blend, glass;
    mask.alpha_mode = AlphaMode::mask;
    mask.base_color_texture = halves;
    blend.alpha_mode = AlphaMode::blend;
    blend.alpha = 0.4f;
    glass.transmission = 1.0f;
    glass.base_color = {0.9f, 0.5f, 0.2f};
    int z = 0;
    for (const Material& material : {mask, blend, glass}) {
        test::add_mesh(scene, test::panel(test::add_surface(scene, material), -static_cast<float>(++z)));
        Instance again = scene.instances.back();
        again.world_from_object[3] = glm::dvec4(0.7, 0.2, -0.5, 1.0);
        if (z != 2) scene.instances.push_back(again);  // instanced
    }
    test::add_mesh(scene, test::quad({-2, -2, -6}, {4, 0, 0}, {0, 4, 0}, test::add_material(scene, glm::vec3(0.5f))));
    return scene;
}

TEST(RayCaster, GoesThroughSurfacesAsTheProcessorDoes)
{
    Both both(panes());
    std::vector<glm::vec3> to;
    RandomStream random(mix64(31));
    for (int i = 0; i < 8192; ++i) to.emplace_back(random.next() - 0.5f, 1.0f + random.next(), -6.0f);
    const std::vector<HitPacket> packets = packets_towards({0.0f, 1.5f, 1.0f}, to);
    RayCaster caster(test::shared_gl(), both.rays);
    const Traced expected = both.by_processor(packets), got = both.by(caster, packets);
    EXPECT_EQ(differing(expected, got), 0);
    int tinted = 0, unequal = 0;
    for (std::size_t p = 0; p < packets.size(); ++p)
        for (int lane = 0; lane < RayPacket::kWidth; ++lane) {
            const glm::vec3 a = expected.weights[p].weight[lane], b = got.weights[p].weight[lane];
            tinted += a != glm::vec3(1.0f);
            unequal += glm::length(a - b) > 1e-5f;
        }
    EXPECT_GT(tinted, 200);
    EXPECT_EQ(unequal, 0);
    EXPECT_GT(caster.counts().asked, 0u);
}

TEST(RayCaster, ShadowRaysBringWhatTheProcessorFinds)
{
    for (const bool see_through : {false, true}) {
        Both both(see_through ? panes() : instances());
        RandomStream random(mix64(37));
        ShadowBatch expected;
        for (int i = 0; i < 20000; ++i) {
            const glm::vec3 from = random_point(random, 3.0f), way = random_point(random, 3.0f) - from;
            const float length = glm::length(way);
            expected.add({from, way / length, 0.0f, random.next() * length});
        }
        ShadowBatch got = expected;
        RayCaster caster(test::shared_gl(), both.rays);
        ShadowBatch* const batches[] = {&got};
        caster.trace(batches, both.pool);
        expected.trace(both.rays);
        int blocked = 0, differ = 0;
        for (std::size_t i = 0; i < expected.size(); ++i) {
            blocked += !expected.is_free(i);
            differ += expected.is_free(i) != got.is_free(i) ||
                      glm::length(expected.transmittance(i) - got.transmittance(i)) > 1e-5f;
        }
        EXPECT_GT(blocked, 100);
        EXPECT_EQ(differ, 0);
    }
}

TEST(RayCaster, TheSameBitsEachTime)
{
    Both both(instances());
    const std::vector<HitPacket> packets = random_packets(512, 3.0f, 41);
    const Traced first = both.by_device(packets), second = both.by_device(packets);
    for (std::size_t p = 0; p < packets.size(); ++p) {
        EXPECT_EQ(std::memcmp(&first.packets[p].ray, &second.packets[p].ray, sizeof(RayPacket)), 0);
        EXPECT_EQ(std::memcmp(first.packets[p].u, second.packets[p].u, sizeof first.packets[p].u), 0);
        EXPECT_EQ(
            std::memcmp(first.packets[p].primitive, second.packets[p].primitive, sizeof first.packets[p].primitive), 0);
    }
}

TEST(RayCaster, SmallMemoryTakesMoreParts)
{
    Both both(instances());
    const std::vector<HitPacket> packets = random_packets(2048, 3.0f, 43);
    RayCaster roomy(test::shared_gl(), both.rays), tight(test::shared_gl(), both.rays, std::size_t{1} << 20);
    EXPECT_EQ(differing(both.by(roomy, packets), both.by(tight, packets)), 0);
    EXPECT_GT(tight.counts().dispatches, roomy.counts().dispatches);
    EXPECT_LT(tight.wave(), roomy.wave());
}

TEST(RayCaster, TooLittleMemoryIsSaid)
{
    Both both(instances());
    try {
        const RayCaster caster(test::shared_gl(), both.rays, std::size_t{1} << 16);
        FAIL() << "a scene fits into 64 KiB";
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), ErrorCode::out_of_memory);
        EXPECT_NE(std::string(e.what()).find(test::shared_gl().renderer()), std::string::npos) << e.what();
    }
}

TEST(RayCaster, TheProcessorGoesOnWhereTheDeviceFails)
{
    Both both(instances());
    std::vector<std::string> warnings;
    RayCaster caster(test::shared_gl(), both.rays, kAllOfIt, [&](LogLevel level, std::string_view line) {
        if (level == LogLevel::warning) warnings.emplace_back(line);
    });
    const std::vector<HitPacket> packets = random_packets(256, 3.0f, 47);
    test::shared_gl().impl().make_current();
    glEnable(0xdead);  // the GL reports an error, as it does when it is lost
    const Traced expected = both.by_processor(packets);
    for (int i = 0; i < 2; ++i) {
        const Traced got = both.by(caster, packets);
        EXPECT_EQ(differing(expected, got), 0);
        EXPECT_FALSE(caster.works());
    }
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("processor"), std::string::npos);
    EXPECT_NE(warnings[0].find(test::shared_gl().renderer()), std::string::npos) << warnings[0];
}

TEST(RayCaster, AnEmptySceneHasNoHits)
{
    Both both(Scene{});
    const Traced got = both.by_device(random_packets(4, 1.0f, 53));
    for (std::size_t i = 0; i < got.size(); ++i) EXPECT_FALSE(got.is_hit(i));
}

}  // namespace
}  // namespace rcs
