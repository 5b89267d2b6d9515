#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "rcs/error.h"
#include "rcs/image_io.h"
#include "rcs/metrics.h"
#include "rcs/reference.h"
#include "support/scenes.h"
#include "support/session.h"
#include "support/temporary_folder.h"

// A window of a picture is what it is in the whole.

namespace rcs {
namespace {

constexpr Crop kWindow{37, 50, 61, 45};

RenderOptions options_of(int aa)
{
    RenderOptions options;
    options.width = 160;
    options.height = 120;
    options.aa = aa;
    return options;
}

/// Pixels of the window that differ from those of the whole picture in any bit.
int differing(const LayeredImage& whole, const LayeredImage& part, const std::string& layer)
{
    const Image& a = whole.layers.at(layer);
    const Image& b = part.layers.at(layer);
    int count = 0;
    for (int y = 0; y < kWindow.height; ++y)
        for (int x = 0; x < kWindow.width; ++x) {
            const float* const p = a.at(kWindow.x + x, kWindow.y + y);
            count += std::equal(p, p + a.channels, b.at(x, y)) ? 0 : 1;
        }
    return count;
}

/// Mean difference of luminance relative to the window's mean, of pixels so far from its edge.
double difference(const LayeredImage& whole, const LayeredImage& part, int from, int to)
{
    const Image& a = whole.layers.at("indirect");
    const Image& b = part.layers.at("indirect");
    double sum = 0.0, mean = 0.0;
    int count = 0;
    for (int y = 0; y < kWindow.height; ++y)
        for (int x = 0; x < kWindow.width; ++x) {
            mean += static_cast<double>(b.at(x, y)[1]);
            const int inside = std::min({x, y, kWindow.width - 1 - x, kWindow.height - 1 - y});
            if (inside < from || inside >= to) continue;
            sum += std::abs(static_cast<double>(a.at(kWindow.x + x, kWindow.y + y)[1] - b.at(x, y)[1]));
            ++count;
        }
    return sum / count / (mean / (kWindow.width * kWindow.height));
}

class CropOfDemo : public testing::TestWithParam<const char*> {};

TEST_P(CropOfDemo, HasTheSameSamplesAndLightOfLamps)
{
    const Scene scene = load_scene(GetParam());
    RenderOptions options = options_of(1);
    options.effects.without.set(Effect::traced_lobes);
    const RenderResult whole = test::render_first(scene, options);
    options.seed = 2;
    const RenderResult other = test::render_first(scene, options);
    options.seed = 1;
    options.crop = kWindow;
    const RenderResult part = test::render_first(scene, options);
    const Image& beauty = part.image.layers.at("beauty");
    EXPECT_EQ(beauty.width, kWindow.width);
    EXPECT_EQ(beauty.height, kWindow.height);
    EXPECT_EQ(part.image.window, (ImageWindow{kWindow.x, kWindow.y, 160, 120}));
    EXPECT_FALSE(whole.image.window.has_value());
    for (const char* layer : {"albedo", "normal", "depth", "emission", "direct"})
        EXPECT_EQ(differing(whole.image, part.image, layer), 0) << layer;
    EXPECT_GT(differing(whole.image, part.image, "indirect"), 0) << "records are not the same; the test sees them";
    LayeredImage cut_of_other;
    Image& there = cut_of_other.layers["indirect"] = Image(kWindow.width, kWindow.height, 3);
    for (int y = 0; y < kWindow.height; ++y)
        for (int x = 0; x < kWindow.width; ++x)
            std::copy_n(other.image.layers.at("indirect").at(kWindow.x + x, kWindow.y + y), 3, there.at(x, y));
    for (const auto& [from, to] : {std::pair{0, 4}, {4, 99}})
        EXPECT_LT(difference(whole.image, part.image, from, to), 1.3 * difference(whole.image, cut_of_other, from, to))
            << "about as near to the whole picture as that is to one with another seed, also at the edge: " << from;
}
INSTANTIATE_TEST_SUITE_P(Crop, CropOfDemo, testing::Values("demo:cornell", "demo:spheres", "demo:atrium"));

TEST(Crop, HasTheSamplesOfAllPasses)
{
    const Scene scene = load_scene("demo:cornell");
    RenderOptions options = options_of(5);
    options.effects.with.set(Effect::anti_aliasing);  // shares no samples
    const RenderResult whole = test::render_first(scene, options);
    options.crop = kWindow;
    const RenderResult part = test::render_first(scene, options);
    for (const char* layer : {"albedo", "normal", "depth", "emission", "direct"})
        EXPECT_EQ(differing(whole.image, part.image, layer), 0) << layer;
}

TEST(Crop, TracedLobesAreTheSameButForLightThatRecordsFind)
{
    const Scene scene = load_scene("demo:spheres");
    RenderOptions options = options_of(1);
    options.effects.without.set(Effect::indirect_diffuse);
    options.effects.without.set(Effect::glossy_records);
    options.overlap = 3.0f;  // a margin of 45 px: what else is seen decides whether lobes look at lit points
    const RenderResult whole = test::render_first(scene, options);
    options.crop = kWindow;
    const RenderResult part = test::render_first(scene, options);
    ASSERT_EQ(whole.stats.traced.looks + part.stats.traced.looks, 0u);
    EXPECT_EQ(differing(whole.image, part.image, "indirect"), 0);
}

TEST(Crop, OfAllIsTheWholePicture)
{
    const Scene scene = load_scene("demo:cornell");
    RenderOptions options = options_of(2);
    const RenderResult whole = test::render_first(scene, options);
    options.crop = Crop{0, 0, 160, 120};
    const RenderResult part = test::render_first(scene, options);
    for (const auto& [name, layer] : whole.image.layers)
        EXPECT_TRUE(layer.pixels == part.image.layers.at(name).pixels) << name;
}

TEST(Crop, OfAReferenceHasItsBits)
{
    const Scene scene = load_scene("demo:cornell");
    ThreadPool pool(2);
    const RayScene rays = build_ray_scene(scene, pool);
    View view{scene.cameras[0], 40, 30};
    const ReferenceOptions options{.samples = 16, .aa = 4};
    const LayeredImage whole = render_reference(rays, view, options, pool);
    view.width = 11, view.height = 9;
    view.corner = {17, 12}, view.whole = {40, 30};
    const LayeredImage part = render_reference(rays, view, options, pool);
    EXPECT_EQ(compare_images(part, whole, "beauty").rmse, 0.0);
    EXPECT_EQ(compare_images(whole, part, "indirect").pixels, 99u);
    EXPECT_THROW(compare_images(render_reference(rays, {scene.cameras[0], 41, 30}, options, pool), part, "beauty"),
                 Error);
}

TEST(Crop, IsTheDataWindowOfAnExr)
{
    const test::TemporaryFolder folder;
    LayeredImage image;
    Image& beauty = image.layers["beauty"] = Image(7, 5, 4);
    for (std::size_t i = 0; i < beauty.pixels.size(); ++i) beauty.pixels[i] = static_cast<float>(i);
    image.layers["depth"] = Image(7, 5, 1);
    *image.layers["depth"].at(6, 4) = 3.5f;
    image.window = ImageWindow{11, 3, 40, 20};
    write_exr(folder / "part.exr", image);
    const LayeredImage back = read_image(folder / "part.exr");
    EXPECT_EQ(back.window, image.window);
    EXPECT_TRUE(back.layers.at("beauty").pixels == beauty.pixels);
    EXPECT_TRUE(back.layers.at("depth").pixels == image.layers["depth"].pixels);
    image.window.reset();
    write_exr(folder / "all.exr", image);
    EXPECT_FALSE(read_image(folder / "all.exr").window.has_value());
}

TEST(Crop, BesideThePictureIsRefusedWithItsRange)
{
    for (const Crop crop : {Crop{0, 0, 0, 5}, Crop{-1, 0, 5, 5}, Crop{156, 0, 5, 5}, Crop{0, 119, 5, 2},
                            Crop{2000000000, 0, 2000000000, 1}}) {
        RenderOptions options = options_of(1);
        options.crop = crop;
        try {
            validate(options);
            ADD_FAILURE() << crop.x << ',' << crop.y;
        } catch (const Error& e) {
            EXPECT_EQ(e.code(), ErrorCode::bad_argument);
            EXPECT_NE(std::string(e.what()).find("within the picture of 160x120"), std::string::npos) << e.what();
        }
    }
}

}  // namespace
}  // namespace rcs
