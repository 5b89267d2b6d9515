// The reference where surfaces are glossy, let light through, or see an environment image.
#include "rcs/reference.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "material/bsdf.h"
#include "scene/texture.h"
#include "support/lobes.h"
#include "support/scenes.h"
#include "support/tracing.h"
#include "util/random.h"

namespace rcs {
namespace {

constexpr double kPi = std::numbers::pi;

int add_glossy(Scene& scene, glm::vec3 color, float roughness, float metallic)
{
    const int index = test::add_material(scene, color);
    Material& m = scene.materials.back();
    m.specular = 1.0f;
    m.roughness = roughness;
    m.metallic = metallic;
    return index;
}

/// Looks straight down on x, z in [-1, 1] from height y.
Camera from_above(double y)
{
    Camera camera = look_at_camera("camera", {0.0, y, 0.0}, {0.0, 0.0, 0.0}, 0.8, {0.0, 0.0, -1.0});
    camera.projection = Projection::orthographic;
    camera.ymag = 1.0;
    return camera;
}

Texture checked(const std::vector<std::uint16_t>& alpha, const std::vector<std::uint16_t>& grey)
{
    Texture::Level level{static_cast<int>(alpha.size()), 1, {}};
    for (std::size_t i = 0; i < alpha.size(); ++i) level.texels.push_back({grey[i], grey[i], grey[i], alpha[i]});
    return make_texture("checked", std::move(level));
}

TEST(ReferenceGlossy, AWhiteMetalInAWhiteFurnaceConvergesToTheSky)
{
    for (const float roughness : {0.0f, 0.3f, 1.0f}) {
        Scene scene;
        const int white = add_glossy(scene, glm::vec3(1.0f), roughness, 1.0f);
        scene.materials[0].double_sided = true;
        test::add_mesh(scene, test::icosphere({-1.05f, 0.0f, 0.0f}, 1.0f, 4, white));
        test::add_mesh(scene, test::icosphere({1.05f, 0.0f, 0.0f}, 1.0f, 4, white));
        scene.sky_radiance = glm::vec3(2.0f);
        scene.cameras = {look_at_camera("camera", {0.0, 0.0, 5.0}, {0.0, 0.0, 0.0}, 0.5)};
        double before = 0.0;
        for (int bounces = 0; bounces <= 4; ++bounces) {
            const LayeredImage image = test::trace(scene, 16, {.samples = 256, .bounces = bounces});
            test::expect_sane(image);
            const double mean = test::mean(image, "indirect");
            EXPECT_GE(mean, before) << roughness;
            EXPECT_LE(mean, 2.0 * 1.01) << roughness;
            before = mean;
        }
        EXPECT_NEAR(before, 2.0, 0.02 * 2.0) << roughness;
    }
}

TEST(ReferenceGlossy, AClosedBoxThatEmitsAndReflectsEverythingGainsItsEmissionWithEachBounce)
{
    // Whatever the roughness, each reflection adds the same: the sum over n + 2 meetings with a wall.
    for (const float metallic : {0.0f, 1.0f}) {
        for (const float roughness : {0.0f, 0.2f, 0.6f, 1.0f}) {
            Scene scene = test::emissive_box(1.0f, 1.0f);
            scene.materials[0].specular = 1.0f;
            scene.materials[0].metallic = metallic;
            scene.materials[0].roughness = roughness;
            for (const int bounces : {0, 3}) {
                const LayeredImage image = test::trace(scene, 12, {.samples = 128, .bounces = bounces});
                test::expect_sane(image);
                EXPECT_NEAR(test::mean(image, "direct"), 1.0, 0.015) << roughness << ' ' << metallic;
                EXPECT_NEAR(test::mean(image, "beauty"), bounces + 2.0, 0.015 * (bounces + 2))
                    << roughness << ' ' << metallic;
            }
        }
    }
}

/// The floor under square_lamp(), glossy, seen from where a reflection of the lamp is.
Scene lamp_over_glossy_floor(float roughness, float metallic)
{
    Scene scene;
    const int floor = add_glossy(scene, {0.8f, 0.5f, 0.3f}, roughness, metallic);
    const int lamp = test::add_material(scene, glm::vec3(0.0f), glm::vec3(3.0f));
    test::add_mesh(scene, test::quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, floor));
    test::add_mesh(scene, test::quad({-0.5f, 1.0f, -1.5f}, {1, 0, 0}, {0, 0, 1}, lamp));
    scene.cameras = {look_at_camera("camera", {0.0, 1.0, 2.0}, {0.0, 0.0, 0.2}, 0.5)};
    return scene;
}

/// Integral over the lamp's area of f L cos cos' / d^2, and the same by sampling the BSDF alone.
struct TwoWays {
    glm::dvec3 by_area{0.0}, by_bsdf{0.0};
};
TwoWays lamp_light(const Bsdf& bsdf, glm::dvec3 p, glm::vec3 outgoing)
{
    TwoWays result;
    constexpr int kSteps = 400;
    for (int i = 0; i < kSteps; ++i) {
        for (int j = 0; j < kSteps; ++j) {
            const glm::dvec3 q(-0.5 + (i + 0.5) / kSteps, 1.0, -1.5 + (j + 0.5) / kSteps);
            const glm::dvec3 d = q - p;
            const double distance2 = glm::dot(d, d);
            const glm::vec3 w(d / std::sqrt(distance2));
            const double cosine = static_cast<double>(w.y);
            result.by_area +=
                glm::dvec3(evaluate(bsdf, outgoing, w)) * (3.0 * cosine * cosine / distance2 / (kSteps * kSteps));
        }
    }
    RandomStream random(17);
    constexpr int kSamples = 300000;
    for (int i = 0; i < kSamples; ++i) {
        const float choice = random.next(), u = random.next(), v = random.next();
        const BsdfSample s = sample(bsdf, outgoing, choice, {u, v});
        if (s.incoming.y <= 0.0f) continue;
        const glm::dvec3 q = p + glm::dvec3(s.incoming) * ((1.0 - p.y) / static_cast<double>(s.incoming.y));
        if (std::abs(q.x) < 0.5 && q.z > -1.5 && q.z < -0.5) result.by_bsdf += glm::dvec3(s.weight) * (3.0 / kSamples);
    }
    return result;
}

TEST(ReferenceGlossy, MultipleImportanceSamplingAgreesWithEitherWayAlone)
{
    for (const float metallic : {0.0f, 1.0f}) {
        for (const float roughness : {0.15f, 0.4f, 0.8f}) {
            const Scene scene = lamp_over_glossy_floor(roughness, metallic);
            const int size = 4;
            const LayeredImage image = test::trace(scene, size, {.samples = 4096, .bounces = 0});
            const glm::vec3 color(0.8f, 0.5f, 0.3f);
            const Bsdf bsdf = test::surface_of(
                {make_lobe<Specular>(glm::mix(glm::vec3(0.04f), color, metallic), 1.0f, roughness * roughness),
                 make_lobe<Diffuse>((1.0f - metallic) * color)},
                {0, 1, 0});
            const View view = test::view_of(scene.cameras[0], size, size);
            for (const int y : {0, 2}) {
                const CameraRay ray = camera_ray(view, 1.5, y + 0.5);
                const glm::dvec3 direction = glm::normalize(ray.direction);
                const glm::dvec3 p = ray.origin - direction * (ray.origin.y / direction.y);
                const TwoWays expected = lamp_light(bsdf, p, -glm::vec3(direction));
                for (int c = 0; c < 3; ++c) {
                    const double value = static_cast<double>(image.layers.at("direct").at(1, y)[c]);
                    const double noise =
                        4.0 * static_cast<double>(image.layers.at("standard_error").at(1, y)[c]) + 1e-4;
                    EXPECT_LT(noise, 0.15 * value);
                    EXPECT_NEAR(value, expected.by_area[c], noise) << roughness << ' ' << metallic;
                    EXPECT_NEAR(value, expected.by_bsdf[c], noise + 0.02 * value) << roughness << ' ' << metallic;
                }
            }
        }
    }
}

TEST(ReferenceGlossy, AMirrorShowsWhatTheMirroredCameraSees)
{
    const Scene scene = [] {
        Scene s = lamp_over_glossy_floor(0.0f, 1.0f);
        s.materials[0].base_color = glm::vec3(1.0f);
        return s;
    }();
    const int size = 32;
    const LayeredImage image = test::trace(scene, size, {.samples = 1024, .bounces = 0});
    const View view = test::view_of(scene.cameras[0], size, size);
    int inside = 0;
    for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
            const CameraRay ray = camera_ray(view, x + 0.5, y + 0.5);
            if (!(ray.direction.y < 0.0)) continue;
            // In the mirrored world the lamp lies at y = -1.
            const glm::dvec3 q = ray.origin - ray.direction * ((ray.origin.y + 1.0) / ray.direction.y);
            const double edge = std::min(0.5 - std::abs(q.x), 0.5 - std::abs(q.z + 1.0));
            if (std::abs(edge) < 0.15) continue;  // the lobe's tail: (1e-3 / 0.03 rad)^2 of its light
            inside += edge > 0.0;
            EXPECT_NEAR(image.layers.at("direct").at(x, y)[0], edge > 0.0 ? 3.0 : 0.0, 0.03) << x << ' ' << y;
        }
    }
    EXPECT_GT(inside, 8);
}

