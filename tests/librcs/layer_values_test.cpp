#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <glm/gtc/matrix_transform.hpp>

#include "compose/cryptomatte.h"
#include "rcs/error.h"
#include "rcs/render.h"
#include "support/effect_scenes.h"
#include "support/session.h"

// What whole renders say in the layers that are made on demand.

namespace rcs {
namespace {

constexpr int kSize = 48;

RenderOptions options_for(std::vector<std::string> layers, int aa = 4)
{
    RenderOptions options;
    options.width = options.height = kSize;
    options.aa = aa;
    settings_of(options).rays = 16;
    options.layers = std::move(layers);
    return options;
}

LayeredImage render_of(const Scene& scene, const RenderOptions& options)
{
    return test::render_first(scene, options).image;
}

/// A panel of 2 m x 1 m at z = -2 before nothing, seen squarely by a camera at zero; its left half is a mesh of its
/// own.
Scene two_panels()
{
    Scene scene;
    const int grey = test::add_material(scene, glm::vec3(0.5f));
    test::add_mesh(scene, test::quad({-1.0f, -0.5f, -2.0f}, {1, 0, 0}, {0, 1, 0}, grey));
    test::add_mesh(scene, test::quad({0.0f, -0.5f, -2.0f}, {1, 0, 0}, {0, 1, 0}, grey));
    scene.instances[0].name = "left";
    scene.instances[1].name = "right";
    scene.cameras = {look_at_camera("camera", {0, 0, 0}, {0, 0, -1}, 2.0 * std::atan(0.5))};  // 2 m x 2 m of the plane
    scene.lights = {test::point_light({0, 0, 0}, glm::vec3(1.0f))};
    return scene;
}
constexpr double kMetresPerPixel = 2.0 / kSize;

/// Where the plane of the panels lies behind a pixel's centre.
glm::dvec2 on_plane(int x, int y) { return kMetresPerPixel * glm::dvec2(x + 0.5 - 0.5 * kSize, 0.5 * kSize - y - 0.5); }

TEST(LayerValues, PositionIsThePlaceInTheFilesWorld)
{
    Scene scene = two_panels();
    scene.origin = {1000.0, -2000.0, 500.0};
    for (const int aa : {1, 4}) {
        const Image position = render_of(scene, options_for({"position"}, aa)).layers.at("position");
        ASSERT_EQ(position.channels, 3);
        for (int y = 1; y + 1 < kSize; ++y) {
            for (int x = 1; x + 1 < kSize; ++x) {
                const glm::dvec2 p = on_plane(x, y);
                const float* const value = position.at(x, y);
                if (std::abs(p.y) > 0.5 + kMetresPerPixel) {
                    EXPECT_EQ(glm::vec3(value[0], value[1], value[2]), glm::vec3(0.0f)) << "nothing is seen";
                } else if (std::abs(p.y) < 0.5 - kMetresPerPixel) {
                    const double off = aa == 1 ? 1e-3 : 0.3 * kMetresPerPixel;  // samples are spread over the pixel
                    EXPECT_NEAR(value[0], 1000.0 + p.x, off);
                    EXPECT_NEAR(value[1], -2000.0 + p.y, off);
                    EXPECT_NEAR(value[2], 498.0, 1e-3);
                }
            }
        }
    }
}

TEST(LayerValues, MotionIsOfSurfacesWhereASampleSeesOneElseOfTheSky)
{
    Scene scene = two_panels();
    auto before = std::make_shared<Scene>(scene);
    before->instances[1].world_from_object = glm::translate(glm::dmat4(1.0), glm::dvec3(0.25, 0.125, 0.0));
    RenderOptions options = options_for({"motion"});
    EXPECT_THROW(render_of(scene, options), Error) << "from what?";
    options.motion = MotionFrom{before, scene.cameras[0]};
    const Image motion = render_of(scene, options).layers.at("motion");
    ASSERT_EQ(motion.channels, 2);
    const auto at = [&](const Image& image, int x, int y) { return glm::vec2(image.at(x, y)[0], image.at(x, y)[1]); };
    EXPECT_EQ(at(motion, 10, 24), glm::vec2(0.0f)) << "stands still";
    const glm::vec2 moved = at(motion, 40, 24);
    EXPECT_NEAR(moved.x, -0.25 / kMetresPerPixel, 1e-3) << "to the left";
    EXPECT_NEAR(moved.y, -0.125 / kMetresPerPixel, 1e-3) << "down";
    EXPECT_EQ(at(motion, 40, 2), glm::vec2(0.0f)) << "the sky stands still";
    // At an edge before the sky samples of the sky do not count; between both panels there is a mean of both.
    const int edge = kSize / 4;  // the panels reach from row 12 to 35
    EXPECT_NEAR(at(motion, 40, edge).x, moved.x, 1e-3);

    Camera turned = look_at_camera("camera", {0, 0, 0}, {0.1, 0, -1}, 2.0 * std::atan(0.5));
    options.motion = MotionFrom{nullptr, turned};
    const Image panned = render_of(scene, options).layers.at("motion");
    EXPECT_NEAR(at(panned, 24, 24).x, std::tan(std::atan(0.1)) * kSize, 0.5) << "it looked to the right before";
    EXPECT_NEAR(at(panned, 24, 2).x, at(panned, 24, 24).x, 0.1) << "the sky as what is still";
}

/// Parts of a pixel by Cryptomatte's ids.
std::map<std::uint32_t, float> parts_of(const Image& image, int x, int y)
{
    std::map<std::uint32_t, float> parts;
    const float* const pairs = image.at(x, y);
    for (int rank = 0; rank < kCryptomatteRanks; ++rank)
        if (pairs[2 * rank + 1] > 0.0f) parts[std::bit_cast<std::uint32_t>(pairs[2 * rank])] = pairs[2 * rank + 1];
    return parts;
}

TEST(LayerValues, CryptomatteCoversWhatAlphaDoes)
{
    Scene scene = two_panels();
    scene.materials[0].name = "grey";
    Material veil;
    veil.name = "veil";
    veil.alpha_mode = AlphaMode::blend;
    veil.alpha = 0.25f;
    veil.double_sided = true;
    const int veiled = test::add_surface(scene, veil);
    scene.materials[static_cast<std::size_t>(veiled)].name = "veil";
    test::add_mesh(scene, test::quad({-0.6f, -0.6f, -1.5f}, {1.2f, 0, 0}, {0, 1.2f, 0}, veiled));
    scene.instances[2].name = "veil";
    for (const SplatMethod method : {SplatMethod::tiles, SplatMethod::quads}) {
        for (const int aa : {1, 4}) {
            RenderOptions options = options_for({kObjectLayer, kMaterialLayer}, aa);
            options.splat = method;
            const LayeredImage image = render_of(scene, options);
            const LayeredImage by_three = test::render_first(scene, options, 3).image;
            for (const char* name : {kObjectLayer, kMaterialLayer}) {
                const Image& layer = image.layers.at(name);
                EXPECT_EQ(std::memcmp(layer.pixels.data(), by_three.layers.at(name).pixels.data(),
                                      layer.pixels.size() * sizeof(float)),
                          0);
                ASSERT_EQ(layer.channels, 2 * kCryptomatteRanks);
                for (int y = 0; y < kSize; ++y) {
                    for (int x = 0; x < kSize; ++x) {
                        float sum = 0.0f;
                        for (const auto& [id, part] : parts_of(layer, x, y)) sum += part;
                        ASSERT_NEAR(sum, image.layers.at("beauty").at(x, y)[3], 1e-5f);
                    }
                }
            }
            const auto inside = parts_of(image.layers.at(kObjectLayer), 40, 24);
            ASSERT_EQ(inside.size(), 2u);
            EXPECT_NEAR(inside.at(cryptomatte_id("veil")), 0.25f, 1e-6f);
            EXPECT_NEAR(inside.at(cryptomatte_id("right")), 0.75f, 1e-6f);
            EXPECT_EQ(parts_of(image.layers.at(kMaterialLayer), 40, 24).at(cryptomatte_id("grey")),
                      inside.at(cryptomatte_id("right")));
            EXPECT_TRUE(parts_of(image.layers.at(kObjectLayer), 40, 5).contains(cryptomatte_id("veil")));
            EXPECT_TRUE(parts_of(image.layers.at(kObjectLayer), 0, 0).empty());
        }
    }
}

TEST(LayerValues, OnDemandChangeNoOtherLayer)
{
    const Scene scene = test::panel_room(test::metal(0.3f));
    RenderOptions options = options_for({});
    options.layers.reset();
    const LayeredImage plain = render_of(scene, options);
    options.layers = {"emission", "direct", "direct_error", "indirect", "indirect_error", "irradiance", "albedo",
                      "normal",   "depth",  "records",      "position", "motion",         kObjectLayer};
    options.motion = MotionFrom{nullptr, scene.cameras[0]};
    const LayeredImage more = render_of(scene, options);
    EXPECT_EQ(more.layers.size(), plain.layers.size() + 3);
    for (const auto& [name, layer] : plain.layers) EXPECT_EQ(layer.pixels, more.layers.at(name).pixels) << name;
}

}  // namespace
}  // namespace rcs
