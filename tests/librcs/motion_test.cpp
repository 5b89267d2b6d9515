#include "compose/motion.h"

#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <glm/gtc/matrix_transform.hpp>

#include "support/gltf_builder.h"
#include "support/scenes.h"

// The layer `motion`, against movements worked out by hand.

namespace rcs::test {
namespace {

constexpr int kSize = 64;
constexpr double kYfov = 0.9;

/// A camera at `eye`, level, turned to the left by `yaw` [rad] from looking along -z.
Camera level_camera(glm::dvec3 eye, double yaw)
{
    return look_at_camera("camera", eye, eye + glm::dvec3(-std::sin(yaw), 0.0, -std::cos(yaw)), kYfov);
}

/// Where that camera shows a point, from the picture's middle, x to the right and y up [px].
glm::dvec2 shown(glm::dvec3 eye, double yaw, glm::dvec3 point)
{
    const glm::dvec3 d = point - eye;
    const double right = d.x * std::cos(yaw) - d.z * std::sin(yaw), ahead = -d.x * std::sin(yaw) - d.z * std::cos(yaw);
    const double focal = 0.5 * kSize / std::tan(0.5 * kYfov);
    return glm::dvec2(right, d.y) * (focal / ahead);
}

Camera flat_camera()
{
    Camera camera = level_camera({0, 0, 10}, 0.0);
    camera.projection = Projection::orthographic;
    camera.ymag = 2.0;  // 16 pixels a metre
    return camera;
}
constexpr double kPixelsPerMetre = kSize / 4.0;

/// What a camera sees of one triangle at one point of scene space.
GBuffer seen(const Camera& camera, glm::dvec3 point, std::uint32_t instance = 0, std::uint32_t primitive = 0)
{
    GBuffer g;
    g.width = g.height = 1;
    g.camera_position = camera_position(camera);
    const glm::vec3 relative(point - g.camera_position);
    g.position_x = {relative.x};
    g.position_y = {relative.y};
    g.position_z = {relative.z};
    g.instance = {instance};
    g.primitive = {primitive};
    return g;
}

/// How the point of a triangle moves on the image. @param point  where it is now, scene space
std::optional<glm::dvec2> moved(const Scene& scene, const Camera& camera, const MotionFrom& from, glm::dvec3 point,
                                std::uint32_t instance = 0)
{
    const Motion motion(scene, from);
    return motion.of_surface(seen(camera, point, instance), motion.images_of(view_of(camera, kSize, kSize)), 0);
}

void expect_near(const std::optional<glm::dvec2>& value, glm::dvec2 expected, double tolerance = 1e-4)
{
    ASSERT_TRUE(value);
    EXPECT_NEAR(value->x, expected.x, tolerance);
    EXPECT_NEAR(value->y, expected.y, tolerance);
}

/// A wall of 8 m at z = -4, in two triangles: the first is the lower right one.
Scene wall()
{
    Scene scene;
    add_mesh(scene, quad({-4, -4, -4}, {8, 0, 0}, {0, 8, 0}, add_material(scene, glm::vec3(0.5f))));
    return scene;
}

TEST(Motion, OfAStillSceneIsThatOfTheCamera)
{
    const Scene scene = wall();
    const glm::dvec3 point(1.0, -0.5, -4.0), eye(0.3, 0.2, 0.5);
    const Camera here = level_camera(eye, 0.1);
    for (const double yaw : {0.1, 0.0, -0.2}) {
        for (const glm::dvec3 other : {eye, glm::dvec3(0.0), glm::dvec3(0.0, 1.0, 2.0)}) {
            const auto motion = moved(scene, here, {nullptr, level_camera(other, yaw)}, point);
            expect_near(motion, shown(eye, 0.1, point) - shown(other, yaw, point));
        }
    }
    EXPECT_EQ(moved(scene, here, {nullptr, here}, point), glm::dvec2(0.0)) << "exactly";
}

TEST(Motion, OfTheSkyIsThatOfTurningTheCamera)
{
    const Scene scene = wall();
    const Camera here = level_camera({5, 6, 7}, 0.1);
    const View view = view_of(here, kSize, kSize);
    const glm::dvec2 from_middle(7.0, 4.0);  // to the right and up
    const glm::dvec2 point(0.5 * kSize + from_middle.x, 0.5 * kSize - from_middle.y);
    const auto of_sky = [&](const Motion& motion) { return Motion::of_sky(motion.images_of(view), point); };
    const Motion motion(scene, {nullptr, level_camera({-1, 0, 3}, 0.0)});
    const double focal = 0.5 * kSize / std::tan(0.5 * kYfov);
    const double angle = std::atan(from_middle.x / focal) - 0.1;  // to the right of the other's axis
    const double stretch = std::cos(std::atan(from_middle.x / focal)) / std::cos(angle);
    expect_near(of_sky(motion), {from_middle.x - focal * std::tan(angle), from_middle.y * (1.0 - stretch)});
    expect_near(of_sky(Motion(scene, {nullptr, level_camera({9, 9, 9}, 0.1)})), {0.0, 0.0}, 1e-12);
    EXPECT_FALSE(of_sky(Motion(scene, {nullptr, level_camera({0, 0, 0}, 2.5)}))) << "behind it";
    EXPECT_FALSE(of_sky(Motion(scene, {nullptr, flat_camera()})));
}

TEST(Motion, OfWhatWasBehindTheCameraIsNone)
{
    const Scene scene = wall();
    const Camera here = level_camera({0, 0, 0}, 0.0);
    EXPECT_FALSE(moved(scene, here, {nullptr, level_camera({0, 0, -5}, 0.0)}, {0.5, -0.5, -4}));
    EXPECT_FALSE(moved(scene, here, {nullptr, level_camera({0, 0, 0}, 3.0)}, {0.5, -0.5, -4}));
    EXPECT_FALSE(moved(scene, here, {nullptr, level_camera({0, 0, -4.0 + 1e-9}, 0.0)}, {0.5, -0.5, -4}))
        << "in its plane";
}

TEST(Motion, OfAnInstanceFollowsItsMatrix)
{
    auto before = std::make_shared<Scene>(wall());
    Scene scene = wall();
    // A quarter turn about the viewing axis, and a metre to the right.
    scene.instances[0].world_from_object =
        glm::rotate(glm::translate(glm::dmat4(1.0), glm::dvec3(1, 0, 0)), 0.5 * std::acos(-1.0), glm::dvec3(0, 0, 1));
    const Camera camera = flat_camera();
    expect_near(moved(scene, camera, {before, camera}, {1.5, 0.5, -4}),
                kPixelsPerMetre * (glm::dvec2(1.5, 0.5) - glm::dvec2(0.5, -0.5)));
    // Scene space may begin elsewhere in the other pose.
    move_origin(scene);
    before->origin = {100, 200, 300};
    for (Instance& instance : before->instances) instance.world_from_object[3] -= glm::dvec4(before->origin, 0.0);
    Camera other = camera;
    other.world_from_view[3] -= glm::dvec4(before->origin, 0.0);
    expect_near(moved(scene, camera, {before, other}, {1.5, 0.5, -4}),
                kPixelsPerMetre * (glm::dvec2(1.5, 0.5) - glm::dvec2(0.5, -0.5)));
}

/// The same file at two times, t = 0 and t = 1.
struct TwoTimes {
    Scene now;
    std::shared_ptr<const Scene> before;
};
TwoTimes load_both(const GltfBuilder& builder)
{
    const TemporaryFolder folder;
    write_bytes(folder / "test.glb", builder.glb());
    return {load_scene(folder / "test.glb", {}, {1.0}),
            std::make_shared<Scene>(load_scene(folder / "test.glb", {}, {0.0}))};
}

void animate(GltfBuilder& b, int node, const char* path, int output)
{
    const int input = b.add_accessor(b.add_view(raw<float>({0, 1})), kFloat, "SCALAR", 2);
    b.add("animations",
          {{"name", "move"},
           {"channels", Json::array({{{"sampler", 0}, {"target", {{"node", node}, {"path", path}}}}})},
           {"samplers", Json::array({{{"input", input}, {"output", output}, {"interpolation", "LINEAR"}}})}});
}

int add_scalars(GltfBuilder& b, const std::vector<float>& values)
{
    return b.add_accessor(b.add_view(raw(values)), kFloat, "SCALAR", values.size());
}

TEST(Motion, OfAMorphFollowsThePointOnItsTriangle)
{
    GltfBuilder b;
    const int positions = b.add_vec3({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
    const int lift = b.add_vec3({{0, 0, 0}, {0, 0, 0}, {0, 1, 0}});  // its third corner goes to (0,2,0)
    const int mesh =
        b.add_mesh("m", {{"attributes", {{"POSITION", positions}}}, {"targets", Json::array({{{"POSITION", lift}}})}});
    b.add_node({{"mesh", mesh}});
    animate(b, 0, "weights", add_scalars(b, {0, 1}));
    const TwoTimes scene = load_both(b);
    const Camera camera = flat_camera();
    // Weights 0.25 and 0.5 of the second and third corner: at (0.25, 1) now, half the third corner's way.
    expect_near(moved(scene.now, camera, {scene.before, camera}, {0.25, 1.0, 0.0}), {0.0, 0.5 * kPixelsPerMetre});
}

TEST(Motion, OfASkinFollowsItsJoints)
{
    GltfBuilder b;
    const int positions = b.add_vec3({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
    const int joints = b.add_accessor(
        b.add_view(raw(std::vector<glm::u8vec4>{{0, 0, 0, 0}, {1, 0, 0, 0}, {0, 0, 0, 0}})), kUnsignedByte, "VEC4", 3);
    const int weights = b.add_accessor(b.add_view(raw(std::vector<glm::vec4>(3, {1, 0, 0, 0}))), kFloat, "VEC4", 3);
    const int mesh =
        b.add_mesh("m", {{"attributes", {{"POSITION", positions}, {"JOINTS_0", joints}, {"WEIGHTS_0", weights}}}});
    b.add_node({{"mesh", mesh}, {"skin", 0}});
    b.add_node({{"name", "still"}});
    b.add_node({{"name", "moving"}});
    b.add("skins", {{"joints", {1, 2}}});
    animate(b, 2, "translation", b.add_vec3({{0, 0, 0}, {1, 0, 0}}));  // the second corner goes to (2,0,0)
    const TwoTimes scene = load_both(b);
    const Camera camera = flat_camera();
    expect_near(moved(scene.now, camera, {scene.before, camera}, {1.0, 0.25, 0.0}), {0.5 * kPixelsPerMetre, 0.0});
}

TEST(Motion, OfWhatIsNotThereInTheOtherPoseIsNone)
{
    GltfBuilder b;
    const int triangle = b.add_triangle_mesh();
    b.add_node({{"name", "popping"}, {"mesh", triangle}});
    b.add_node({{"name", "staying"}, {"mesh", triangle}, {"translation", {0, 0, -1}}});
    animate(b, 0, "scale", b.add_vec3({{0, 0, 0}, {1, 1, 1}}));
    const TwoTimes scene = load_both(b);
    ASSERT_EQ(scene.now.instances.size(), 2u);
    ASSERT_EQ(scene.before->instances.size(), 1u);
    const Camera camera = flat_camera();
    EXPECT_FALSE(moved(scene.now, camera, {scene.before, camera}, {0.2, 0.2, 0.0}, 0));
    EXPECT_EQ(moved(scene.now, camera, {scene.before, camera}, {0.2, 0.2, -1.0}, 1), glm::dvec2(0.0));
}

}  // namespace
}  // namespace rcs::test