TEST(ReferenceGlossy, APaneLetsThroughWhatItDoesNotReflect)
{
    Scene scene;
    const int pane = add_glossy(scene, {0.9f, 0.8f, 0.7f}, 0.0f, 0.0f);
    scene.materials[0].transmission = 1.0f;
    scene.materials[0].double_sided = true;
    test::add_mesh(scene, test::quad({-9, 0, -9}, {0, 0, 18}, {18, 0, 0}, pane));
    scene.sky_radiance = glm::vec3(2.0f);
    for (const double height : {3.0, 0.5}) {
        scene.cameras = {look_at_camera("camera", {0.0, height, 2.0}, {0.0, 0.0, 0.0}, 0.01)};
        const LayeredImage image = test::trace(scene, 4, {.samples = 256, .bounces = 2});
        const double cosine = height / std::hypot(height, 2.0);
        const double fresnel = 0.04 + 0.96 * std::pow(1.0 - cosine, 5.0);
        for (int c = 0; c < 3; ++c) {
            const double color = 0.9 - 0.1 * c;
            EXPECT_NEAR(test::mean(image, "emission", c), 2.0 * color * (1.0 - fresnel), 0.005);
            EXPECT_NEAR(test::mean(image, "indirect", c), 2.0 * fresnel, 0.01);
        }
    }
}

