#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>
#include <glm/gtc/matrix_transform.hpp>

#include "rcs/splat.h"

namespace {

using namespace rcs;

constexpr double kPi = 3.14159265358979323846;

/// A camera turned at random, as a view; points below are given in its view space.
struct Case {
    View view;
    glm::dvec3 centre_view;
    double radius;
    glm::dvec3 centre() const { return glm::dmat3(view.camera.world_from_view) * centre_view; }
    double depth() const { return -centre_view.z; }
    bool perspective() const { return view.camera.projection == Projection::perspective; }
};

class Random {
public:
    explicit Random(unsigned seed) : engine_(seed) {}
    double uniform(double low, double high) { return std::uniform_real_distribution(low, high)(engine_); }
    double log_uniform(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
    glm::dvec3 direction()
    {
        const double z = uniform(-1.0, 1.0);
        const double phi = uniform(0.0, 2.0 * kPi);
        const double s = std::sqrt(1.0 - z * z);
        return {s * std::cos(phi), s * std::sin(phi), z};
    }
    bool chance(double p) { return uniform(0.0, 1.0) < p; }

private:
    std::mt19937_64 engine_;
};

/// Fields of view from 1 to 150 degrees, aspects from 10:1 to 1:10; spheres anywhere, most of them near
/// the field of view, from much smaller than their distance to much larger (camera inside).
Case random_case(Random& random)
{
    Case c;
    const double aspect = random.log_uniform(0.1, 10.0);
    c.view.height = static_cast<int>(random.log_uniform(1.0, 2000.0));
    c.view.width = std::max(1, static_cast<int>(c.view.height * aspect));
    c.view.pixel_offset = {random.uniform(0.0, 1.0), random.uniform(0.0, 1.0)};
    Camera& camera = c.view.camera;
    camera.projection = random.chance(0.2) ? Projection::orthographic : Projection::perspective;
    camera.yfov = random.uniform(1.0, 150.0) * kPi / 180.0;
    camera.ymag = random.log_uniform(0.01, 100.0);
    camera.world_from_view = glm::rotate(glm::dmat4(1.0), random.uniform(0.0, 6.0), random.direction());
    if (random.chance(0.3)) camera.lens_shift = {random.uniform(-2.0, 2.0), random.uniform(-2.0, 2.0)};
    const double distance = random.log_uniform(1e-3, 1e3);
    if (random.chance(0.3)) {
        c.centre_view = random.direction() * distance;
    } else {
        const bool perspective = camera.projection == Projection::perspective;
        const double half = perspective ? std::tan(0.5 * camera.yfov) * distance : camera.ymag;
        c.centre_view = {random.uniform(-1.5, 1.5) * half * aspect + 2.0 * half * camera.lens_shift.x,
                         random.uniform(-1.5, 1.5) * half + 2.0 * half * camera.lens_shift.y, -distance};
    }
    c.radius = random.log_uniform(1e-3, 10.0) * distance;
    return c;
}

/// Image position [px] of a point of view space in front of the camera, from the definition of the
/// field of view: the half height of the image is tan(yfov / 2) at depth 1, or ymag; a shift moves it by whole heights.
glm::dvec2 project(const View& view, glm::dvec3 p)
{
    const bool perspective = view.camera.projection == Projection::perspective;
    const double half_height = perspective ? std::tan(view.camera.yfov / 2.0) * -p.z : view.camera.ymag;
    const double half_width = half_height * view.width / view.height;
    const glm::dvec2 shift = view.camera.lens_shift * 2.0 * half_height;
    return {((p.x - shift.x) / half_width + 1.0) / 2.0 * view.width,
            (1.0 - (p.y - shift.y) / half_height) / 2.0 * view.height};
}

/// Whether the ray of this pixel's sample meets the sphere in front of the camera, by a solved quadratic.
bool pixel_sees_sphere(const Case& c, int i, int j)
{
    const View& view = c.view;
    const double x = 2.0 * (i + view.pixel_offset.x) / view.width - 1.0;
    const double y = 1.0 - 2.0 * (j + view.pixel_offset.y) / view.height;
    const double aspect = static_cast<double>(view.width) / view.height;
    const double half_height = c.perspective() ? std::tan(view.camera.yfov / 2.0) : view.camera.ymag;
    const glm::dvec2 shift = view.camera.lens_shift * 2.0 * half_height;
    const glm::dvec3 on_plane(x * half_height * aspect + shift.x, y * half_height + shift.y, 0.0);
    const glm::dvec3 origin = c.perspective() ? glm::dvec3(0.0) : on_plane;
    const glm::dvec3 direction = c.perspective() ? on_plane - glm::dvec3(0, 0, 1) : glm::dvec3(0, 0, -1);
    const glm::dvec3 to_centre = c.centre_view - origin;
    const double a = glm::dot(direction, direction);
    const double b = glm::dot(direction, to_centre);
    const double discriminant = b * b - a * (glm::dot(to_centre, to_centre) - c.radius * c.radius);
    return discriminant >= 0.0 && b + std::sqrt(discriminant) > 0.0;
}

bool contains(const PixelBounds& bounds, int i, int j)
{
    return i >= bounds.x0 && i < bounds.x1 && j >= bounds.y0 && j < bounds.y1;
}

std::string describe(const Case& c, const PixelBounds& b)
{
    return (c.perspective() ? "perspective " : "orthographic ") + std::to_string(c.view.width) + "x" +
           std::to_string(c.view.height) + " yfov " + std::to_string(c.view.camera.yfov) + " ymag " +
           std::to_string(c.view.camera.ymag) + " centre " + std::to_string(c.centre_view.x) + " " +
           std::to_string(c.centre_view.y) + " " + std::to_string(c.centre_view.z) + " radius " +
           std::to_string(c.radius) + " bounds " + std::to_string(b.x0) + " " + std::to_string(b.y0) + " " +
           std::to_string(b.x1) + " " + std::to_string(b.y1);
}

TEST(SphereBounds, ContainEveryPixelThatSeesTheSphereForRandomSpheres)
{
    Random random(1);
    int seen = 0;
    int inside = 0;
    int crossing = 0;
    for (int n = 0; n < 100000; ++n) {
        const Case c = random_case(random);
        const PixelBounds bounds = sphere_bounds(c.view, c.centre(), c.radius);
        inside += c.perspective() && glm::length(c.centre_view) < c.radius;
        crossing += std::abs(c.depth()) < c.radius;
        for (int s = 0; s < 64; ++s) {
            const glm::dvec3 p = c.centre_view + c.radius * random.direction();
            if (p.z >= 0.0) continue;
            const glm::dvec2 at = glm::round(project(c.view, p) - c.view.pixel_offset);
            if (!(at.x >= 0.0 && at.y >= 0.0 && at.x < c.view.width && at.y < c.view.height)) continue;
            const int i = static_cast<int>(at.x);
            const int j = static_cast<int>(at.y);
            if (!pixel_sees_sphere(c, i, j)) continue;
            ++seen;
            ASSERT_TRUE(contains(bounds, i, j)) << describe(c, bounds) << " misses " << i << " " << j;
        }
    }
    EXPECT_GT(seen, 500000);  // the test means something
    EXPECT_GT(inside, 5000);
    EXPECT_GT(crossing, 5000);
}

/// The range of image positions of a sphere's outline, from points along the circle where lines of sight
/// touch it. With 4,000 of them an extreme is missed by at most (pi / 4000)^2 / 2 = 3e-7 of the size.
void outline_range(const Case& c, glm::dvec2& low, glm::dvec2& high)
{
    const glm::dvec3 to_centre = c.perspective() ? c.centre_view : glm::dvec3(0, 0, -1);
    const double distance = glm::length(to_centre);
    const glm::dvec3 axis = to_centre / distance;
    const double sine = c.perspective() ? c.radius / distance : 0.0;
    const glm::dvec3 middle = c.centre_view - axis * (c.radius * sine);
    const double circle = c.radius * std::sqrt(1.0 - sine * sine);
    const glm::dvec3 side =
        glm::normalize(glm::cross(axis, std::abs(axis.x) < 0.7 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0)));
    const glm::dvec3 up = glm::cross(axis, side);
    low = glm::dvec2(std::numeric_limits<double>::infinity());
    high = -low;
    for (int k = 0; k < 4000; ++k) {
        const double phi = 2.0 * kPi * k / 4000;
        const glm::dvec2 at = project(c.view, middle + circle * (std::cos(phi) * side + std::sin(phi) * up));
        low = glm::min(low, at);
        high = glm::max(high, at);
    }
}

TEST(SphereBounds, AreTightToAPixelForSpheresInFront)
{
    Random random(2);
    int compared = 0;
    for (int n = 0; n < 6000; ++n) {
        const Case c = random_case(random);
        if (c.depth() < 1.01 * c.radius) continue;
        const PixelBounds bounds = sphere_bounds(c.view, c.centre(), c.radius);
        if (bounds.empty()) continue;
        ++compared;
        glm::dvec2 low, high;
        outline_range(c, low, high);
        low = glm::ceil(low - c.view.pixel_offset);
        high = glm::floor(high - c.view.pixel_offset) + 1.0;
        const glm::dvec2 size(c.view.width, c.view.height);
        low = glm::clamp(low, glm::dvec2(0.0), size);
        high = glm::clamp(high, glm::dvec2(0.0), size);
        ASSERT_LE(low.x - bounds.x0, 1.0) << describe(c, bounds);
        ASSERT_LE(low.y - bounds.y0, 1.0) << describe(c, bounds);
        ASSERT_LE(bounds.x1 - high.x, 1.0) << describe(c, bounds);
        ASSERT_LE(bounds.y1 - high.y, 1.0) << describe(c, bounds);
    }
    EXPECT_GT(compared, 500);
}

View square_view(Projection projection)
{
    View view;
    view.camera.projection = projection;
    view.camera.yfov = kPi / 2.0;
    view.camera.ymag = 50.0;
    view.width = view.height = 100;
    return view;
}

TEST(SphereBounds, AreTheWholeImageAroundTheCamera)
{
    const PixelBounds bounds = sphere_bounds(square_view(Projection::perspective), {0.3, -0.2, 0.4}, 1.0);
    EXPECT_EQ(bounds.x0, 0);
    EXPECT_EQ(bounds.y0, 0);
    EXPECT_EQ(bounds.x1, 100);
    EXPECT_EQ(bounds.y1, 100);
}

TEST(SphereBounds, AreEmptyBehindTheCameraAndBesideTheImage)
{
    for (const Projection projection : {Projection::perspective, Projection::orthographic}) {
        const View view = square_view(projection);
        EXPECT_TRUE(sphere_bounds(view, {0.0, 0.0, 2.0}, 1.0).empty());
        EXPECT_TRUE(sphere_bounds(view, {-120.0, 0.0, -10.0}, 1.0).empty());
        EXPECT_TRUE(sphere_bounds(view, {0.0, 120.0, -10.0}, 1.0).empty());
    }
}

// The sphere lies to the left and reaches behind the camera: the image's left edge belongs to it, its
// right half does not. In x its tangents from the eye run along slopes -inf and tan(angle of the centre
// + angular radius); 45 degrees of half view put slope s at pixel 50 (1 + s).
TEST(SphereBounds, StayTightOnTheFarSideOfASphereThatCrossesTheEyePlane)
{
    const View view = square_view(Projection::perspective);
    const PixelBounds bounds = sphere_bounds(view, {-1.5, 0.0, -0.5}, 1.0);
    const double angle = std::atan2(-1.5, 0.5) + std::asin(1.0 / std::sqrt(2.5));
    EXPECT_EQ(bounds.x0, 0);
    EXPECT_EQ(bounds.x1, static_cast<int>(std::floor(50.0 * (1.0 + std::tan(angle)) - 0.5)) + 1);
    EXPECT_EQ(bounds.x1, 18);  // -71.6 + 39.2 degrees: pixel 18.4
}

TEST(SphereBounds, OfAParallelViewAreTheDisc)
{
    const View view = square_view(Projection::orthographic);  // one unit a pixel, centre at (50, 50)
    const PixelBounds bounds = sphere_bounds(view, {10.0, 20.0, -30.0}, 5.2);
    EXPECT_EQ(bounds.x0, 55);  // [54.8, 65.2] holds the centres 55.5 ... 64.5
    EXPECT_EQ(bounds.x1, 65);
    EXPECT_EQ(bounds.y0, 25);  // [24.8, 35.2]: y points down
    EXPECT_EQ(bounds.y1, 35);
    // 3 behind the image plane, of radius 5: what is in front is a disc of radius 4.
    const PixelBounds cut = sphere_bounds(view, {0.0, 0.0, 3.0}, 5.0);
    EXPECT_EQ(cut.x0, 46);
    EXPECT_EQ(cut.x1, 54);
}

TEST(SphereBounds, FollowTheSampleInsideThePixel)
{
    View view = square_view(Projection::orthographic);
    view.pixel_offset = {0.0, 0.9};
    const PixelBounds bounds = sphere_bounds(view, {0.2, 0.0, -1.0}, 0.3);  // x [49.9, 50.5], y [49.7, 50.3]
    EXPECT_EQ(bounds.x0, 50);
    EXPECT_EQ(bounds.x1, 51);
    EXPECT_EQ(bounds.y0, 49);
    EXPECT_EQ(bounds.y1, 50);
}

TEST(SphereBounds, OfNumbersThatAreNotFiniteAreTheWholeImage)
{
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const Projection projection : {Projection::perspective, Projection::orthographic}) {
        const View view = square_view(projection);
        for (const PixelBounds& bounds :
             {sphere_bounds(view, {nan, nan, nan}, 1.0), sphere_bounds(view, {0.0, 0.0, -1.0}, nan)}) {
            EXPECT_EQ(bounds.x1 - bounds.x0, 100);
            EXPECT_EQ(bounds.y1 - bounds.y0, 100);
        }
    }
}

}  // namespace
