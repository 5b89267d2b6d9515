#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <glm/gtc/matrix_transform.hpp>

#include "rcs/error.h"
#include "rcs/scene.h"
#include "rcs/scene_choice.h"
#include "support/gltf_builder.h"

// Animations, morph targets, skins and instances, against positions worked out by hand.

namespace rcs::test {
namespace {

using std::numbers::pi;

Scene load_at(const GltfBuilder& b, std::optional<double> time, Log* log = nullptr)
{
    const TemporaryFolder folder;
    write_bytes(folder / "test.glb", b.glb());
    return load_scene(folder / "test.glb", log ? log->function() : LogFunction{}, {time});
}

/// World position of a vertex of an instance.
glm::dvec3 vertex(const Scene& scene, std::size_t instance, std::size_t index)
{
    const Instance& i = scene.instances.at(instance);
    const Mesh& mesh = scene.meshes.at(static_cast<std::size_t>(i.mesh));
    return glm::dvec3(i.world_from_object * glm::dvec4(mesh.positions.at(index), 1.0)) + scene.origin;
}

void expect_near(glm::dvec3 value, glm::dvec3 expected, double tolerance = 1e-6)
{
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(value[i], expected[i], tolerance) << "component " << i;
}

int add_scalars(GltfBuilder& b, const std::vector<float>& values)
{
    return b.add_accessor(b.add_view(raw(values)), kFloat, "SCALAR", values.size());
}
int add_vec4(GltfBuilder& b, const std::vector<glm::vec4>& values)
{
    return b.add_accessor(b.add_view(raw(values)), kFloat, "VEC4", values.size());
}

/// An animation with one channel.
void animate(GltfBuilder& b, const std::string& name, int node, const char* path, int input, int output,
             const char* interpolation = "LINEAR")
{
    b.add("animations",
          {{"name", name},
           {"channels", Json::array({{{"sampler", 0}, {"target", {{"node", node}, {"path", path}}}}})},
           {"samplers", Json::array({{{"input", input}, {"output", output}, {"interpolation", interpolation}}})}});
}

/// A triangle whose translation is animated from (0,0,0) at 1 s over (2,0,0) at 2 s to (2,4,0) at 4 s.
GltfBuilder moving_triangle(const char* interpolation)
{
    GltfBuilder b;
    b.add_node({{"mesh", b.add_triangle_mesh()}, {"translation", {7, 7, 7}}});
    animate(b, "move", 0, "translation", add_scalars(b, {1, 2, 4}), b.add_vec3({{0, 0, 0}, {2, 0, 0}, {2, 4, 0}}),
            interpolation);
    return b;
}

TEST(GltfAnimation, LinearMotionIsHeldAtBothEnds)
{
    const GltfBuilder b = moving_triangle("LINEAR");
    expect_near(vertex(load_at(b, {}), 0, 0), {7, 7, 7});  // at rest: the node's own place
    expect_near(vertex(load_at(b, 0.0), 0, 0), {0, 0, 0});
    expect_near(vertex(load_at(b, 1.25), 0, 0), {0.5, 0, 0});
    expect_near(vertex(load_at(b, 2.0), 0, 0), {2, 0, 0});
    expect_near(vertex(load_at(b, 3.5), 0, 0), {2, 3, 0});
    expect_near(vertex(load_at(b, 99.0), 0, 0), {2, 4, 0});
}

TEST(GltfAnimation, OneOfThemMayBeChosen)
{
    GltfBuilder b = moving_triangle("LINEAR");
    animate(b, "stand", 0, "translation", add_scalars(b, {0, 6}), b.add_vec3({{0, 0, 5}, {0, 0, 5}}));
    const TemporaryFolder folder;
    write_bytes(folder / "test.glb", b.glb());
    const auto place = [&](const std::string& animation, std::optional<double> time = 2.0, Log* log = nullptr) {
        return vertex(load_scene(folder / "test.glb", log ? log->function() : LogFunction{}, {time, animation}), 0, 0);
    };
    expect_near(place(""), {2, 0, 0});
    expect_near(place("all"), {2, 0, 0});
    expect_near(place("move"), {2, 0, 0});
    expect_near(place("stand"), {0, 0, 5});
    expect_near(place("1"), {0, 0, 5});
    Log log;
    expect_near(place("stand", {}, &log), {7, 7, 7});
    EXPECT_EQ(log.count("an animation is chosen, but no time"), 1);
    for (const auto& [wrong, said] :
         {std::pair{"stnad", "has no animation 'stnad'; it has move, stand; did you mean 'stand'?"},
          {"2", "has no animation '2'; it has move, stand"}}) {
        try {
            place(wrong, {});
            ADD_FAILURE() << wrong;
        } catch (const Error& e) {
            EXPECT_EQ(e.code(), ErrorCode::not_found);
            EXPECT_NE(std::string(e.what()).find(said), std::string::npos) << e.what();
        }
    }
    const std::vector<AnimationInfo> listed = list_animations(folder / "test.glb");
    ASSERT_EQ(listed.size(), 2u);
    EXPECT_EQ(listed[0].name, "move");
    EXPECT_EQ(listed[1].name, "stand");
    EXPECT_EQ(list_animations("demo:atrium").size(), 1u);
    EXPECT_EQ(list_animations("demo:atrium")[0].seconds, 2.0);
    EXPECT_TRUE(list_animations("demo:cornell").empty());
    EXPECT_THROW(load_scene("demo:atrium", {}, {1.0, "door"}), Error);
}

TEST(GltfAnimation, StepsJumpAtTheirKeyframes)
{
    const GltfBuilder b = moving_triangle("STEP");
    expect_near(vertex(load_at(b, 1.999), 0, 0), {0, 0, 0});
    expect_near(vertex(load_at(b, 2.0), 0, 0), {2, 0, 0});
    expect_near(vertex(load_at(b, 3.999), 0, 0), {2, 0, 0});
}

TEST(GltfAnimation, SplinesFollowTheirTangents)
{
    GltfBuilder b;
    b.add_node({{"mesh", b.add_triangle_mesh()}});
    // x(t) = t^3 on [0, 2]: slopes 0 and 12, which a Hermite spline reproduces exactly.
    animate(b, "cube", 0, "translation", add_scalars(b, {0, 2}),
            b.add_vec3({{9, 9, 9}, {0, 0, 0}, {0, 0, 0}, {12, 0, 0}, {8, 0, 0}, {9, 9, 9}}), "CUBICSPLINE");
    for (const double t : {0.0, 0.5, 1.0, 1.7, 2.0}) expect_near(vertex(load_at(b, t), 0, 0), {t * t * t, 0, 0});
}

TEST(GltfAnimation, RotationsTakeTheShorterArcAtConstantSpeed)
{
    GltfBuilder b;
    b.add_node({{"mesh", b.add_triangle_mesh()}});
    const auto s = static_cast<float>(std::sqrt(0.5));
    animate(b, "turn", 0, "rotation", add_scalars(b, {0, 1}),
            add_vec4(b, {{0, 0, 0, 1}, {0, 0, -s, -s}}));  // 90 degrees, negated
    for (const double t : {0.0, 0.3, 1.0}) {
        const double angle = t * pi / 2;
        expect_near(vertex(load_at(b, t), 0, 1), {std::cos(angle), std::sin(angle), 0});
    }
}

/// An animation of a property, with one channel.
void animate_property(GltfBuilder& b, const std::string& pointer, int input, int output, const char* interpolation)
{
    const Json target = {{"path", "pointer"}, {"extensions", {{"KHR_animation_pointer", {{"pointer", pointer}}}}}};
    b.add("animations",
          {{"channels", Json::array({{{"sampler", 0}, {"target", target}}})},
           {"samplers", Json::array({{{"input", input}, {"output", output}, {"interpolation", interpolation}}})}});
}

TEST(GltfAnimationPointer, ChangesLampsCamerasMaterialsAndNodes)
{
    GltfBuilder b;
    b.add_node({{"mesh", b.add_triangle_mesh()}, {"name", "a"}});
    b.add_node(
        {{"camera", b.add("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 1.0}, {"znear", 0.1}}}})}});
    b.root["extensions"]["KHR_lights_punctual"]["lights"] = Json::array({{{"type", "point"}, {"intensity", 8.0}}});
    b.add_node({{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    b.root["extensionsRequired"] = Json::array({"KHR_animation_pointer"});
    b.root["materials"] = Json::array({Json::object()});
    b.root["meshes"][0]["primitives"][0]["material"] = 0;
    const int input = add_scalars(b, {0, 2});
    animate_property(b, "/extensions/KHR_lights_punctual/lights/0/intensity", input, add_scalars(b, {0, 4}), "LINEAR");
    animate_property(b, "/cameras/0/perspective/yfov", input, add_scalars(b, {0.5f, 1.5f}), "LINEAR");
    animate_property(b, "/materials/0/pbrMetallicRoughness/baseColorFactor", input,
                     add_vec4(b, {{0, 0, 0, 1}, {1, 0.5f, 0.25f, 1}}), "LINEAR");
    animate_property(b, "/materials/0/pbrMetallicRoughness/roughnessFactor", input, add_scalars(b, {0.25f, 0.75f}),
                     "STEP");
    animate_property(b, "/nodes/0/translation", input, b.add_vec3({{0, 0, 0}, {4, 0, 0}}), "LINEAR");
    const Scene rest = load_at(b, {});
    EXPECT_EQ(rest.lights.at(0).intensity.x, 8.0f);
    EXPECT_EQ(rest.cameras.at(0).yfov, 1.0);
    Log log;
    const Scene moved = load_at(b, 1.0, &log);
    EXPECT_EQ(log.count("ignored"), 0) << "all of it is known";
    EXPECT_FLOAT_EQ(moved.lights.at(0).intensity.x, 2.0f);
    EXPECT_NEAR(moved.cameras.at(0).yfov, 1.0, 1e-7);
    EXPECT_NEAR(load_at(b, 2.0).cameras.at(0).yfov, 1.5, 1e-7);
    EXPECT_FLOAT_EQ(moved.materials.at(0).base_color.y, 0.25f);
    EXPECT_FLOAT_EQ(moved.materials.at(0).roughness, 0.25f);
    EXPECT_FLOAT_EQ(load_at(b, 2.0).materials.at(0).roughness, 0.75f);
    expect_near(vertex(moved, 0, 0), {2, 0, 0});
}

TEST(GltfAnimationPointer, HidesNodesWithAllBelow)
{
    GltfBuilder b;
    const int mesh = b.add_triangle_mesh();
    const Json hidden = {{"KHR_node_visibility", {{"visible", false}}}};
    b.add_node({{"mesh", mesh}, {"name", "parent"}, {"children", {1}}, {"extensions", hidden}});
    b.root["nodes"].push_back({{"mesh", mesh}, {"name", "child"}});
    b.add_node({{"mesh", mesh}, {"name", "other"}});
    const auto output = b.add_accessor(b.add_view(raw(std::vector<std::uint8_t>{0, 1})), kUnsignedByte, "SCALAR", 2);
    animate_property(b, "/nodes/0/extensions/KHR_node_visibility/visible", add_scalars(b, {0, 1}), output, "STEP");
    const auto names = [&](std::optional<double> time) {
        std::string list;
        for (const Instance& instance : load_at(b, time).instances) list += instance.name + " ";
        return list;
    };
    EXPECT_EQ(names({}), "other ");
    EXPECT_EQ(names(0.99), "other ");
    EXPECT_EQ(names(1.0), "parent child other ");
}

TEST(GltfAnimationPointer, ToNothingIsNamed)
{
    GltfBuilder b;
    b.add_node({{"mesh", b.add_triangle_mesh()}});
    const int input = add_scalars(b, {0, 2});
    animate_property(b, "/materials/7/alphaCutoff", input, add_scalars(b, {0, 1}), "LINEAR");
    try {
        load_at(b, 1.0);
        ADD_FAILURE() << "there is no such material";
    } catch (const Error& e) {
        EXPECT_NE(std::string(e.what()).find("points to /materials/7/alphaCutoff"), std::string::npos) << e.what();
    }
}

TEST(GltfAnimation, ThoseOfDifferentNodesPlayTogetherOthersAreNamed)
{
    GltfBuilder b;
    const int mesh = b.add_triangle_mesh();
    b.add_node({{"mesh", mesh}});
    b.add_node({{"mesh", mesh}});
    const int input = add_scalars(b, {0});
    animate(b, "a", 0, "translation", input, b.add_vec3({{1, 0, 0}}));
    animate(b, "b", 1, "translation", input, b.add_vec3({{0, 2, 0}}));
    animate(b, "c", 1, "translation", input, b.add_vec3({{0, 0, 3}}));
    Log log;
    const Scene scene = load_at(b, 0.5, &log);
    expect_near(vertex(scene, 0, 0), {1, 0, 0});
    expect_near(vertex(scene, 1, 0), {0, 2, 0});
    EXPECT_EQ(log.count("motion of what an earlier animation moves in 1 animation (c)"), 1);
}

TEST(GltfAnimation, TheSharedSceneMovesItsObjectsAndItsCamera)
{
    const std::string path = RCS_SCENES_DIR "/cornell-animated.glb";
    if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is missing";
    const auto matrices = [&](std::optional<double> time) {
        const Scene scene = load_scene(path, {}, {time});
        std::vector<glm::dmat4> all = {scene.cameras.at(0).world_from_view};
        for (const Instance& instance : scene.instances) all.push_back(instance.world_from_object);
        return all;
    };
    const auto moved = [](const std::vector<glm::dmat4>& a, const std::vector<glm::dmat4>& b) {
        int count = 0;
        for (std::size_t i = 1; i < a.size(); ++i) count += a[i] != b.at(i);
        return count;
    };
    const auto early = matrices(1.4), late = matrices(1.502);
    EXPECT_EQ(moved(early, late), 3);  // its description: sphere, box, and a panel that jumps at 1.501 s
    EXPECT_EQ(moved(matrices(1.499), matrices(1.5)), 2);
    EXPECT_NE(early[0], late[0]);
    EXPECT_EQ(matrices(4.0), matrices(50.0));
}

TEST(GltfMorph, TargetsAddUpByTheirWeights)
{
    GltfBuilder b;
    const int positions = b.add_vec3({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
    const int normals = b.add_vec3({{0, 0, 1}, {0, 0, 1}, {0, 0, 1}});
    const int lift = b.add_vec3({{0, 0, 0}, {0, 0, 0}, {0, 0, 2}});
    const int stretch = b.add_vec3({{0, 0, 0}, {1, 0, 0}, {0, 0, 0}});
    const int tilt = b.add_vec3({{0, 0, 0}, {2, 0, 0}, {0, 0, 0}});
    const int mesh = b.add_mesh("m", {{"attributes", {{"POSITION", positions}, {"NORMAL", normals}}},
                                      {"targets", {{{"POSITION", lift}}, {{"POSITION", stretch}, {"NORMAL", tilt}}}}});
    b.root["meshes"][0]["weights"] = {0.5, 0.25};
    b.add_node({{"mesh", mesh}});
    b.add_node({{"mesh", mesh}, {"weights", {0, 1}}});
    b.add_node({{"mesh", mesh}});
    const Scene scene = load(b);
    EXPECT_EQ(scene.meshes.size(), 2u);  // nodes 0 and 2 look the same
    EXPECT_EQ(scene.instances.at(2).mesh, scene.instances.at(0).mesh);
    expect_near(vertex(scene, 0, 1), {1.25, 0, 0});
    expect_near(vertex(scene, 0, 2), {0, 1, 1});
    expect_near(vertex(scene, 1, 1), {2, 0, 0});
    expect_near(vertex(scene, 1, 2), {0, 1, 0});
    expect_near(scene.meshes[0].normals.at(1), glm::normalize(glm::dvec3(0.5, 0, 1)));
    animate(b, "swell", 0, "weights", add_scalars(b, {0, 1}), add_scalars(b, {0, 0, 1, 1}));
    const Scene posed = load_at(b, 0.75);
    expect_near(vertex(posed, 0, 1), {1.75, 0, 0});
    expect_near(vertex(posed, 0, 2), {0, 1, 1.5});
}

TEST(GltfSkin, VerticesFollowTheirJointsWhereverTheNodeIs)
{
    GltfBuilder b;
    const int positions = b.add_vec3({{0, 0, 0}, {2, 0, 0}, {0, 1, 0}});
    const int normals = b.add_vec3({{0, 0, 1}, {0, 1, 0}, {0, 0, 1}});
    const int joints = b.add_accessor(
        b.add_view(raw(std::vector<glm::u8vec4>{{0, 0, 0, 0}, {1, 0, 0, 0}, {0, 1, 0, 0}})), kUnsignedByte, "VEC4", 3);
    // The third hangs on both; weights are normalised.
    const int weights = add_vec4(b, {{1, 0, 0, 0}, {1, 0, 0, 0}, {3, 1, 0, 0}});
    const int mesh = b.add_mesh(
        "m",
        {{"attributes", {{"POSITION", positions}, {"NORMAL", normals}, {"JOINTS_0", joints}, {"WEIGHTS_0", weights}}}});
    // Joint 1 sits at (1,0,0) in its bind pose and is turned by 90 degrees about z; both are carried by (0,0,5).
    const glm::mat4 inverse_bind[] = {glm::mat4(1.0f), glm::translate(glm::mat4(1.0f), {-1, 0, 0})};
    const int matrices =
        b.add_accessor(b.add_view(raw<glm::mat4>({inverse_bind[0], inverse_bind[1]})), kFloat, "MAT4", 2);
    const double h = std::sqrt(0.5);
    b.add_node({{"mesh", mesh}, {"skin", 0}, {"translation", {100, 100, 100}}, {"scale", {0, 0, 0}}});
    b.add_node({{"children", {2}}, {"translation", {0, 0, 5}}});
    b.add_node({{"translation", {1, 0, 0}}, {"rotation", {0, 0, h, h}}});
    b.add("skins", {{"joints", {1, 2}}, {"inverseBindMatrices", matrices}});
    const Scene scene = load(b);
    ASSERT_EQ(scene.instances.size(), 1u);
    expect_near(vertex(scene, 0, 0), {0, 0, 5});
    expect_near(vertex(scene, 0, 1), {1, 1, 5});  // (2,0,0) - (1,0,0), turned, + (1,0,5)
    expect_near(vertex(scene, 0, 2),
                {0, 0.5, 5});  // 3/4 of (0,1,5) and 1/4 of (0,-1,5), as joint 1 sees (-1,1,0) turned
    expect_near(scene.meshes.at(0).normals.at(1), {-1, 0, 0});
}

TEST(GltfInstances, ShareTheirMesh)
{
    GltfBuilder b;
    const int moves = b.add_vec3({{1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
    const int sizes = b.add_vec3({{1, 1, 1}, {2, 2, 2}, {3, 3, 3}});
    const int turns =
        b.add_accessor(b.add_view(raw<std::int8_t>({0, 0, 0, 127, 0, 0, 127, 0, 0, 0, 0, 127})), kByte, "VEC4", 3);
    b.root["accessors"][static_cast<std::size_t>(turns)]["normalized"] = true;
    b.add_node({{"mesh", b.add_triangle_mesh()},
                {"translation", {10, 0, 0}},
                {"extensions",
                 {{"EXT_mesh_gpu_instancing",
                   {{"attributes", {{"TRANSLATION", moves}, {"SCALE", sizes}, {"ROTATION", turns}}}}}}}});
    const Scene scene = load(b);
    EXPECT_EQ(scene.meshes.size(), 1u);
    ASSERT_EQ(scene.instances.size(), 3u);
    expect_near(vertex(scene, 0, 1), {12, 0, 0});  // (1,0,0) + (1,0,0) + (10,0,0)
    expect_near(vertex(scene, 1, 1), {8, 1, 0});   // twice (1,0,0), turned by 180 degrees about z
    expect_near(vertex(scene, 2, 1), {13, 0, 1});
}

}  // namespace
}  // namespace rcs::test
