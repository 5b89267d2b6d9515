// Every kind of lobe beyond metal and dielectric: the renderer against the reference, which shares the surface and none
// of the techniques.
#include <cmath>
#include <initializer_list>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "rcs/render.h"
#include "support/scenes.h"
#include "support/session.h"
#include "support/tracing.h"

namespace rcs {
namespace {

struct Case {
    std::string name;
    Material material;
    double most_bias = 0.03, most_difference = 0.05;  ///< of a layer
};

Material cloth(float roughness, glm::vec3 color)
{
    Material m = test::glossy(0.0f, 0.8f, {0.5f, 0.3f, 0.2f});
    m.sheen_color = color;
    m.sheen_roughness = roughness;
    return m;
}

Material brushed(float roughness, float strength)
{
    Material m = test::glossy(1.0f, roughness, {0.9f, 0.7f, 0.5f});
    m.anisotropy = strength;
    m.anisotropy_rotation = 0.5f;
    return m;
}

Material leaf(float roughness, float part)
{
    Material m = test::glossy(0.0f, roughness, {0.3f, 0.6f, 0.2f});
    m.diffuse_transmission = part;
    m.diffuse_transmission_color = {0.8f, 0.9f, 0.3f};
    return m;
}

std::vector<Case> cases()
{
    std::vector<Case> all;
    for (const float roughness : {0.1f, 0.35f, 0.7f, 1.0f})
        all.push_back({"sheen " + std::to_string(roughness), cloth(roughness, {0.9f, 0.8f, 1.0f})});
    // What narrow metal throws on others comes blurred, up to 3 % too little (docs/method.md, Records), give or take
    // the paths' own noise.
    for (const float strength : {0.0f, 0.8f})
        for (const float roughness : {0.15f, 0.4f, 0.7f})
            all.push_back({"metal " + std::to_string(roughness) + ", brushed " + std::to_string(strength),
                           brushed(roughness, strength), 0.035, roughness < 0.5f ? 0.07 : 0.05});
    for (const float roughness : {0.2f, 0.8f})
        all.push_back({"leaf " + std::to_string(roughness), leaf(roughness, 0.6f)});
    all.push_back({"paper", leaf(1.0f, 1.0f)});
    all.back().material.specular = 0.0f;
    return all;
}

LayeredImage rendered(const Scene& scene, int size, int bounces)
{
    RenderOptions options;
    options.width = options.height = size;
    options.aa = 1;
    options.bounces = bounces;
    options.quality = QualitySettings{.error_tolerance = 0.1f, .rays = 1024};
    options.lobe_rays = 64;
    return test::render_first(scene, options, 2).image;
}

/// A ball and a leaf on a floor of the material (of a diffuse one under metal, of which hits see a wider lobe) before a
/// wall, in the light of a lamp above and one behind them.
Scene ball_on_a_floor(const Material& material)
{
    Scene scene;
    const int own = test::add_material(scene, material);
    scene.materials.back().double_sided = true;
    const int wall = test::add_material(scene, {0.7f, 0.6f, 0.5f}, glm::vec3(0.0f), true);
    const int lamp = test::add_material(scene, glm::vec3(0.0f), glm::vec3(12.0f), true);
    test::add_mesh(scene, test::icosphere({0.0f, 0.6f, 0.0f}, 0.6f, 5, own));
    test::add_mesh(scene, test::quad({-2, 0, 2}, {4, 0, 0}, {0, 0, -4}, material.metallic > 0.0f ? wall : own));
    test::add_mesh(scene, test::quad({0.7f, 0.0f, 0.2f}, {0.7f, 0, -0.2f}, {0, 1.3f, 0}, own));
    test::add_mesh(scene, test::quad({-2, 0, -2}, {4, 0, 0}, {0, 3, 0}, wall));
    test::add_mesh(scene, test::quad({-2, 0, 2}, {0, 0, -4}, {0, 3, 0}, wall));
    test::add_mesh(scene, test::quad({-0.4f, 2.6f, -0.2f}, {0.8f, 0, 0}, {0, 0, 0.8f}, lamp));
    PunctualLight point;
    point.position = {1.4, 1.0, -1.2};
    point.intensity = glm::vec3(2.0f);
    scene.lights.push_back(point);
    scene.cameras = {look_at_camera("camera", {1.6, 1.3, 3.0}, {0.0, 0.5, 0.0}, 0.7)};
    return scene;
}

struct Difference {
    double ratio;  ///< of the means
    double mean;   ///< of the absolute differences of blocks of 4 x 4 pixels, over the mean
};
Difference compare(const Image& found, const Image& expected)
{
    constexpr int kBlock = 4;
    double sum = 0.0, truth = 0.0, difference = 0.0;
    for (int y = 0; y < found.height; y += kBlock) {
        for (int x = 0; x < found.width; x += kBlock) {
            glm::dvec3 a(0.0), b(0.0);
            for (int j = 0; j < kBlock; ++j)
                for (int i = 0; i < kBlock; ++i)
                    for (int c = 0; c < 3; ++c) {
                        a[c] += static_cast<double>(found.at(x + i, y + j)[c]);
                        b[c] += static_cast<double>(expected.at(x + i, y + j)[c]);
                    }
            for (int c = 0; c < 3; ++c) {
                sum += a[c];
                truth += b[c];
                difference += std::abs(a[c] - b[c]);
            }
        }
    }
    return {sum / truth, difference / truth};
}

/// Renders and traces the scene, and expects no larger differences.
void expect_as_traced(const Scene& scene, std::initializer_list<const char*> layers, int bounces, double most_bias,
                      double most_difference)
{
    constexpr int kSize = 32;
    const LayeredImage image = rendered(scene, kSize, bounces);
    const LayeredImage truth = test::trace(scene, kSize, {.samples = 512, .bounces = bounces});
    for (const char* layer : layers) {
        const Difference d = compare(image.layers.at(layer), truth.layers.at(layer));
        EXPECT_NEAR(d.ratio, 1.0, most_bias) << layer;
        EXPECT_LT(d.mean, most_difference) << layer;
    }
}

TEST(LobeRender, AgreesWithTheReferenceForEachLobe)
{
    for (const auto& [name, material, most_bias, most_difference] : cases()) {
        SCOPED_TRACE(name);
        expect_as_traced(ball_on_a_floor(material), {"direct", "indirect"}, 2, most_bias, most_difference);
    }
}

/// Three walls of metal that show each other, and the floor, lit from above. @param roughness  of the two side walls
Scene metal_lift(float roughness)
{
    Scene scene;
    const int sides = test::add_material(scene, test::glossy(1.0f, roughness, {0.8f, 0.8f, 0.8f}));
    const int back = test::add_material(scene, test::glossy(1.0f, 0.35f, {0.8f, 0.7f, 0.6f}));
    const int floor = test::add_material(scene, glm::vec3(0.5f));
    const int lamp = test::add_material(scene, glm::vec3(0.0f), glm::vec3(10.0f));
    test::add_mesh(scene, test::quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, floor));
    test::add_mesh(scene, test::quad({-1, 0, 1}, {0, 0, -2}, {0, 2.4f, 0}, sides));
    test::add_mesh(scene, test::quad({1, 0, -1}, {0, 0, 2}, {0, 2.4f, 0}, sides));
    test::add_mesh(scene, test::quad({-1, 0, -1}, {2, 0, 0}, {0, 2.4f, 0}, back));
    test::add_mesh(scene, test::quad({-0.3f, 2.4f, -0.3f}, {0.6f, 0, 0}, {0, 0, 0.6f}, lamp));
    scene.cameras = {look_at_camera("camera", {0.0, 1.4, 1.0}, {0.0, 1.1, -1.0}, 1.1)};
    return scene;
}

// Each wall's lobe is seen through another's: were it widened, the sides would come out half as bright again.
TEST(LobeRender, FlatMetalShowsFlatMetalAsItIs)
{
    for (const float roughness : {0.3f, 0.48f}) {
        SCOPED_TRACE(roughness);
        expect_as_traced(metal_lift(roughness), {"indirect"}, 1, 0.02, 0.06);
    }
}

/// A wall a little beside a metal floor that a sun shines along: what the floor sends it comes from far beside its
/// mirror direction.
Scene wall_beside_a_sunlit_floor(float roughness)
{
    Scene scene;
    const int floor = test::add_material(scene, test::glossy(1.0f, roughness, {0.9f, 0.9f, 0.9f}));
    const int wall = test::add_material(scene, glm::vec3(0.5f));
    test::add_mesh(scene, test::quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -1.2f}, floor));
    test::add_mesh(scene, test::quad({-1, 0, -1}, {2, 0, 0}, {0, 2, 0}, wall));
    PunctualLight sun;
    sun.kind = LightKind::directional;
    sun.direction = glm::normalize(glm::vec3(1.0f, -1.0f, 0.0f));
    sun.intensity = glm::vec3(5.0f);
    scene.lights.push_back(sun);
    scene.cameras = {look_at_camera("camera", {0.0, 1.2, 1.0}, {0.0, 1.1, -1.0}, 0.6)};
    return scene;
}

