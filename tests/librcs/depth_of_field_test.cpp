#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "rcs/error.h"
#include "rcs/metrics.h"
#include "rcs/reference.h"
#include "scene/lens.h"
#include "support/scenes.h"
#include "support/session.h"

// Passes through points of a lens, against the thin lens's formulas and paths through the same lens.

namespace rcs {
namespace {

constexpr double kFocal = 0.05;  ///< [m]

/// At the origin, along -z, with the field of view of a 50 mm lens.
Camera normal_lens()
{
    Camera camera = look_at_camera("normal", {0.0, 0.0, 0.0}, {0.0, 0.0, -1.0}, 2.0 * std::atan(0.012 / kFocal));
    return camera;
}

TEST(Lens, HasTheFocalLengthOfFilm24MillimetresHigh)
{
    const Lens lens = lens_of(normal_lens(), 2.0, 3.0);
    EXPECT_NEAR(lens.diameter, kFocal / 2.0, 1e-12);
    EXPECT_EQ(lens.focus, 3.0);
}

TEST(Lens, CircleOfConfusionIsThatOfAThinLensAsFarAsTheFilmFollowsTheFocus)
{
    // c = A |z - d| / z * v / d, with the film where the focal length says, so v = f.
    const Lens lens{0.025, 3.0};
    for (const double z : {0.5, 1.0, 3.0, 10.0, 1e6})
        EXPECT_NEAR(circle_of_confusion(lens, z), 0.025 * std::abs(z - 3.0) / (z * 3.0), 1e-12);
    EXPECT_NEAR(circle_of_confusion(lens, std::numeric_limits<double>::infinity()), 0.025 / 3.0, 1e-12);
    // Where the lens moves out to focus, c = A |z - d| / z * f / (d - f): more by d / (d - f).
    const double on_film = kFocal * circle_of_confusion(lens, 10.0);
    const double thin = 0.025 * 7.0 / 10.0 * kFocal / (3.0 - kFocal);
    EXPECT_NEAR(thin / on_film, 3.0 / (3.0 - kFocal), 1e-12);
}

TEST(Lens, RaysOfAPixelMeetInThePlaneInFocus)
{
    Camera camera = look_at_camera("turned", {3.0, -2.0, 7.0}, {-1.0, 0.5, 2.0}, 0.9, {0.2, 1.0, -0.1});
    camera.lens_shift = {0.2, -0.3};
    const Lens lens{0.3, 4.0};
    for (const glm::dvec2 at : {glm::dvec2(0.0, 0.0), {33.3, 7.5}, {120.0, 80.0}}) {
        const CameraRay middle = camera_ray(test::view_of(camera, 120, 80), at.x, at.y);
        for (const glm::dvec2 point : {glm::dvec2(1.0, 0.0), {-0.3, 0.8}}) {
            const CameraRay ray = camera_ray(test::view_of(through_lens(camera, lens, point), 120, 80), at.x, at.y);
            EXPECT_NEAR(glm::distance(ray.origin, middle.origin), 0.15 * glm::length(point), 1e-12);
            EXPECT_LT(glm::distance(ray.origin + 4.0 * ray.direction, middle.origin + 4.0 * middle.direction), 1e-12);
        }
    }
}

TEST(Lens, PointsFillTheDiscEvenlyForEveryNumberOfThem)
{
    EXPECT_EQ(lens_point(0), glm::dvec2(0.0));
    for (const int n : {8, 16, 64, 256}) {
        glm::dvec2 mean(0.0);
        double square = 0.0;
        for (int i = 0; i < n; ++i) {
            const glm::dvec2 p = lens_point(i);
            EXPECT_LE(glm::length(p), 1.0 + 1e-12);
            mean += p / static_cast<double>(n);
            square += glm::dot(p, p) / n;
        }
        EXPECT_LT(glm::length(mean), 0.8 / std::sqrt(static_cast<double>(n))) << n;
        EXPECT_NEAR(square, 0.5, 1.0 / std::sqrt(static_cast<double>(n)) * 0.5) << n;
    }
}

/// A small square that shines, across the axis of normal_lens().
Scene small_lamp(double z, float half)
{
    Scene scene;
    scene.name = "lamp";
    Material lamp;
    lamp.base_color = glm::vec3(0.0f);
    lamp.emission = glm::vec3(10.0f);
    scene.materials.push_back(lamp);
    Mesh mesh;
    mesh.positions = {{-half, -half, 0.0f}, {half, -half, 0.0f}, {half, half, 0.0f}, {-half, half, 0.0f}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    scene.meshes.push_back(mesh);
    Instance instance;
    instance.world_from_object[3] = glm::dvec4(0.0, 0.0, z, 1.0);
    scene.instances.push_back(instance);
    scene.cameras.push_back(normal_lens());
    return scene;
}

/// Diameter of an even disc that would be as wide as the picture's light [px]: four standard deviations along an axis.
double width_of(const Image& image)
{
    double sum = 0.0, x1 = 0.0, x2 = 0.0;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            const double v = static_cast<double>(image.at(x, y)[0]);
            sum += v;
            x1 += v * x;
            x2 += v * x * x;
        }
    return 4.0 * std::sqrt(x2 / sum - x1 / sum * x1 / sum);
}

TEST(DepthOfField, APointIsAsWideAsTheThinLensSays)
{
    RenderOptions options;
    options.width = options.height = 80;
    options.aa = 64;
    options.f_stop = 0.2;  // discs of 10 to 20 px
    options.focus = 2.0;
    for (const double z : {-1.0, -4.0, -20.0}) {
        const float half = static_cast<float>(-z) * 0.01f;
        const Scene scene = small_lamp(z, half);
        const View view{scene.cameras[0], options.width, options.height};
        const double pixel = image_plane(view).pixel;
        const Lens lens = lens_of(view.camera, *options.f_stop, *options.focus);
        const double expected = circle_of_confusion(lens, -z) / pixel;
        // The square has a width of its own, and so have samples of a pixel: variances add.
        const double own = (2.0 * 0.01 / pixel) * (2.0 * 0.01 / pixel) / 12.0;
        const auto disc = [&](const Image& image) {
            return std::sqrt(width_of(image) * width_of(image) - 16.0 * (own + 1.0 / 12.0));
        };
        const RenderResult result = test::render_first(scene, options);
        EXPECT_NEAR(disc(result.image.layers.at("emission")) / expected, 1.0, 0.05) << z << ' ' << expected;
        ThreadPool pool(2);
        const RayScene rays = build_ray_scene(scene, pool);
        const LayeredImage reference =
            render_reference(rays, view, {.samples = 256, .bounces = 0, .aa = 64, .lens = lens}, pool);
        EXPECT_NEAR(disc(reference.layers.at("emission")) / expected, 1.0, 0.02) << z << ' ' << expected;
    }
}

TEST(DepthOfField, IsThatOfPathsThroughTheSameLens)
{
    const Scene scene = load_scene("demo:cornell");
    RenderOptions options;
    options.width = options.height = 48;
    options.aa = 64;
    ThreadPool pool(2);
    const RayScene rays = build_ray_scene(scene, pool);
    const View view{scene.cameras[0], 48, 48};
    ReferenceOptions paths{.samples = 512, .aa = 64};
    const LayeredImage sharp = test::render_first(scene, options).image;
    const LayeredImage sharp_truth = render_reference(rays, view, paths, pool);
    options.f_stop = 0.2;
    options.focus = 3.0;
    paths.lens = lens_of(view.camera, *options.f_stop, *options.focus);
    const LayeredImage blurred = test::render_first(scene, options).image;
    const LayeredImage truth = render_reference(rays, view, paths, pool);
    const auto error = [](const LayeredImage& a, const LayeredImage& b) {
        return compare_images(a, b, "beauty").mean_relative_error;
    };
    EXPECT_LT(error(blurred, truth), 1.3 * error(sharp, sharp_truth) + 0.005);
    EXPECT_GT(error(sharp, truth), 2.0 * error(blurred, truth)) << "the lens does show";
    // Of the lamp, 64 points of the lens see 3 % too much, 256 of them 0.1 %. Records of so small a picture have a bias
    // of their own.
    const auto ratio = [](const LayeredImage& a, const LayeredImage& b, const char* layer) {
        return compare_images(a, b, layer).ratio_of_means;
    };
    EXPECT_NEAR(ratio(blurred, truth, "direct"), 1.0, 0.01);
    EXPECT_NEAR(ratio(blurred, truth, "indirect"), ratio(sharp, sharp_truth, "indirect"), 0.01);
}

TEST(DepthOfField, PassesThatAreTooFewAreSaid)
{
    const Scene scene = small_lamp(-20.0, 0.05f);
    RenderOptions options;
    options.width = options.height = 150;
    options.aa = 4;
    options.f_stop = 0.2;
    options.focus = 2.0;
    std::string said;
    const RenderHooks hooks{.log = [&](LogLevel level, std::string_view line) {
        if (level == LogLevel::warning) said += line;
    }};
    test::render_first(scene, options, 2, {}, hooks);
    EXPECT_NE(said.find("px wide, of which --aa 4 shows single images: --aa 1"), std::string::npos) << said;
    said.clear();
    options.aa = 256;
    test::render_first(scene, options, 2, {}, hooks);
    EXPECT_EQ(said, "");
}

TEST(DepthOfField, HalfALensIsRefused)
{
    const auto refusal = [](auto change) {
        RenderOptions options;
        options.f_stop = 2.0;
        options.focus = 3.0;
        change(options);
        try {
            validate(options);
        } catch (const Error& e) {
            return std::string(e.what());
        }
        return std::string();
    };
    EXPECT_EQ(refusal([](RenderOptions&) {}), "");
    EXPECT_EQ(refusal([](RenderOptions& o) { o.focus.reset(); }),
              "focus is not given, expected a distance, as f_stop is given");
    EXPECT_EQ(refusal([](RenderOptions& o) { o.f_stop.reset(); }),
              "f_stop is not given, expected an f-number, as focus is given");
    EXPECT_NE(refusal([](RenderOptions& o) { o.aa = 1; }).find("aa is 1, expected at least 2 with f_stop"),
              std::string::npos);
    EXPECT_NE(refusal([](RenderOptions& o) { o.f_stop = 0.0; }), "");
    Scene scene = small_lamp(-2.0, 0.1f);
    scene.cameras[0].projection = Projection::orthographic;
    RenderOptions options;
    options.width = options.height = 8;
    options.f_stop = options.focus = 2.0;
    EXPECT_THROW(test::render_first(scene, options), Error);
}

}  // namespace
}  // namespace rcs