TEST(ReferenceGlossy, ShadowRaysPassAPane)
{
    Scene scene;
    const int floor = test::add_material(scene, glm::vec3(1.0f));
    const int pane = add_glossy(scene, {0.9f, 0.8f, 0.7f}, 0.0f, 0.0f);
    scene.materials.back().transmission = 1.0f;
    test::add_mesh(scene, test::quad({-2, 0, -2}, {0, 0, 4}, {4, 0, 0}, floor));
    test::add_mesh(scene, test::quad({-2, 1, -2}, {0, 0, 4}, {4, 0, 0}, pane));
    PunctualLight sun;
    sun.kind = LightKind::directional;
    sun.direction = {0, -1, 0};
    sun.intensity = glm::vec3(static_cast<float>(kPi));
    scene.lights = {sun};
    scene.cameras = {from_above(0.5)};
    const LayeredImage image = test::trace(scene, 4, {.samples = 16, .bounces = 0});
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(test::mean(image, "direct", c), 0.96 * (0.9 - 0.1 * c), 1e-3);
}

/// A lamp above a screen of half the width, over a floor.
enum class Screen { geometry, mask, blend };
Scene screened_lamp(Screen screen)
{
    Scene scene;
    const int floor = test::add_material(scene, glm::vec3(0.8f), glm::vec3(0.0f), true);
    const int lamp = test::add_material(scene, glm::vec3(0.0f), glm::vec3(1.0f));
    const int cloth = test::add_material(scene, glm::vec3(0.6f), glm::vec3(0.0f), true);
    test::add_mesh(scene, test::quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, floor));
    test::add_mesh(scene, test::quad({-1, 2, -1}, {2, 0, 0}, {0, 0, 2}, lamp));
    if (screen == Screen::geometry) {
        test::add_mesh(scene, test::quad({-1, 1, -1}, {0, 0, 2}, {1, 0, 0}, cloth));
    } else {
        Mesh sheet = test::quad({-1, 1, -1}, {0, 0, 2}, {2, 0, 0}, cloth);
        sheet.uvs = {{0, 0}, {0, 1}, {1, 1}, {1, 0}};
        test::add_mesh(scene, sheet);
        Material& m = scene.materials[static_cast<std::size_t>(cloth)];
        m.base_color_texture = {.texture = 0, .wrap_u = Wrap::clamp_to_edge, .nearest = true};
        m.alpha_mode = screen == Screen::mask ? AlphaMode::mask : AlphaMode::blend;
        scene.textures.push_back(checked({65535, 0}, {65535, 65535}));
    }
    scene.cameras = {from_above(0.9)};
    return scene;
}

