#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <glm/gtc/matrix_transform.hpp>

#include "rcs/error.h"
#include "rcs/reference.h"
#include "rcs/render.h"
#include "support/scenes.h"
#include "support/session.h"

namespace rcs {
namespace {

RenderOptions options_of(int side, int aa)
{
    RenderOptions options;
    options.width = options.height = side;
    options.aa = aa;
    return options;
}

/// The second thing in a scene, and the camera, moved sideways.
Scene moved(Scene scene, double object, double camera)
{
    scene.instances[1].world_from_object =
        glm::translate(scene.instances[1].world_from_object, glm::dvec3(object, 0.0, 0.0));
    for (Camera& c : scene.cameras)
        c.world_from_view = glm::translate(glm::dmat4(1.0), glm::dvec3(camera, 0.0, 0.0)) * c.world_from_view;
    return scene;
}

/// @param object, camera  how far they go while the shutter is open [m]
MomentFunction moving(Scene scene, double object, double camera)
{
    return [=](double part) {
        Scene now = moved(scene, object * part, camera * part);
        const Camera seen_by = now.cameras[0];
        return Moment{std::move(now), seen_by};
    };
}

RenderResult blurred(const MomentFunction& moments, const RenderOptions& options, int threads = 2)
{
    ThreadPool pool(threads);
    Session session(test::shared_gl(), pool);
    return render(session, moments, options);
}

/// A bright square of 0.25 m before the dark, 2 m of which the camera sees, from straight above.
Scene bright_square()
{
    Scene scene;
    const int black = test::add_material(scene, glm::vec3(0.0f));
    const int shining = test::add_material(scene, glm::vec3(0.0f), glm::vec3(1.0f));
    test::add_mesh(scene, test::quad({-9, -1, -9}, {0, 0, 18}, {18, 0, 0}, black));
    test::add_mesh(scene, test::quad({-0.75f, 0, -0.125f}, {0, 0, 0.25f}, {0.25f, 0, 0}, shining));
    Camera camera = look_at_camera("camera", {0.0, 1.0, 0.0}, {0.0, 0.0, 0.0}, 0.8, {0.0, 0.0, -1.0});
    camera.projection = Projection::orthographic;
    camera.ymag = 1.0;
    scene.cameras = {camera};
    return scene;
}

double luminance_at(const Image& image, int x, int y)
{
    return static_cast<double>(image.pixels[static_cast<std::size_t>((y * image.width + x) * image.channels)]);
}

TEST(MotionBlur, ASquareIsSeenWhereItIsForAsLongAsItIsThere)
{
    constexpr int kSide = 32;  // 16 px a metre
    constexpr double kWay = 0.75;
    const Image still = blurred(moving(bright_square(), 0.0, 0.0), options_of(kSide, 64)).image.layers.at("beauty");
    for (const bool camera : {false, true}) {
        const MomentFunction moments =
            camera ? moving(bright_square(), 0.0, -kWay) : moving(bright_square(), kWay, 0.0);
        const Image image = blurred(moments, options_of(kSide, 64)).image.layers.at("beauty");
        double sum = 0.0;
        for (int x = 0; x < kSide; ++x) {
            // The part of the time at which a place is within the square, in the mean over the pixel.
            constexpr int kPlaces = 64;
            double expected = 0.0;
            for (int i = 0; i < kPlaces; ++i) {
                const double at = (x - kSide / 2 + (i + 0.5) / kPlaces) / 16.0;
                const double comes = std::clamp((at + 0.5) / kWay, 0.0, 1.0);
                const double goes = std::clamp((at + 0.75) / kWay, 0.0, 1.0);
                expected += (goes - comes) / kPlaces;
            }
            const double seen = luminance_at(image, x, kSide / 2);
            EXPECT_NEAR(seen, expected, 0.06) << "pixel " << x << (camera ? ", the camera moves" : "");
            sum += seen;
        }
        EXPECT_NEAR(sum, 0.25 * 16.0, 0.05 * 0.25 * 16.0) << "as much light as of the square that stands";
    }
}

/// Mean over all pixels of |a - b| over the mean of b; `bias` becomes that of a - b.
double difference(const Image& a, const Image& b, double& bias)
{
    double absolute = 0.0, sum = 0.0;
    bias = 0.0;
    for (std::size_t i = 0; i < b.pixels.size(); ++i) {
        const double d = static_cast<double>(a.pixels[i]) - static_cast<double>(b.pixels[i]);
        absolute += std::abs(d);
        bias += d;
        sum += static_cast<double>(b.pixels[i]);
    }
    bias /= sum;
    return absolute / sum;
}

/// The mean of path traced pictures of many moments.
LayeredImage reference_of(const MomentFunction& moments, const RenderOptions& options)
{
    constexpr int kMoments = 24;
    ThreadPool pool(2);
    LayeredImage mean;
    for (int i = 0; i < kMoments; ++i) {
        const Moment moment = moments((i + 0.5) / kMoments);
        const RayScene rays = build_ray_scene(*moment.scene, pool);
        const LayeredImage at =
            render_reference(rays, test::view_of(moment.camera, options.width, options.height),
                             {.samples = 64, .aa = 16, .seed = static_cast<std::uint64_t>(i)}, pool);
        for (const char* layer : {"direct", "indirect"}) {
            Image& sum = mean.layers[layer];
            const Image& more = at.layers.at(layer);
            if (i == 0) sum = Image(more.width, more.height, more.channels);
            for (std::size_t k = 0; k < sum.pixels.size(); ++k) sum.pixels[k] += more.pixels[k] / kMoments;
        }
    }
    return mean;
}

TEST(MotionBlur, IsTheMeanOfTheMomentsInAllKindsOfLight)
{
    struct {
        double object, camera;
    } const ways[] = {{0.6, 0.0}, {0.0, 0.3}, {0.6, 0.3}};
    for (const auto [object, camera] : ways) {
        const MomentFunction moments = moving(test::furnished_room(), object, camera);
        RenderOptions options = options_of(40, 8);
        const LayeredImage truth = reference_of(moments, options);
        double biases[2] = {}, offs[2] = {};
        constexpr int kSeeds = 4;  // the records that the moments share are off together
        for (int seed = 1; seed <= kSeeds; ++seed) {
            options.seed = static_cast<std::uint64_t>(seed);
            const RenderResult result = blurred(moments, options);
            EXPECT_EQ(result.stats.unserved_pixels, 0u);
            for (int i = 0; i < 2; ++i) {
                const char* layer = i == 0 ? "direct" : "indirect";
                double bias = 0.0;
                offs[i] += difference(result.image.layers.at(layer), truth.layers.at(layer), bias) / kSeeds;
                biases[i] += bias / kSeeds;
            }
            if (object > 0.0) {
                EXPECT_GT(result.stats.records.watched, 0u);
                EXPECT_LT(result.stats.records.renewed, result.stats.records.watched / 2) << "records are shared";
            }
        }
        EXPECT_NEAR(biases[0], 0.0, 0.005) << "direct, " << object << ", " << camera;
        EXPECT_NEAR(biases[1], 0.0, 0.012) << "indirect, " << object << ", " << camera;
        EXPECT_LT(offs[0], 0.03) << object << ", " << camera;
        EXPECT_LT(offs[1], 0.05) << object << ", " << camera;
    }
}

TEST(MotionBlur, OfWhatStandsIsThePictureOfOneMoment)
{
    RenderOptions options = options_of(64, 4);
    options.effects.with.set(Effect::anti_aliasing);  // else samples of one moment are shared
    const Scene scene = test::furnished_room();
    const RenderResult still = test::render_view(scene, scene.cameras[0], options);
    const RenderResult same = blurred(moving(scene, 0.0, 0.0), options);
    const RenderResult camera_alone = blurred(
        [&](double part) {
            return part < 0.2 ? Moment{scene, scene.cameras[0]} : Moment{std::nullopt, scene.cameras[0]};
        },
        options);
    for (const auto& [name, layer] : still.image.layers) {
        EXPECT_EQ(layer.pixels, same.image.layers.at(name).pixels) << name;
        EXPECT_EQ(layer.pixels, camera_alone.image.layers.at(name).pixels) << name;
    }
}

TEST(MotionBlur, IsTheSameForAnyNumberOfThreads)
{
    const MomentFunction moments = moving(test::furnished_room(), 0.5, 0.1);
    const RenderResult one = blurred(moments, options_of(24, 4), 1), three = blurred(moments, options_of(24, 4), 3);
    for (const auto& [name, layer] : one.image.layers)
        EXPECT_EQ(layer.pixels, three.image.layers.at(name).pixels) << name;
}

TEST(MotionBlur, HoldsWhateverComesAndGoes)
{
    // Another number of things and of lamps at each moment, bounces, glossy surfaces, a target.
    const auto moments = [](double part) {
        Scene scene = moved(test::furnished_room(), 0.3 * part, 0.0);
        for (Material& m : scene.materials) m.roughness = 0.3f;
        if (part > 0.3) scene.lights.push_back(test::point_light({-1.5, 2.0, 1.0}, {3.0f, 1.0f, 0.5f}));
        if (part > 0.6) scene.instances.push_back(scene.instances[1]);
        if (part > 0.6) scene.instances.back().world_from_object[3].x += 0.5;
        const Camera camera = scene.cameras[0];
        return Moment{std::move(scene), camera};
    };
    RenderOptions options = options_of(24, 4);
    options.layers = {"beauty", "indirect", "CryptoObject"};
    for (const bool aims : {false, true}) {
        options.bounces = aims ? 1 : 3;
        if (aims) options.quality = TargetError{0.2};
        const RenderResult result = blurred(moments, options);
        for (const float value : result.image.layers.at("beauty").pixels) ASSERT_TRUE(std::isfinite(value));
        EXPECT_EQ(result.stats.unserved_pixels, 0u);
    }
}

TEST(MotionBlur, LeavesNoTraceInTheSession)
{
    const Scene scene = test::furnished_room();
    const RenderOptions options = options_of(24, 2);
    const RenderResult fresh = test::render_view(scene, scene.cameras[0], options);
    ThreadPool pool(2);
    Session session(test::shared_gl(), pool);
    render(session, moving(scene, 0.4, 0.2), options);
    session.show(scene);
    const RenderResult after = render(session, scene.cameras[0], options);
    EXPECT_EQ(after.image.layers.at("beauty").pixels, fresh.image.layers.at("beauty").pixels);

    const auto stops = [&](double part) -> Moment {
        if (part > 0.5) throw Error(ErrorCode::io, "the file has gone");
        return moving(scene, 0.4, 0.2)(part);
    };
    EXPECT_THROW(render(session, MomentFunction(stops), options), Error);
    session.show(scene);
    EXPECT_EQ(render(session, scene.cameras[0], options).image.layers.at("beauty").pixels,
              fresh.image.layers.at("beauty").pixels);
}

TEST(MotionBlur, SaysWhatCannotBe)
{
    const MomentFunction moments = moving(test::furnished_room(), 0.1, 0.0);
    const auto refused = [&](const RenderOptions& options) -> std::string {
        try {
            blurred(moments, options);
        } catch (const Error& e) {
            EXPECT_EQ(e.code(), ErrorCode::bad_argument);
            return e.what();
        }
        return "";
    };
    EXPECT_NE(refused(options_of(8, 1)).find("aa is 1, expected at least 2"), std::string::npos);
    RenderOptions options = options_of(8, 2);
    options.motion.emplace();
    EXPECT_NE(refused(options).find("motion"), std::string::npos);
}

}  // namespace
}  // namespace rcs
