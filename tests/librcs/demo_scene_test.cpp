#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "rcs/error.h"
#include "rcs/ray_scene.h"
#include "rcs/scene.h"
#include "rcs/scene_choice.h"
#include "support/gltf_builder.h"

namespace rcs::test {
namespace {

std::size_t triangle_count(const Scene& scene)
{
    std::size_t count = 0;
    for (const Instance& i : scene.instances)
        count += scene.meshes.at(static_cast<std::size_t>(i.mesh)).triangles.size();
    return count;
}

/// Calls look(mesh, corners, normal of the face) for each triangle of each mesh, in object space.
void for_each_triangle(const Scene& scene, const std::function<void(const Mesh&, const glm::uvec3&, glm::dvec3)>& look)
{
    for (const Mesh& mesh : scene.meshes) {
        for (const glm::uvec3& t : mesh.triangles) {
            const glm::dvec3 a = mesh.positions.at(t.x);
            look(mesh, t, glm::cross(glm::dvec3(mesh.positions.at(t.y)) - a, glm::dvec3(mesh.positions.at(t.z)) - a));
        }
    }
}

TEST(DemoScenes, AreAllSoundAndHaveACamera)
{
    const std::vector<std::string> names = demo_scene_names();
    ASSERT_GE(names.size(), 6u);
    EXPECT_EQ(names[0], "demo:cornell");
    EXPECT_EQ(names[1], "demo:atrium");
    for (const std::string& name : names) {
        const Scene scene = load_scene(name);
        EXPECT_NO_THROW(validate(scene)) << name;
        EXPECT_EQ("demo:" + scene.name, name);
        EXPECT_FALSE(scene.cameras.empty()) << name;
        EXPECT_GT(triangle_count(scene), 0u) << name;
        for_each_triangle(scene, [&](const Mesh& mesh, const glm::uvec3&, glm::dvec3 normal) {
            EXPECT_GT(glm::length(normal), 1e-9) << name << " " << mesh.name << " has a triangle without area";
        });
    }
    expect_error(ErrorCode::not_found, {"demo:nope", "demo:cornell", "demo:atrium"}, [] { load_scene("demo:nope"); });
}

TEST(DemoScenes, VertexNormalsAgreeWithTheFaces)
{
    for (const std::string& name : demo_scene_names()) {
        for_each_triangle(load_scene(name), [&](const Mesh& mesh, const glm::uvec3& t, glm::dvec3 normal) {
            for (int i = 0; i < 3 && !mesh.normals.empty(); ++i) {
                EXPECT_GT(glm::dot(glm::dvec3(mesh.normals.at(t[i])), glm::normalize(normal)), 0.5)
                    << name << " " << mesh.name;
            }
        });
    }
}

TEST(DemoScenes, CornellsLampFacesDownAndItsFrontIsOpen)
{
    const Scene scene = load_scene("demo:cornell");
    double lamp_area = 0.0;
    for_each_triangle(scene, [&](const Mesh& mesh, const glm::uvec3& t, glm::dvec3 normal) {
        const Material& material = scene.materials.at(static_cast<std::size_t>(mesh.material));
        if (material.emission == glm::vec3(0.0f)) return;
        EXPECT_EQ(material.emission, glm::vec3(25, 18, 6));
        EXPECT_FALSE(material.double_sided);
        EXPECT_LT(normal.y, 0.0);
        EXPECT_GT(mesh.positions.at(t.x).y, 5.4f);
        lamp_area += 0.5 * glm::length(normal);
    });
    EXPECT_NEAR(lamp_area, 1.3 * 1.05, 1e-5);
    const Bounds bounds = bounds_of(scene);
    EXPECT_GT(glm::dvec3(scene.cameras.at(0).world_from_view[3]).z, bounds.max.z);
}

TEST(DemoScenes, TheAtriumHasItsTwoViewsInside)
{
    const Scene scene = load_scene("demo:atrium");
    ASSERT_EQ(scene.cameras.size(), 2u);
    EXPECT_EQ(scene.cameras[0].name, "court");
    EXPECT_EQ(scene.cameras[1].name, "arcade");
    const Bounds bounds = bounds_of(scene);
    for (const Camera& camera : scene.cameras) {
        const glm::dvec3 eye(camera.world_from_view[3]);
        for (int axis = 0; axis < 3; ++axis) {
            EXPECT_GT(eye[axis], bounds.min[axis]);
            EXPECT_LT(eye[axis], bounds.max[axis]);
        }
    }
    EXPECT_LT(triangle_count(scene), 30000u);
    EXPECT_LT(scene.meshes.size(), scene.instances.size() / 2);  // columns, arches and banners are shared
}

/// Volume inside closed surfaces, by the divergence theorem: positive if they face outwards.
double volume(const Scene& scene)
{
    double sum = 0.0;
    for_each_triangle(scene, [&](const Mesh& mesh, const glm::uvec3& t, glm::dvec3 normal) {
        sum += glm::dot(glm::dvec3(mesh.positions.at(t.x)), normal) / 6.0;
    });
    return sum;
}

TEST(DemoScenes, TheTestRoomsAreClosedAndFaceTheirCamera)
{
    EXPECT_NEAR(volume(load_scene("demo:closed-box")), -8.0, 1e-12);
    // 20480 facets fall short of the sphere by less than 0.1 %.
    EXPECT_NEAR(volume(load_scene("demo:furnace")), 4.18879, 0.005);
    EXPECT_NEAR(volume(load_scene("demo:sphere-light")), -33.5103, 0.04);
    const Scene sphere = load_scene("demo:sphere-light");
    for (std::size_t i = 0; i < sphere.meshes.at(0).positions.size(); ++i) {
        EXPECT_NEAR(glm::dot(sphere.meshes[0].normals[i], sphere.meshes[0].positions[i]), -2.0f, 1e-5f);
    }
}

/// How many points of a grid over a room's floor see how many of the points of another grid over a lamp.
struct Seen {
    double floor = 0.0, pairs = 0.0;  ///< shares of floor points that see any of the lamp, and of all pairs
};
Seen lamp_seen_from_floor(const Scene& scene, glm::vec2 low, glm::vec2 high, const std::string& lamp)
{
    const ThreadPool pool(1);
    const RayScene rays = build_ray_scene(scene, pool);
    const auto mesh =
        std::find_if(scene.meshes.begin(), scene.meshes.end(), [&](const Mesh& m) { return m.name == lamp; });
    const glm::vec3 a = mesh->positions.at(0), u = mesh->positions.at(1) - a, v = mesh->positions.at(3) - a;
    constexpr int kPoints = 24;
    const auto at = [](int i) { return (static_cast<float>(i) + 0.5f) / kPoints; };
    Seen seen;
    for (int p = 0; p < kPoints * kPoints; ++p) {
        const glm::vec2 xz = low + (high - low) * glm::vec2(at(p / kPoints), at(p % kPoints));
        const glm::vec3 from(xz.x, 0.001f, xz.y);
        int free = 0;
        for (int q = 0; q < kPoints * kPoints; ++q)
            free += occluded(rays, {from, a + at(q / kPoints) * u + at(q % kPoints) * v - from, 0.0f, 0.999f}) ? 0 : 1;
        seen.floor += (free > 0 ? 1.0 : 0.0) / (kPoints * kPoints);
        seen.pairs += static_cast<double>(free) / (kPoints * kPoints * kPoints * kPoints);
    }
    return seen;
}

TEST(DemoScenes, TheRoomsWhoseLightIsHardToFindSeeLittleOfTheirLamps)
{
    const Scene ajar = load_scene("demo:ajar"), blinds = load_scene("demo:blinds");
    EXPECT_LT(triangle_count(ajar), 5000u);
    EXPECT_LT(triangle_count(blinds), 5000u);
    const Seen through_gap = lamp_seen_from_floor(ajar, {-2.3f, -1.9f}, {2.3f, 2.5f}, "lamp");
    EXPECT_GT(through_gap.floor, 0.01);
    EXPECT_LT(through_gap.floor, 0.2) << "nearly all light is indirect";
    const Seen between_slats = lamp_seen_from_floor(blinds, {-2.4f, -1.9f}, {2.4f, 2.5f}, "sky");
    EXPECT_GT(between_slats.floor, 0.5);
    EXPECT_GT(between_slats.pairs, 0.001);
    EXPECT_LT(between_slats.pairs, 0.03) << "of the panel as good as nothing is seen";
}

TEST(FindCamera, TakesANameANumberOrNothing)
{
    Scene scene;
    scene.name = "s";
    expect_error(ErrorCode::not_found, {"none"}, [&] { find_camera(scene, ""); });
    for (const char* name : {"left", "right", "0"}) scene.cameras.push_back({name});
    EXPECT_EQ(&find_camera(scene, ""), &scene.cameras[0]);
    EXPECT_EQ(&find_camera(scene, "right"), &scene.cameras[1]);
    EXPECT_EQ(&find_camera(scene, "1"), &scene.cameras[1]);
    EXPECT_EQ(&find_camera(scene, "0"), &scene.cameras[2]);  // a name comes before a number
    for (const char* wrong : {"nope", "3", "-1", "1x", "99999999999999999999"}) {
        expect_error(ErrorCode::not_found, {wrong, "left, right, 0"}, [&] { find_camera(scene, wrong); });
    }
}

TEST(ChooseCamera, TakesTheScenesOrOneThatIsGivenAndShiftsItsLens)
{
    Scene scene;
    scene.cameras.push_back({"left"});
    scene.origin = {100.0, 0.0, 0.0};
    EXPECT_EQ(choose_camera(scene, {}).name, "left");
    EXPECT_EQ(choose_camera(scene, {"left", {}, glm::dvec2(0.25, 1.0)}).lens_shift, glm::dvec2(0.25, 1.0));
    Camera given{"given"};
    given.world_from_view[3] = {101.0, 2.0, 3.0, 1.0};
    const Camera chosen = choose_camera(scene, {"left", given, {}});
    EXPECT_EQ(chosen.name, "given");
    EXPECT_EQ(camera_position(chosen), glm::dvec3(1.0, 2.0, 3.0)) << "is given in the space of the file";
}

TEST(SetEnvironment, TakesThePlaceOfTheScenesSkyAndAddsItsRotation)
{
    Scene scene;
    scene.sky_radiance = glm::vec3(1.0f);
    scene.environment = {"sky", 1, 1, {glm::vec3(2.0f)}, 0.5};
    set_environment(scene, {{}, "", 180.0});
    EXPECT_EQ(scene.sky_radiance, glm::vec3(1.0f)) << "nothing chosen: the scene's own";
    EXPECT_FALSE(scene.environment.empty());
    EXPECT_NEAR(scene.environment.rotation, 0.5 + 3.14159265358979, 1e-12);
    set_environment(scene, {glm::vec3(3.0f), "", 0.0});
    EXPECT_EQ(scene.sky_radiance, glm::vec3(3.0f));
    EXPECT_TRUE(scene.environment.empty());
    EXPECT_THROW(set_environment(scene, {{}, "/no/such.hdr", 0.0}), Error);
}

TEST(Validate, NamesWhatIsWrong)
{
    const auto broken = [](const std::function<void(Scene&)>& change) {
        Scene scene = load_scene("demo:sphere-light");
        change(scene);
        return scene;
    };
    const auto expect_bad = [&](const std::vector<std::string>& parts, const std::function<void(Scene&)>& change) {
        expect_error(ErrorCode::bad_file, parts, [&] { validate(broken(change)); });
    };
    expect_bad({"mesh 0 'sphere'", "vertex"}, [](Scene& s) { s.meshes[0].triangles[5].y = 999999; });
    expect_bad({"mesh 0", "finite"}, [](Scene& s) { s.meshes[0].positions[3].x = NAN; });
    expect_bad({"mesh 0", "unit"}, [](Scene& s) { s.meshes[0].normals[3] *= 2.0f; });
    expect_bad({"mesh 0", "uv"}, [](Scene& s) { s.meshes[0].uvs.pop_back(); });
    expect_bad({"mesh 0", "material"}, [](Scene& s) { s.meshes[0].material = 1; });
    expect_bad({"instance 0", "mesh"}, [](Scene& s) { s.instances[0].mesh = -1; });
    expect_bad({"material 0 'grey'", "[0, 1]"}, [](Scene& s) { s.materials[0].base_color.g = 1.5f; });
    expect_bad({"material 0", "texture"}, [](Scene& s) { s.materials[0].base_color_texture.texture = 0; });
    expect_bad({"light 0 'centre'", "intensity"}, [](Scene& s) { s.lights[0].intensity.r = -1.0f; });
    expect_bad({"camera 0", "yfov"}, [](Scene& s) { s.cameras[0].yfov = 3.2; });
    expect_bad({"sky"}, [](Scene& s) { s.sky_radiance.b = NAN; });
}

TEST(BoundsOf, CountsInstancesButNoUnusedVertices)
{
    Scene scene;
    EXPECT_GT(bounds_of(scene).min.x, bounds_of(scene).max.x);  // nothing there
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1000, 1000, 1000}};
    mesh.triangles = {{0, 1, 2}};
    scene.meshes.push_back(mesh);
    Instance instance;
    instance.world_from_object[3] = glm::dvec4(1e7, 0, -2, 1);
    scene.instances = {instance};
    const Bounds bounds = bounds_of(scene);
    EXPECT_EQ(bounds.min, glm::dvec3(1e7, 0, -2));
    EXPECT_EQ(bounds.max, glm::dvec3(1e7 + 1, 1, -2));
}

}  // namespace
}  // namespace rcs::test