TEST(ReferenceGlossy, AMaskedSheetIsLikeOneThatIsCutOut)
{
    const ReferenceOptions options{.samples = 1024, .bounces = 2};
    const LayeredImage cut = test::trace(screened_lamp(Screen::geometry), 8, options);
    for (const Screen screen : {Screen::mask, Screen::blend}) {
        const LayeredImage image = test::trace(screened_lamp(screen), 8, options);
        test::expect_sane(image);
        for (const char* layer : {"direct", "indirect"}) {
            const Image &a = image.layers.at(layer), &b = cut.layers.at(layer);
            for (std::size_t i = 0; i < a.pixels.size(); ++i)
                EXPECT_NEAR(a.pixels[i], b.pixels[i], 0.02f * b.pixels[i] + 2e-3f) << layer;
        }
    }
}

TEST(ReferenceGlossy, TheCameraSeesLayersComposited)
{
    // An emitter of 4 behind veils of alpha 0.25 that emit 1 each, in front of a sky of 8.
    Scene scene;
    const int veil = test::add_material(scene, glm::vec3(0.0f), glm::vec3(1.0f));
    scene.materials.back().alpha = 0.25f;
    scene.materials.back().alpha_mode = AlphaMode::blend;
    const int wall = test::add_material(scene, glm::vec3(0.0f), glm::vec3(4.0f));
    for (const float z : {1.0f, 2.0f}) test::add_mesh(scene, test::quad({-9, -9, z}, {18, 0, 0}, {0, 18, 0}, veil));
    test::add_mesh(scene, test::quad({0, -9, 0}, {9, 0, 0}, {0, 18, 0}, wall));
    scene.sky_radiance = glm::vec3(8.0f);
    scene.cameras = {look_at_camera("camera", {0.0, 0.0, 5.0}, {0.0, 0.0, 0.0}, 0.5)};
    const LayeredImage image = test::trace(scene, 4, {.samples = 16, .bounces = 0});
    const double veils = 0.25 + 0.75 * 0.25, behind = 0.75 * 0.75;
    EXPECT_NEAR(image.layers.at("emission").at(3, 2)[0], veils + behind * 4.0, 1e-4);
    EXPECT_NEAR(image.layers.at("emission").at(0, 2)[0], veils + behind * 8.0, 1e-4);
}

TEST(ReferenceGlossy, ATexturedLampIsTheLampThatItsTexelsAre)
{
    Scene scene = test::square_lamp();
    Scene half = test::square_lamp();
    half.meshes[1] = test::quad({-1, 1, -1}, {1, 0, 0}, {0, 0, 2}, half.meshes[1].material);
    Mesh& lamp = scene.meshes[1];
    lamp.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    scene.materials[1].emission_texture = {.texture = 0, .wrap_u = Wrap::clamp_to_edge, .nearest = true};
    scene.textures.push_back(checked({65535, 65535}, {65535, 0}));
    for (const float metallic : {0.0f, 1.0f}) {
        for (Scene* s : {&scene, &half}) {
            s->materials[0].metallic = s->materials[0].specular = metallic;
            s->materials[0].roughness = 0.5f;
        }
        const LayeredImage a = test::trace(scene, 8, {.samples = 2048, .bounces = 0});
        const LayeredImage b = test::trace(half, 8, {.samples = 2048, .bounces = 0});
        const Image &textured = a.layers.at("direct"), &cut = b.layers.at("direct");
        for (std::size_t i = 0; i < cut.pixels.size(); ++i)
            EXPECT_NEAR(textured.pixels[i], cut.pixels[i], 0.03f * cut.pixels[i] + 2e-3f) << metallic;
    }
}

