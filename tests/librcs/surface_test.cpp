#include "rays/surface.h"

#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <ostream>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <glm/gtc/matrix_transform.hpp>

#include "rays/hit_surface.h"
#include "rays/packet.h"
#include "support/scenes.h"

namespace rcs {
namespace {

/// An ellipsoid of facets somewhere in the scene: baked or instanced, mirrored or not.
struct Case {
    std::string name;
    bool mirrored;
    bool instanced;
    bool smooth;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

glm::dmat4 placement(bool mirrored)
{
    glm::dmat4 m = glm::translate(glm::dmat4(1.0), {4.0, -2.0, 7.0});
    m = glm::rotate(m, 0.8, glm::normalize(glm::dvec3(0.3, 1.0, -0.4)));
    return glm::scale(m, {mirrored ? -1.5 : 1.5, 0.7, 2.0});
}
const glm::dvec3 kCentre(4.0, -2.0, 7.0);

Scene ellipsoid(const Case& c)
{
    Scene scene;
    Mesh mesh = test::icosphere(glm::vec3(0.0f), 1.0f, 2, test::add_material(scene, glm::vec3(0.5f)));
    if (!c.smooth) mesh.normals.clear();
    for (const glm::vec3 p : mesh.positions) mesh.uvs.emplace_back(3.0f * p.x + p.y, p.z - 0.5f * p.x);
    test::add_mesh(scene, mesh, placement(c.mirrored));
    if (c.instanced) {  // a mesh that is used once is baked
        scene.instances.push_back(scene.instances[0]);
        scene.instances[1].world_from_object = glm::translate(glm::dmat4(1.0), {0.0, 1000.0, 0.0});
    }
    return scene;
}

class Surface : public testing::TestWithParam<Case> {};

/// What surface_at() should say, in double precision from the scene itself.
struct Expected {
    glm::dvec3 position, outwards, smooth;
    glm::dvec2 uv;
};
Expected expected_at(const Scene& scene, std::uint32_t instance, std::uint32_t primitive, float u, float v)
{
    const glm::dmat4& m = scene.instances[instance].world_from_object;
    const Mesh& mesh = scene.meshes[0];
    const glm::uvec3 t = mesh.triangles[primitive];
    const std::array<double, 3> weight = {1.0 - static_cast<double>(u) - static_cast<double>(v), static_cast<double>(u),
                                          static_cast<double>(v)};
    Expected e{glm::dvec3(0.0), glm::dvec3(0.0), glm::dvec3(0.0), glm::dvec2(0.0)};
    std::array<glm::dvec3, 3> corner;
    const glm::dmat3 normal_matrix = glm::transpose(glm::inverse(glm::dmat3(m)));
    for (int i = 0; i < 3; ++i) {
        const auto w = weight[static_cast<std::size_t>(i)];
        corner[static_cast<std::size_t>(i)] = glm::dvec3(m * glm::dvec4(glm::dvec3(mesh.positions[t[i]]), 1.0));
        e.position += w * corner[static_cast<std::size_t>(i)];
        if (!mesh.normals.empty()) e.smooth += w * (normal_matrix * glm::dvec3(mesh.normals[t[i]]));
        e.uv += w * glm::dvec2(mesh.uvs[t[i]]);
    }
    // The body is convex: the outside of a face is where the centre is not. No winding, no determinant.
    e.outwards = glm::normalize(glm::cross(corner[1] - corner[0], corner[2] - corner[0]));
    if (glm::dot(e.outwards, corner[0] - kCentre) < 0.0) e.outwards = -e.outwards;
    e.smooth = mesh.normals.empty() ? e.outwards : glm::normalize(e.smooth);
    return e;
}

void expect_surface(const SurfacePoint& point, const Expected& e, bool from_outside, const char* path)
{
    // Corners near 10 m are rounded by up to 5e-7 m, edges are 0.2 m and longer: normals turn by a few 1e-6.
    EXPECT_EQ(point.front, from_outside) << path;
    const double side = from_outside ? 1.0 : -1.0;
    EXPECT_LT(glm::distance(glm::dvec3(point.geometric_normal), side * e.outwards), 1e-5) << path;
    EXPECT_LT(glm::distance(glm::dvec3(point.shading_normal), side * e.smooth), 1e-5) << path;
    EXPECT_LT(glm::distance(glm::dvec2(point.uv), e.uv), 1e-5) << path;
    EXPECT_LT(glm::distance(glm::dvec3(point.position), e.position), 4.0 * static_cast<double>(point.position_error))
        << path;
    EXPECT_LT(point.position_error, 1e-4f) << path;
}

TEST_P(Surface, OfAPacketsHitIsThatOfTheSameTriangleWhereverTheMeshIsKept)
{
    const Scene scene = ellipsoid(GetParam());
    ThreadPool pool(1);
    const RayScene rays = build_ray_scene(scene, pool);
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    const auto direction = [&] { return glm::normalize(glm::dvec3(normal(random), normal(random), normal(random))); };
    int hits = 0;
    for (int round = 0; round < 200; ++round) {
        const bool outside = round % 2 == 0;  // fronts are seen from outside, backs from inside
        HitPacket packet;
        reset(packet.ray);
        for (int lane = 0; lane < RayPacket::kWidth; ++lane) {
            const glm::vec3 origin(kCentre + (outside ? 6.0 : 0.3) * direction());
            const glm::vec3 d = outside ? glm::vec3(kCentre + 0.5 * direction()) - origin : glm::vec3(direction());
            packet.ray.origin_x[lane] = origin.x;
            packet.ray.origin_y[lane] = origin.y;
            packet.ray.origin_z[lane] = origin.z;
            packet.ray.direction_x[lane] = d.x;
            packet.ray.direction_y[lane] = d.y;
            packet.ray.direction_z[lane] = d.z;
            packet.ray.t_max[lane] = std::numeric_limits<float>::infinity();
        }
        intersect(rays, 0xffffu, packet);
        FacePacket faces;
        find_faces(rays, packet, faces);
        for (int lane = 0; lane < RayPacket::kWidth; ++lane) {
            ASSERT_NE(packet.geometry[lane], RayPacket::kMiss) << "every ray aims at the body";
            ASSERT_EQ(packet.instance(lane), 0u);
            const glm::vec3 d(packet.ray.direction_x[lane], packet.ray.direction_y[lane], packet.ray.direction_z[lane]);
            const glm::vec3 o(packet.ray.origin_x[lane], packet.ray.origin_y[lane], packet.ray.origin_z[lane]);
            const Expected e = expected_at(scene, 0, packet.primitive[lane], packet.u[lane], packet.v[lane]);
            // The plane of the face gives the hit's own distance along the ray.
            const glm::vec3 q(faces.plane_x[lane], faces.plane_y[lane], faces.plane_z[lane]);
            EXPECT_NEAR(glm::dot(q, d) * packet.ray.t_max[lane], 1.0f, 1e-4f);
            HitSurface of_packet = begin_hit(rays, packet, faces, lane);
            complete_hit(rays, packet, lane, of_packet);
            expect_surface(of_packet.point, e, outside, "packet");
            expect_surface(surface_at(rays, 0, packet.primitive[lane], packet.u[lane], packet.v[lane], d), e, outside,
                           "surface_at");
            const std::optional<Hit> hit = intersect(rays, {o, d});
            ASSERT_TRUE(hit);
            EXPECT_NEAR(hit->t, packet.ray.t_max[lane], 1e-4f * hit->t);
            if (HasFailure()) return;
            ++hits;
        }
    }
    EXPECT_EQ(hits, 200 * RayPacket::kWidth);
}

TEST_P(Surface, IsMetByFewerRaysThanAPacketHasLanesWhateverTheOthersHold)
{
    const Scene scene = ellipsoid(GetParam());
    ThreadPool pool(1);
    const RayScene rays = build_ray_scene(scene, pool);
    const Ray ray{glm::vec3(kCentre + glm::dvec3(0.0, 0.0, 6.0)), glm::vec3(0.0f, 0.0f, -1.0f)};
    const std::optional<Hit> expected = intersect(rays, ray);
    ASSERT_TRUE(expected);
    for (const float held :
         {std::numeric_limits<float>::quiet_NaN(), -1.98071e28f, std::numeric_limits<float>::infinity(), 1.8e-39f}) {
        for (const std::uint32_t active : {0x00ffu, 0xff00u, 0x0001u, 0x8421u}) {
            HitPacket packet;
            reset(packet.ray);
            for (std::size_t lane = 0; lane < RayPacket::kWidth; ++lane) {
                const Ray other{glm::vec3(held), glm::vec3(held), 0.0f, held};
                set_lane(packet.ray, lane, (active >> lane & 1u) != 0u ? ray : other);
            }
            RayPacket shadow = packet.ray;
            intersect(rays, active, packet);
            occluded(rays, active, shadow);
            for (std::size_t lane = 0; lane < RayPacket::kWidth; ++lane) {
                if ((active >> lane & 1u) == 0u) continue;
                EXPECT_NEAR(packet.ray.t_max[lane], expected->t, 1e-4f * expected->t) << held << " beside " << lane;
                EXPECT_LT(shadow.t_max[lane], 0.0f) << held << " beside " << lane;
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Meshes, Surface,
                         testing::Values(Case{"baked", false, false, true}, Case{"mirrored", true, false, true},
                                         Case{"instanced", false, true, true},
                                         Case{"mirrored_instanced", true, true, true},
                                         Case{"flat_baked", false, false, false},
                                         Case{"flat_mirrored_instanced", true, true, false}),
                         [](const auto& c) { return c.param.name; });

/// A convex body of edge length about `scale`, its centre `offset` times its size away from zero.
Scene convex_body(double scale, double offset, bool instanced)
{
    Scene scene;
    test::add_mesh(scene, test::icosphere(glm::vec3(0.0f), 1.0f, 2, test::add_material(scene, glm::vec3(0.5f))));
    glm::dmat4 m = glm::translate(glm::dmat4(1.0), scale * offset * glm::dvec3(1.0, -0.7, 0.4));
    m = glm::scale(glm::rotate(m, 1.1, glm::dvec3(0.0, 0.6, 0.8)), glm::dvec3(scale));
    scene.instances[0].world_from_object = m;
    if (instanced) {
        scene.instances.push_back(scene.instances[0]);
        scene.instances[1].world_from_object = glm::translate(glm::dmat4(1.0), glm::dvec3(0.0, 1e4 * scale, 0.0)) * m;
    }
    return scene;
}

/// Points on random triangles of instance 0 with outward directions, every fourth of them grazing.
struct Start {
    SurfacePoint point;
    glm::vec3 direction;
};
std::vector<Start> random_starts(const RayScene& rays, int count, unsigned seed)
{
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    std::normal_distribution<float> normal;
    const auto triangles = static_cast<float>(rays.scene().meshes[0].triangles.size());
    std::vector<Start> starts;
    for (int i = 0; i < count; ++i) {
        const float r = std::sqrt(unit(random));
        const float u = r * unit(random);
        const auto primitive = static_cast<std::uint32_t>(unit(random) * 0.9999f * triangles);
        glm::vec3 d = glm::normalize(glm::vec3(normal(random), normal(random), normal(random)));
        // Seen from outside: against the direction from the body's centre to the triangle.
        const std::array<glm::vec3, 3> c = triangle_corners(rays, 0, primitive);
        const glm::vec3 centre(glm::dvec3(rays.scene().instances[0].world_from_object[3]));
        const SurfacePoint point = surface_at(rays, 0, primitive, u, r - u, centre - c[0]);
        const float up = glm::dot(d, point.geometric_normal);
        d += (i % 4 == 0 ? 1e-3f - up : std::abs(up) - up) * point.geometric_normal;
        starts.push_back({point, d});
    }
    return starts;
}

TEST(RayFrom, NeverMeetsTheConvexSurfaceItLeaves)
{
    const std::vector<double> scales = {1e-3, 1e-1, 1.0, 30.0, 1e3, 1e5};
    int tried = 0;
    for (const double scale : scales) {
        for (const double offset : {0.0, 3.0, 100.0}) {
            for (const bool instanced : {false, true}) {
                const Scene scene = convex_body(scale, offset, instanced);
                ThreadPool pool(1);
                const RayScene rays = build_ray_scene(scene, pool);
                int again = 0;
                for (const Start& s : random_starts(rays, 3000, 11)) {
                    again += occluded(rays, ray_from(s.point, s.direction)) ? 1 : 0;
                    ++tried;
                }
                EXPECT_EQ(again, 0) << "scale " << scale << ", offset " << offset << (instanced ? ", instanced" : "");
            }
        }
    }
    EXPECT_GE(tried, 100000);
}

TEST(RayFrom, InwardsMeetsTheOtherSideOfTheBody)
{
    const Scene scene = convex_body(1.0, 3.0, false);
    ThreadPool pool(1);
    const RayScene rays = build_ray_scene(scene, pool);
    for (const Start& s : random_starts(rays, 3000, 12)) {
        const glm::vec3 inwards = -s.point.geometric_normal;
        const std::optional<Hit> hit = intersect(rays, ray_from(s.point, inwards));
        ASSERT_TRUE(hit);
        // Facets of the twice subdivided sphere lie at least 0.98 from its centre.
        ASSERT_GT(hit->t, 1.9f);
    }
}

TEST(RayFrom, MovesTheOriginLessThanAMillionthOfTheScene)
{
    const Scene scene = convex_body(10.0, 1.0, false);
    ThreadPool pool(1);
    const RayScene rays = build_ray_scene(scene, pool);
    for (const Start& s : random_starts(rays, 300, 13)) {
        const Ray ray = ray_from(s.point, s.direction, 5.0f);
        EXPECT_LT(glm::distance(ray.origin, s.point.position), 3e-5f);
        EXPECT_EQ(ray.t_max, 5.0f);
        EXPECT_EQ(ray.direction, s.direction);
    }
}

TEST(ShadowRayFrom, ToALampWithoutEndHasNone)
{
    SurfacePoint point{};
    point.geometric_normal = point.shading_normal = {0.0f, 1.0f, 0.0f};
    point.position_error = 1e-6f;
    EXPECT_TRUE(std::isinf(shadow_ray_from(point, {0.0f, 1.0f, 0.0f}, std::numeric_limits<float>::infinity()).t_max));
    EXPECT_EQ(shadow_ray_from(point, {0.0f, 1.0f, 0.0f}, 1e-7f).t_max, 0.0f) << "never negative";
}

}  // namespace
}  // namespace rcs