// A lobe that is widened as a whole throws there as much more as its width is squared: the wall was 18 and 2.7 times
// too bright.
TEST(LobeRender, NarrowLobesSendLittleFarBesideTheirPeak)
{
    for (const float roughness : {0.1f, 0.16f}) {
        SCOPED_TRACE(roughness);
        expect_as_traced(wall_beside_a_sunlit_floor(roughness), {"indirect"}, 1, 0.03, 0.08);
    }
}

// As in glossy_render_test: a white body under a white sky cannot be told from the sky; a sheet, where light goes
// through.
TEST(LobeRender, AWhiteFurnaceHidesEachLobe)
{
    for (auto [name, material, most_bias, most_difference] : cases()) {
        material.base_color = glm::vec3(1.0f);
        material.diffuse_transmission_color = glm::vec3(1.0f);
        material.sheen_color = glm::vec3(material.sheen_color != glm::vec3(0.0f) ? 1.0f : 0.0f);
        Scene scene;
        scene.sky_radiance = glm::vec3(1.0f);
        const int own = test::add_material(scene, material);
        test::add_mesh(scene, material.diffuse_transmission > 0.0f ? test::quad({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, own)
                                                                   : test::icosphere({0, 0, 0}, 1.0f, 4, own));
        scene.cameras.push_back(look_at_camera("front", {0, 0, 4}, {0, 0, 0}, 0.6));
        const LayeredImage image = rendered(scene, 48, 1);
        double mean = 0.0, worst = 0.0;
        for (int y = 0; y < 48; ++y)
            for (int x = 0; x < 48; ++x) {
                const double value = static_cast<double>(image.layers.at("beauty").at(x, y)[1]);
                mean += value / (48.0 * 48.0);
                if ((x - 23.5) * (x - 23.5) + (y - 23.5) * (y - 23.5) < 15.0 * 15.0)
                    worst = std::max(worst, std::abs(value - 1.0));
            }
        EXPECT_NEAR(mean, 1.0, 0.01) << name;
        EXPECT_LT(worst, 0.02) << name;
    }
}

}  // namespace
}  // namespace rcs