TEST(ReferenceGlossy, ThousandsOfEmissiveTrianglesGiveTheSameLightAsTwo)
{
    for (const float metallic : {0.0f, 1.0f}) {
        const Scene two = lamp_over_glossy_floor(0.4f, metallic);
        Scene many = two;
        Mesh tiles;
        tiles.material = two.meshes[1].material;
        constexpr int kSide = 40;
        const float step = 1.0f / kSide;
        for (int i = 0; i < kSide; ++i)
            for (int j = 0; j < kSide; ++j)
                test::merge(tiles, test::quad({-0.5f + step * static_cast<float>(i), 1.0f,
                                               -1.5f + step * static_cast<float>(j)},
                                              {step, 0, 0}, {0, 0, step}, tiles.material));
        many.meshes[1] = tiles;
        const LayeredImage a = test::trace(two, 8, {.samples = 2048, .bounces = 1});
        const LayeredImage b = test::trace(many, 8, {.samples = 2048, .bounces = 1});
        EXPECT_NEAR(test::mean(b, "direct"), test::mean(a, "direct"), 0.01 * test::mean(a, "direct")) << metallic;
    }
}

Scene under_image(const std::function<glm::vec3(double)>& radiance_at_height)
{
    Scene scene;
    const int floor = test::add_material(scene, glm::vec3(0.5f), glm::vec3(0.0f), true);
    test::add_mesh(scene, test::quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, floor));
    EnvironmentImage& image = scene.environment;
    image.width = 256;
    image.height = 128;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            image.radiance.push_back(radiance_at_height(std::cos(kPi * (y + 0.5) / image.height)));
    scene.cameras = {from_above(1.0)};
    return scene;
}

TEST(ReferenceGlossy, AnEnvironmentImageLightsAFloorByItsIntegral)
{
    // L = 1 + h with h the cosine to the zenith: E = pi + 2 pi / 3.
    const Scene soft = under_image([](double h) { return glm::vec3(static_cast<float>(1.0 + h)); });
    const double expected = 0.5 * (1.0 + 2.0 / 3.0);
    for (const int bounces : {0, 1}) {
        const LayeredImage image = test::trace(soft, 8, {.samples = 1024, .bounces = bounces});
        test::expect_sane(image);
        EXPECT_NEAR(test::mean(image, "direct") + test::mean(image, "indirect"), expected, 0.005 * expected);
    }
    // A cap of 10 degrees about the zenith that is 1000 times as bright: its share is direct.
    const double cap = std::cos(kPi / 18.0);
    const Scene sunny = under_image([&](double h) { return glm::vec3(h > cap ? 1000.0f : 1.0f); });
    const LayeredImage image = test::trace(sunny, 8, {.samples = 1024, .bounces = 0});
    // pi sin^2 of the cap, as the rows have it: those whose centres lie within.
    const double rows = std::floor(10.0 / 180.0 * 128.0 + 0.5);
    const double sine = std::sin(kPi * rows / 128.0);
    const double total = 0.5 * (1.0 + 999.0 * sine * sine);
    EXPECT_NEAR(test::mean(image, "direct") + test::mean(image, "indirect"), total,
                0.03 * total);  // bilinear at the rim
    EXPECT_GT(test::mean(image, "direct"), 0.9 * total);
}

TEST(ReferenceGlossy, AConstantImageIsAConstantSky)
{
    Scene image_sky = under_image([](double) { return glm::vec3(2.0f); });
    for (const float metallic : {0.0f, 1.0f}) {
        Material& m = image_sky.materials[0];
        m.specular = 1.0f;
        m.metallic = metallic;
        m.roughness = 0.3f;
        Scene constant = image_sky;
        constant.environment = {};
        constant.sky_radiance = glm::vec3(2.0f);
        const LayeredImage a = test::trace(image_sky, 6, {.samples = 1024, .bounces = 1});
        const LayeredImage b = test::trace(constant, 6, {.samples = 1024, .bounces = 1});
        EXPECT_NEAR(test::mean(a, "beauty"), test::mean(b, "beauty"), 0.005 * test::mean(b, "beauty"));
        EXPECT_EQ(test::mean(a, "direct"), 0.0);
    }
}

}  // namespace
}  // namespace rcs
