// The reference in scenes whose light is known by formula.
#include "rcs/reference.h"

#include <cmath>
#include <numbers>
#include <utility>

#include <gtest/gtest.h>

#include "rays/surface.h"
#include "support/scenes.h"
#include "support/tracing.h"
#include "util/random.h"

namespace rcs {
namespace {

constexpr double kPi = std::numbers::pi;

TEST(ReferenceTransport, WhiteFurnaceReflectsAlbedoTimesTheSky)
{
    const LayeredImage image = test::trace(test::furnace(0.7f, 2.0f), 24, {.samples = 64, .bounces = 0});
    test::expect_sane(image);
    EXPECT_NEAR(test::mean(image, "indirect"), 0.7 * 2.0, 0.005 * 1.4);
    EXPECT_EQ(test::mean(image, "direct"), 0.0);
    const Image& beauty = image.layers.at("beauty");
    EXPECT_EQ(beauty.at(0, 0)[0], 2.0f) << "the sky itself";
    EXPECT_EQ(beauty.at(0, 0)[3], 0.0f);
    EXPECT_TRUE(std::isinf(*image.layers.at("depth").at(0, 0)));
}

TEST(ReferenceTransport, SkyLightsEverySurfaceOfAPathAlsoTheLast)
{
    // A floor and a wall of albedo rho that each fill half of the other's hemisphere at the corner: in the
    // corner half the sky is seen directly, the other half is the wall, which sees half the sky itself.
    // With N = 1: rho L (1/2 + rho/2 1/2); the form factor 1/2 holds within d/h = 1e-3 of the corner.
    Scene scene;
    const float rho = 0.6f;
    const int white = test::add_material(scene, glm::vec3(rho), glm::vec3(0.0f), true);
    test::add_mesh(scene, test::quad({0, 0, -1e3f}, {0, 0, 2e3f}, {1e3f, 0, 0}, white));
    test::add_mesh(scene, test::quad({0, 0, -1e3f}, {0, 1e3f, 0}, {0, 0, 2e3f}, white));
    scene.sky_radiance = glm::vec3(1.0f);
    Camera camera = look_at_camera("camera", {0.5, 0.5, 0.0}, {0.5, 0.0, 0.0}, 0.8, {0.0, 0.0, -1.0});
    camera.projection = Projection::orthographic;
    camera.ymag = 0.1;
    scene.cameras = {camera};
    const double bounce0 = rho * 0.5;
    // A wall point at height z sees half its hemisphere filled by the floor, so sees half the sky.
    const double bounce1 = bounce0 + rho * 0.5 * rho * 0.5;
    const double bounce2 = bounce1 + rho * rho * rho * 0.125;
    const double expected[] = {bounce0, bounce1, bounce2};
    for (int bounces = 0; bounces <= 2; ++bounces) {
        const LayeredImage image = test::trace(scene, 8, {.samples = 1024, .bounces = bounces});
        EXPECT_NEAR(test::mean(image, "indirect"), expected[bounces], 0.005 * expected[bounces]) << bounces;
    }
}

TEST(ReferenceTransport, ClosedEmissiveBoxSumsTheGeometricSeries)
{
    for (const float rho : {0.2f, 0.5f, 0.95f}) {
        for (const int bounces : {0, 1, 2, 3, 5, 8}) {
            const LayeredImage image =
                test::trace(test::emissive_box(rho, 3.0f), 12, {.samples = 128, .bounces = bounces});
            test::expect_sane(image);
            const double r = static_cast<double>(rho);
            const double expected = 3.0 * (1.0 - std::pow(r, bounces + 2)) / (1.0 - r);
            EXPECT_NEAR(test::mean(image, "beauty"), expected, 0.005 * expected) << rho << ' ' << bounces;
            EXPECT_EQ(test::mean(image, "emission"), 3.0);
            EXPECT_NEAR(test::mean(image, "direct"), 3.0 * r, 0.005 * 3.0 * r);
        }
    }
}

TEST(ReferenceTransport, SphereWithCentralLightHasUniformIndirectIrradiance)
{
    const float rho = 0.6f;
    const LayeredImage image = test::trace(test::lit_sphere(rho), 16, {.samples = 256, .bounces = 1});
    const double direct_irradiance = 1.0 / 4.0;  // I / r^2
    const double r = static_cast<double>(rho);
    const double direct = r / kPi * direct_irradiance;
    EXPECT_NEAR(test::mean(image, "direct"), direct, 0.002 * direct);
    // Phi = 4 pi I, so rho Phi / (4 pi r^2) = rho I / r^2 at every point of the wall.
    const double expected = r / kPi * r * direct_irradiance;
    EXPECT_NEAR(test::mean(image, "indirect"), expected, 0.005 * expected);
    const Image& indirect = image.layers.at("indirect");
    for (std::size_t i = 0; i < indirect.pixels.size(); ++i)
        ASSERT_NEAR(indirect.pixels[i], expected, 0.01 * expected) << "uniform over the wall, facets aside";
    const LayeredImage three = test::trace(test::lit_sphere(rho), 8, {.samples = 256, .bounces = 3});
    const double series = r / kPi * direct_irradiance * (r + r * r + r * r * r);
    EXPECT_NEAR(test::mean(three, "indirect"), series, 0.005 * series);
}

TEST(ReferenceTransport, SquareLampGivesLambertsIrradianceAtEveryPixel)
{
    const int size = 16;
    const LayeredImage image = test::trace(test::square_lamp(), size, {.samples = 1024, .bounces = 0});
    for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
            const double px = (x + 0.5) / size * 2.0 - 1.0;
            const double pz = (y + 0.5) / size * 2.0 - 1.0;
            const double expected = test::rectangle_irradiance(-1 - px, 1 - px, -1 - pz, 1 - pz, 1.0) / kPi;
            EXPECT_NEAR(image.layers.at("direct").at(x, y)[0], expected, 0.005 * expected) << x << ' ' << y;
        }
    }
    EXPECT_EQ(test::mean(image, "indirect"), 0.0);
}

