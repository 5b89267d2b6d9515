#include "rcs/camera.h"

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <glm/gtc/matrix_transform.hpp>

#include "support/scenes.h"

namespace rcs {
namespace {

// Double precision throughout: a few roundings of unit-sized numbers.
constexpr double kRounding = 1e-13;

void expect_near(glm::dvec3 a, glm::dvec3 b, double tolerance, const char* what)
{
    EXPECT_LE(glm::distance(a, b), tolerance)
        << what << ": (" << a.x << ' ' << a.y << ' ' << a.z << ") and (" << b.x << ' ' << b.y << ' ' << b.z << ')';
}

Camera turned_camera(Projection projection)
{
    Camera camera = look_at_camera("turned", {3.0, -2.0, 7.0}, {-1.0, 0.5, 2.0}, 0.9, {0.2, 1.0, -0.1});
    camera.projection = projection;
    camera.ymag = 2.5;
    return camera;
}

TEST(CameraRay, OfAPlainPerspectiveGoesThroughCentreAndCorners)
{
    Camera camera;  // at the origin, looking along -z
    camera.yfov = 2.0 * std::atan(0.5);
    const View view = test::view_of(camera, 200, 100);
    const double half_width = 1.0;  // 0.5 x 200 / 100
    expect_near(camera_ray(view, 100, 50).direction, {0, 0, -1}, kRounding, "centre of the image");
    expect_near(camera_ray(view, 0, 0).direction, {-half_width, 0.5, -1}, kRounding, "top left");
    expect_near(camera_ray(view, 200, 0).direction, {half_width, 0.5, -1}, kRounding, "top right");
    expect_near(camera_ray(view, 0, 100).direction, {-half_width, -0.5, -1}, kRounding, "bottom left");
    expect_near(camera_ray(view, 0.5, 0.5).direction, {-half_width + 0.005, 0.495, -1}, kRounding,
                "first pixel's centre");
    for (const double x : {0.0, 33.0, 200.0}) expect_near(camera_ray(view, x, 7).origin, {0, 0, 0}, 0.0, "origin");
}

TEST(CameraRay, OfAPlainParallelViewStartsOnTheImagePlane)
{
    Camera camera;
    camera.projection = Projection::orthographic;
    camera.ymag = 3.0;
    const View view = test::view_of(camera, 50, 100);
    expect_near(camera_ray(view, 25, 50).origin, {0, 0, 0}, kRounding, "centre");
    expect_near(camera_ray(view, 0, 0).origin, {-1.5, 3.0, 0}, kRounding, "top left");
    expect_near(camera_ray(view, 50, 100).origin, {1.5, -3.0, 0}, kRounding, "bottom right");
    for (const double y : {0.0, 50.0, 99.5})
        expect_near(camera_ray(view, 3, y).direction, {0, 0, -1}, 0.0, "direction");
}

TEST(CameraRay, FollowsTheCamerasPose)
{
    for (const Projection projection : {Projection::perspective, Projection::orthographic}) {
        Camera plain = turned_camera(projection);
        plain.world_from_view = glm::dmat4(1.0);
        const Camera turned = turned_camera(projection);
        std::mt19937 random(1);
        std::uniform_real_distribution<double> position(-5.0, 105.0);
        for (int i = 0; i < 100; ++i) {
            const double x = position(random);
            const double y = position(random);
            const CameraRay a = camera_ray(test::view_of(plain, 100, 80), x, y);
            const CameraRay b = camera_ray(test::view_of(turned, 100, 80), x, y);
            const glm::dmat4& m = turned.world_from_view;
            expect_near(b.origin, glm::dvec3(m * glm::dvec4(a.origin, 1.0)), 10 * kRounding, "origin");
            expect_near(b.direction, glm::dvec3(m * glm::dvec4(a.direction, 0.0)), kRounding, "direction");
        }
    }
}

TEST(CameraRay, OfAShiftedLensIsThatOfAPartOfALargerPicture)
{
    // 120 x 80 pixels, two and a half heights to the right of and one below the middle of 1200 x 800.
    for (const Projection projection : {Projection::perspective, Projection::orthographic}) {
        Camera wide = turned_camera(projection);
        wide.yfov = 2.0 * std::atan(2.0);
        Camera shifted = wide;
        shifted.yfov = 2.0 * std::atan(0.2);
        shifted.ymag = wide.ymag / 10.0;
        shifted.lens_shift = {2.5, -1.0};
        const glm::dvec2 corner(600.0 + 2.5 * 80.0 - 60.0, 400.0 + 80.0 - 40.0);
        for (const glm::dvec2 at : {glm::dvec2(0.0, 0.0), {17.25, 60.5}, {120.0, 80.0}}) {
            const CameraRay part = camera_ray(test::view_of(shifted, 120, 80), at.x, at.y);
            const CameraRay whole = camera_ray(test::view_of(wide, 1200, 800), corner.x + at.x, corner.y + at.y);
            expect_near(part.origin, whole.origin, 10 * kRounding, "origin");
            expect_near(part.direction, whole.direction, 10 * kRounding, "direction");
            expect_near(part.direction_dy, whole.direction_dy, kRounding, "change by a pixel");
        }
    }
}

TEST(CameraRay, DifferentialsAreFiniteDifferences)
{
    // Rays are affine in x and y, so one whole pixel is as good as a small step.
    for (const Projection projection : {Projection::perspective, Projection::orthographic}) {
        const View view = test::view_of(turned_camera(projection), 123, 77);
        for (const double x : {0.5, 61.0, 122.5}) {
            for (const double y : {0.5, 70.25}) {
                const CameraRay here = camera_ray(view, x, y);
                const CameraRay right = camera_ray(view, x + 1.0, y);
                const CameraRay down = camera_ray(view, x, y + 1.0);
                expect_near(here.origin_dx, right.origin - here.origin, 10 * kRounding, "origin_dx");
                expect_near(here.origin_dy, down.origin - here.origin, 10 * kRounding, "origin_dy");
                expect_near(here.direction_dx, right.direction - here.direction, kRounding, "direction_dx");
                expect_near(here.direction_dy, down.direction - here.direction, kRounding, "direction_dy");
            }
        }
    }
}

TEST(CameraRay, ThroughTheProjectionOfAPointMeetsThePoint)
{
    // Projected with the usual matrices instead: clip_from_view x view_from_world, y turned downwards.
    const View view = test::view_of(turned_camera(Projection::perspective), 640, 360);
    const glm::dmat4 clip_from_world =
        glm::perspective(view.camera.yfov, 640.0 / 360.0, 0.1, 100.0) * glm::inverse(view.camera.world_from_view);
    std::mt19937 random(2);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (int i = 0; i < 200; ++i) {
        const glm::dvec3 p = glm::dvec3(-1.0, 0.5, 2.0) + glm::dvec3(unit(random), unit(random), unit(random));
        const glm::dvec4 clip = clip_from_world * glm::dvec4(p, 1.0);
        const CameraRay ray =
            camera_ray(view, (0.5 + 0.5 * clip.x / clip.w) * view.width, (0.5 - 0.5 * clip.y / clip.w) * view.height);
        // The view-space depth of a perspective ray's direction is 1, so t is the depth, and that is clip.w.
        expect_near(ray.origin + clip.w * ray.direction, p, 1e-11, "point");
    }
}

TEST(ImagePosition, IsWhereTheRayThroughAPointStarts)
{
    for (const Projection projection : {Projection::perspective, Projection::orthographic}) {
        Camera camera = turned_camera(projection);
        camera.lens_shift = {0.7, -1.3};
        const View view = test::view_of(camera, 123, 77);
        for (const glm::dvec2 at : {glm::dvec2(0.0, 0.0), {61.5, 38.5}, {120.25, -9.0}}) {
            const CameraRay ray = camera_ray(view, at.x, at.y);
            const auto found = image_position(view, ray.origin + 2.5 * ray.direction - camera_position(camera));
            ASSERT_TRUE(found);
            EXPECT_LT(glm::distance(*found, at), 1e-9);
            EXPECT_EQ(image_position(view, ray.origin - 2.5 * ray.direction - camera_position(camera)).has_value(),
                      projection == Projection::orthographic);
        }
    }
}

TEST(LookAtCamera, IsRigidAndKeepsItsTargetInTheMiddle)
{
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    for (int i = 0; i < 200; ++i) {
        const glm::dvec3 eye(normal(random), normal(random), normal(random));
        const glm::dvec3 target(normal(random), normal(random), normal(random));
        const Camera camera = look_at_camera("c", eye, target, 1.1);
        const glm::dmat3 axes(camera.world_from_view);
        const glm::dmat3 gram = glm::transpose(axes) * axes;
        for (int c = 0; c < 3; ++c) expect_near(gram[c], glm::dmat3(1.0)[c], 1e-12, "orthonormal");
        EXPECT_NEAR(glm::determinant(axes), 1.0, 1e-12);
        const CameraRay ray = camera_ray(test::view_of(camera, 40, 30), 20, 15);
        expect_near(ray.direction, glm::normalize(target - eye), 1e-12, "looks at the target");
        EXPECT_GE(axes[1].y, -1e-12) << "up is up";
        expect_near(camera_position(camera), eye, 0.0, "position");
        EXPECT_EQ(camera.yfov, 1.1);
        EXPECT_EQ(camera.name, "c");
    }
}

}  // namespace
}  // namespace rcs