TEST(ReferenceTransport, ManyEmissiveTrianglesGiveTheSameLightAsTwo)
{
    // 200 triangles: more than are weighed by their exact irradiance.
    Scene scene = test::square_lamp();
    Mesh tiles;
    tiles.material = scene.meshes[1].material;
    for (int i = 0; i < 10; ++i) {
        for (int j = 0; j < 10; ++j) {
            const float x = 0.2f * static_cast<float>(i) - 1.0f;
            const float z = 0.2f * static_cast<float>(j) - 1.0f;
            test::merge(tiles, test::quad({x, 1.0f, z}, {0.2f, 0, 0}, {0, 0, 0.2f}, tiles.material));
        }
    }
    scene.meshes[1] = tiles;
    const int size = 8;
    const LayeredImage image = test::trace(scene, size, {.samples = 1024, .bounces = 0});
    for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
            const double px = (x + 0.5) / size * 2.0 - 1.0;
            const double pz = (y + 0.5) / size * 2.0 - 1.0;
            const double expected = test::rectangle_irradiance(-1 - px, 1 - px, -1 - pz, 1 - pz, 1.0) / kPi;
            EXPECT_NEAR(image.layers.at("direct").at(x, y)[0], expected, 0.02 * expected) << x << ' ' << y;
        }
    }
}

TEST(ReferenceTransport, FloorBesideALitWallFollowsTheFormFactorIntoTheCorner)
{
    const int size = 32;
    const LayeredImage image = test::trace(test::lit_corner(), size, {.samples = 1024, .bounces = 1});
    const double peak = 0.5 * 0.5;  // albedo / pi times pi / 2
    for (int x = 0; x < size; ++x) {
        const double d = (x + 0.5) / size * 2.0;
        const double expected = 0.5 / kPi * test::wall_irradiance(d, 2.0);
        // Every row is the same scene. 32 rows of 1024 paths, each 0 or 1/2: a standard error of at most
        // 0.25 / sqrt(32768) = 0.0014, 0.6 % of the peak, for independent paths; the Sobol' points do better.
        double column_mean = 0.0;
        for (int y = 0; y < size; ++y)
            column_mean += static_cast<double>(image.layers.at("indirect").at(x, y)[0]) / size;
        EXPECT_NEAR(column_mean, expected, 0.005 * peak) << x;
    }
    EXPECT_EQ(test::mean(image, "direct"), 0.0);
}

TEST(ReferenceTransport, LampsShineFromTheFrontOnlyUnlessDoubleSided)
{
    for (const bool double_sided : {false, true}) {
        Scene scene = test::square_lamp();
        scene.materials[1].double_sided = double_sided;
        std::swap(scene.meshes[1].positions[1], scene.meshes[1].positions[3]);  // turn the front upwards
        const double light = test::mean(test::trace(scene, 8, {.samples = 64, .bounces = 0}), "direct");
        if (double_sided)
            EXPECT_GT(light, 0.3);
        else
            EXPECT_EQ(light, 0.0);
    }
}

TEST(ReferenceTransport, CameraLooksThroughBacksButLightDoesNot)
{
    // A single-sided blocker just below the camera, its back towards it, hides the lamp from the floor.
    Scene scene = test::square_lamp();
    const int blocker = test::add_material(scene, glm::vec3(0.5f));
    test::add_mesh(scene, test::quad({-2, 0.5f, -2}, {4, 0, 0}, {0, 0, 4}, blocker));
    const LayeredImage image = test::trace(scene, 8, {.samples = 64, .bounces = 0});
    EXPECT_EQ(test::mean(image, "albedo"), 1.0) << "the floor is seen";
    EXPECT_NEAR(test::mean(image, "depth"), 0.9, 1e-6);
    EXPECT_EQ(test::mean(image, "direct"), 0.0) << "and it is in shadow";
}

TEST(ReferenceTransport, PointLightsChosenOneByOneDeepInAPathAddUp)
{
    // Two lamps of different strength beside one of their sum's strength, all at the sphere's centre.
    Scene one = test::lit_sphere(0.6f);
    Scene two = one;
    one.lights[0].intensity = {3.0f, 1.0f, 1.5f};
    two.lights[0].intensity = {1.0f, 0.0f, 1.5f};
    two.lights.push_back(test::point_light({0.0, 0.0, 0.0}, {2.0f, 1.0f, 0.0f}));
    const LayeredImage a = test::trace(one, 8, {.samples = 1024, .bounces = 1});
    const LayeredImage b = test::trace(two, 8, {.samples = 1024, .bounces = 1});
    for (int channel = 0; channel < 3; ++channel) {
        const double expected = test::mean(a, "indirect", channel);
        EXPECT_NEAR(test::mean(b, "indirect", channel), expected, 0.01 * expected) << channel;
        EXPECT_NEAR(test::mean(b, "direct", channel), test::mean(a, "direct", channel), 1e-5);
    }
}

TEST(ReferenceTransport, DirectLayerEqualsTheLampsThatCosineRaysRunInto)
{
    // The same light by another way: no next-event estimation, no solid angles, no choice of lamps.
    Scene scene = test::furnished_room();
    scene.lights.clear();
    ThreadPool pool(2);
    const RayScene rays = build_ray_scene(scene, pool);
    const int size = 6;
    const View view = test::view_of(scene.cameras[0], size, size);
    const LayeredImage image = render_reference(rays, view, {.samples = 1024, .bounces = 0}, pool);
    const int n = 100000;
    double sum = 0.0, squares = 0.0;
    RandomStream random(1);
    for (int i = 0; i < size * size; ++i) {
        const CameraRay camera = camera_ray(view, i % size + 0.5, i / size + 0.5);
        const glm::vec3 view_direction(camera.direction);
        const auto hit = intersect(rays, {.origin = glm::vec3(camera.origin), .direction = view_direction});
        ASSERT_TRUE(hit);
        const SurfacePoint point = surface_at(rays, hit->instance, hit->primitive, hit->u, hit->v, view_direction);
        double pixel = 0.0;
        for (int k = 0; k < n; ++k) {
            // A point on the unit sphere that touches the surface from above: cosine distributed.
            const float z = 2.0f * random.next() - 1.0f;
            const float phi = 2.0f * std::numbers::pi_v<float> * random.next();
            const float r = std::sqrt(1.0f - z * z);
            const glm::vec3 on_sphere(r * std::cos(phi), r * std::sin(phi), z);
            const glm::vec3 direction = point.shading_normal + on_sphere;
            const auto next = intersect(rays, ray_from(point, direction));
            if (!next) continue;
            const SurfacePoint met = surface_at(rays, next->instance, next->primitive, next->u, next->v, direction);
            const Material& material = scene.materials[static_cast<std::size_t>(met.material)];
            pixel += static_cast<double>(emitted_radiance(material, met.front).g) / n;
        }
        const float albedo = scene.materials[static_cast<std::size_t>(point.material)].base_color.g;
        sum += static_cast<double>(albedo) * pixel;
        // Each ray brings 0 or 5: the variance of their mean.
        squares += static_cast<double>(albedo * albedo) * pixel * (5.0 - pixel) / n;
    }
    const double count = size * size;
    EXPECT_NEAR(test::mean(image, "direct", 1), sum / count, 4.0 * std::sqrt(squares) / count);
    EXPECT_LT(4.0 * std::sqrt(squares), 0.02 * sum) << "else the comparison says little";
}

}  // namespace
}  // namespace rcs
