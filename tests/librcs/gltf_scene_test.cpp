#include <cmath>
#include <filesystem>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "rcs/error.h"
#include "rcs/scene.h"
#include "support/gltf_builder.h"
#include "support/pictures.h"

// Nodes, cameras, lights, materials and textures.

namespace rcs::test {
namespace {

using std::numbers::pi;

void expect_near(glm::dvec3 value, glm::dvec3 expected, double tolerance = 1e-12)
{
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(value[i], expected[i], tolerance) << "component " << i;
}

/// Where an instance puts a point of its mesh, in world space.
glm::dvec3 world(const Scene& scene, std::size_t instance, glm::dvec3 p)
{
    return glm::dvec3(scene.instances.at(instance).world_from_object * glm::dvec4(p, 1.0)) + scene.origin;
}

TEST(GltfNodes, TransformsAreComposedFromTheRootDown)
{
    GltfBuilder b;
    const int mesh = b.add_triangle_mesh();
    const double h = std::sqrt(0.5);
    // Scale by 2, then turn by 90 degrees about Z, then move; the parent moves and mirrors X.
    b.add_node({{"mesh", mesh}, {"scale", {2, 2, 2}}, {"rotation", {0, 0, h, h}}, {"translation", {10, 0, 0}}});
    b.add_node({{"children", {0}}, {"matrix", {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 100, 1}}});
    const Scene scene = load(b);
    ASSERT_EQ(scene.instances.size(), 1u);
    expect_near(world(scene, 0, {0, 0, 0}), {-10, 0, 100});
    expect_near(world(scene, 0, {1, 0, 0}), {-10, 2, 100});  // (2,0,0) -> (0,2,0) -> (10,2,0) -> (-10,2,100)
    expect_near(world(scene, 0, {0, 1, 0}), {-8, 0, 100});   // (0,2,0) -> (-2,0,0) -> (8,0,0) -> (-8,0,100)
    EXPECT_LT(glm::determinant(glm::dmat3(scene.instances[0].world_from_object)), 0.0);
}

TEST(GltfNodes, AMeshUsedTwiceIsOneMeshAndUnusedOnesAreDropped)
{
    GltfBuilder b;
    b.add_triangle_mesh("unused");
    const int used = b.add_triangle_mesh("used");
    b.add_node({{"name", "a"}, {"mesh", used}});
    b.add_node({{"name", "b"}, {"mesh", used}, {"translation", {0, 0, 3}}});
    const Scene scene = load(b);
    ASSERT_EQ(scene.meshes.size(), 1u);
    EXPECT_EQ(scene.meshes[0].name, "used");
    ASSERT_EQ(scene.instances.size(), 2u);
    EXPECT_EQ(scene.instances[1].name, "b");
    EXPECT_EQ(scene.instances[1].mesh, 0);
}

TEST(GltfNodes, OnlyTheDefaultSceneIsLoaded)
{
    GltfBuilder b;
    const int mesh = b.add_triangle_mesh();
    for (const char* name : {"zero", "one", "two"}) b.add_node({{"name", name}, {"mesh", mesh}});
    EXPECT_EQ(load(b).instances.size(), 3u);  // no scene: every root
    b.root["scenes"] = Json::array({{{"nodes", {0}}}, {{"nodes", {1, 2}}}});
    EXPECT_EQ(load(b).instances.at(0).name, "zero");
    b.root["scene"] = 1;
    EXPECT_EQ(load(b).instances.at(0).name, "one");
    b.root["scene"] = 2;
    expect_error(ErrorCode::bad_file, {"default scene"}, [&] { load(b); });
}

TEST(GltfNodes, AHierarchyMayBeDeeperThanTheStack)
{
    constexpr int kDepth = 200000;
    GltfBuilder b;
    b.add_node({{"mesh", b.add_triangle_mesh()}, {"translation", {1, 0, 0}}});
    for (int i = 0; i < kDepth; ++i) b.add_node({{"children", {i}}, {"translation", {0, 1.0 / kDepth, 0}}});
    const Scene scene = load(b);
    ASSERT_EQ(scene.instances.size(), 1u);
    expect_near(world(scene, 0, {0, 0, 0}), {1, 1, 0}, 1e-9);  // 2e5 sums of doubles, each within 1e-16
}

TEST(GltfNodes, CyclesAndSecondParentsAreErrors)
{
    GltfBuilder cycle;
    cycle.add_node({{"children", {1}}});
    cycle.add_node({{"children", {0}}});
    expect_error(ErrorCode::bad_file, {"cycle"}, [&] { load(cycle); });
    cycle.root["scenes"] = Json::array({{{"nodes", {0}}}});
    expect_error(ErrorCode::bad_file, {"node 0", "child of node 1"}, [&] { load(cycle); });

    GltfBuilder shared;
    shared.add_node({{"children", {2}}});
    shared.add_node({{"children", {2}}});
    shared.add_node({{"name", "twice"}});
    expect_error(ErrorCode::bad_file, {"node 2 'twice'", "two nodes"}, [&] { load(shared); });
    shared.root["nodes"][0]["children"] = {9};
    expect_error(ErrorCode::bad_file, {"child 9"}, [&] { load(shared); });
}

TEST(GltfNodes, MatricesThatFlattenAreSkippedWithAWarning)
{
    GltfBuilder b;
    const int mesh = b.add_triangle_mesh();
    b.add_node({{"name", "flat"}, {"mesh", mesh}, {"scale", {1, 0, 1}}});
    b.add_node({{"name", "skewed flat"}, {"mesh", mesh}, {"matrix", {1, 1, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}}});
    b.add_node({{"name", "thin"}, {"mesh", mesh}, {"scale", {1, 1e-6, 1}}});
    Log log;
    const Scene scene = load(b, &log);
    ASSERT_EQ(scene.instances.size(), 1u);
    EXPECT_EQ(scene.instances[0].name, "thin");
    EXPECT_EQ(log.count("in 2 nodes (flat, skewed flat): left out"), 1);
}

TEST(GltfNodes, AFarAwaySceneIsMovedToTheOrigin)
{
    GltfBuilder b;
    const int mesh = b.add_triangle_mesh();
    b.root["extensions"]["KHR_lights_punctual"]["lights"] = Json::array({{{"type", "point"}}});
    b.add_node({{"mesh", mesh}, {"translation", {1e6, 2e6, 0}}});
    b.add_node({{"translation", {1e6, 2e6, 5}}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    b.add("cameras",
          {{"type", "orthographic"}, {"orthographic", {{"xmag", 1}, {"ymag", 2}, {"znear", 0}, {"zfar", 1}}}});
    b.add_node({{"camera", 0}, {"translation", {1e6, 2e6, 9}}});
    const Scene scene = load(b);
    expect_near(scene.origin, {1e6 + 0.5, 2e6 + 0.5, 0});
    expect_near(world(scene, 0, {1, 0, 0}), {1e6 + 1, 2e6, 0}, 1e-9);
    expect_near(scene.lights.at(0).position + scene.origin, {1e6, 2e6, 5}, 1e-9);
    expect_near(glm::dvec3(scene.cameras.at(0).world_from_view[3]) + scene.origin, {1e6, 2e6, 9}, 1e-9);
    b.root["nodes"][0]["translation"] = {20, 0, 0};  // under 16 diagonals of sqrt(2)
    EXPECT_EQ(load(b).origin, glm::dvec3(0.0));
}

TEST(GltfCameras, KeepNodeOrderNamesAndLoseTheirScale)
{
    GltfBuilder b;
    b.add("cameras", {{"name", "lens"}, {"type", "perspective"}, {"perspective", {{"yfov", 0.5}, {"znear", 0.1}}}});
    b.add("cameras",
          {{"type", "orthographic"}, {"orthographic", {{"xmag", 1}, {"ymag", 2}, {"znear", 0}, {"zfar", 1}}}});
    const double h = std::sqrt(0.5);
    b.add_node({{"name", "node name"},
                {"camera", 0},
                {"scale", {3, 5, 7}},
                {"rotation", {0, h, 0, h}},
                {"translation", {1, 2, 3}}});
    b.add_node({{"camera", 0}});
    b.add_node({{"camera", 1}});
    const Scene scene = load(b);
    ASSERT_EQ(scene.cameras.size(), 3u);
    EXPECT_EQ(scene.cameras[0].name, "node name");
    EXPECT_EQ(scene.cameras[1].name, "lens");
    EXPECT_EQ(scene.cameras[2].name, "camera 2");
    EXPECT_EQ(scene.cameras[0].yfov, 0.5);
    EXPECT_EQ(scene.cameras[2].projection, Projection::orthographic);
    EXPECT_EQ(scene.cameras[2].ymag, 2.0);
    const glm::dmat4& m = scene.cameras[0].world_from_view;  // turned by 90 degrees about Y
    expect_near(glm::dvec3(m[0]), {0, 0, -1});
    expect_near(glm::dvec3(m[1]), {0, 1, 0});
    expect_near(glm::dvec3(m[2]), {1, 0, 0});
    expect_near(glm::dvec3(m[3]), {1, 2, 3});
    b.root["cameras"][0]["perspective"]["yfov"] = 4;
    expect_error(ErrorCode::bad_file, {"yfov", "(0, pi)"}, [&] { load(b); });
}

TEST(GltfCameras, AFileWithoutOneGetsOneThatSeesEverything)
{
    GltfBuilder b;
    b.add_node({{"mesh", b.add_triangle_mesh()}, {"scale", {9, 3, 1}}, {"translation", {5, 5, 5}}});
    Log log;
    const Scene scene = load(b, &log);
    ASSERT_EQ(scene.cameras.size(), 1u);
    EXPECT_EQ(scene.cameras[0].name, "framed");
    EXPECT_EQ(log.count("no camera"), 1);
    EXPECT_EQ(log.count("no light; a neutral sky of radiance 1"), 1);
    EXPECT_EQ(scene.sky_radiance, glm::vec3(1.0f));
    const glm::dmat4 view_from_world = glm::inverse(scene.cameras[0].world_from_view);
    const double edge = std::tan(0.5 * scene.cameras[0].yfov);
    for (const glm::vec3& corner : scene.meshes.at(0).positions) {
        const glm::dvec3 p = view_from_world * glm::dvec4(world(scene, 0, corner) - scene.origin, 1.0);
        EXPECT_LT(p.z, 0.0);
        EXPECT_LE(std::fabs(p.x), -p.z * edge);
        EXPECT_LE(std::fabs(p.y), -p.z * edge);
    }
}

TEST(GltfLights, PointDownTheirNodesNegativeZ)
{
    GltfBuilder b;
    b.root["extensions"]["KHR_lights_punctual"]["lights"] =
        Json::array({{{"type", "directional"}, {"color", {1, 0.5, 0.25}}, {"intensity", 8}},
                     {{"type", "spot"},
                      {"intensity", 3},
                      {"range", 12},
                      {"spot", {{"innerConeAngle", 0.2}, {"outerConeAngle", 0.6}}}},
                     {{"type", "point"}, {"name", "bulb"}},
                     {{"type", "spot"}, {"spot", {{"innerConeAngle", 0.4}, {"outerConeAngle", 0.4}}}}});
    const double h = std::sqrt(0.5);
    for (int i = 0; i < 4; ++i) {
        b.add_node({{"extensions", {{"KHR_lights_punctual", {{"light", i}}}}},
                    {"rotation", {-h, 0, 0, h}},
                    {"scale", {2, 2, 2}},
                    {"translation", {0, i, 0}}});
    }
    Log log;
    const Scene scene = load(b, &log);
    ASSERT_EQ(scene.lights.size(), 4u);
    EXPECT_EQ(scene.lights[0].kind, LightKind::directional);
    EXPECT_EQ(scene.lights[0].intensity, glm::vec3(8, 4, 2));
    for (const PunctualLight& light : scene.lights) expect_near(light.direction, {0, -1, 0});
    EXPECT_EQ(scene.lights[1].range, 12.0f);
    EXPECT_FLOAT_EQ(scene.lights[1].inner_cone, 0.2f);
    EXPECT_FLOAT_EQ(scene.lights[1].outer_cone, 0.6f);
    expect_near(scene.lights[1].position, {0, 1, 0});
    EXPECT_EQ(scene.lights[2].name, "bulb");
    EXPECT_EQ(scene.lights[2].intensity, glm::vec3(1));
    EXPECT_TRUE(std::isinf(scene.lights[2].range));
    EXPECT_LT(scene.lights[3].inner_cone, scene.lights[3].outer_cone);
    EXPECT_EQ(log.count("cone angles out of order in 1 light"), 1);
    b.root["extensions"]["KHR_lights_punctual"]["lights"][0]["intensity"] = -1;
    expect_error(ErrorCode::bad_file, {"light 0", "intensity"}, [&] { load(b); });
}

/// One triangle with that material.
GltfBuilder file_with_material(const Json& material)
{
    GltfBuilder b;
    b.add("materials", material);
    const int positions = b.add_vec3({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
    b.add_node({{"mesh", b.add_mesh("m", {{"attributes", {{"POSITION", positions}}}, {"material", 0}})}});
    return b;
}

TEST(GltfMaterials, KeepColourEmissionAndSides)
{
    Log log;
    const Scene scene = load(
        file_with_material({{"name", "lamp"},
                            {"doubleSided", true},
                            {"emissiveFactor", {1, 0.5, 0}},
                            {"pbrMetallicRoughness", {{"baseColorFactor", {0.5, 2, -1, 1}}, {"metallicFactor", 0}}},
                            {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 6}}}}}}),
        &log);
    const Material& material = scene.materials.at(0);
    EXPECT_EQ(material.base_color, glm::vec3(0.5f, 1.0f, 0.0f));
    EXPECT_EQ(material.emission, glm::vec3(6, 3, 0));
    EXPECT_TRUE(material.double_sided);
    EXPECT_EQ(log.count("base colour outside [0, 1] in 1 material (lamp): clamped"), 1);
    EXPECT_EQ(log.lines.size(), 2u);  // the other says that there is no camera
    EXPECT_EQ(scene.sky_radiance, glm::vec3(0.0f));
}

TEST(GltfMaterials, WhatTheRenderIgnoresIsSaidInOneLineAKind)
{
    GltfBuilder b;
    for (int i = 0; i < 12; ++i) {
        b.add("materials",
              {{"name", std::string("m").append(std::to_string(i))},
               {"alphaMode", "SOMETIMES"},
               {"normalTexture", {{"index", 0}}},
               {"extensions", {{"KHR_materials_clearcoat", {{"clearcoatNormalTexture", {{"index", 0}}}}}}}});
        const int positions = b.add_vec3({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
        b.add_node({{"mesh", b.add_mesh("mesh", {{"attributes", {{"POSITION", positions}}}, {"material", i}})}});
    }
    b.add("textures", Json::object());
    b.root["extensionsUsed"] = {"KHR_materials_iridescence", "KHR_lights_punctual"};
    Log log;
    load(b, &log);
    for (const char* part :
         {"an alpha mode that glTF does not have", "clearcoat normal textures", "KHR_materials_iridescence",
          "textures without an image", "no texture coordinates for its textures"}) {
        EXPECT_EQ(log.count(part), 1) << part;
    }
    EXPECT_EQ(log.count("in 12 materials (m0, m1, m2, m3, m4, m5, m6, m7 and 4 more)"), 3);
}

TEST(GltfMaterials, PrimitivesWithoutOneShareADefault)
{
    GltfBuilder b;
    b.add_node({{"mesh", b.add_triangle_mesh()}});
    b.add_node({{"mesh", b.add_triangle_mesh()}});
    const Scene scene = load(b);
    ASSERT_EQ(scene.materials.size(), 1u);
    EXPECT_EQ(scene.materials[0].base_color, glm::vec3(1.0f));
    EXPECT_EQ(scene.materials[0].metallic, 1.0f);
    EXPECT_EQ(scene.materials[0].roughness, 1.0f);
    EXPECT_EQ(scene.materials[0].specular, 1.0f);
    b.root["meshes"][0]["primitives"][0]["material"] = 3;
    expect_error(ErrorCode::bad_file, {"material 3"}, [&] { load(b); });
}

double linear(double srgb) { return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4); }

/// A triangle whose base colour texture is the picture in a buffer view.
GltfBuilder file_with_picture(const std::string& picture)
{
    GltfBuilder b =
        file_with_material({{"name", "painted"}, {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
    b.add("textures", {{"source", 0}});
    b.add("images", {{"bufferView", b.add_view(picture)}, {"mimeType", "image/png"}});
    return b;
}

TEST(GltfTextures, EightBitPicturesAreLinearisedFromTheTopRowDown)
{
    const Scene scene = load(file_with_picture(kPicture));
    ASSERT_EQ(scene.materials.at(0).base_color_texture.texture, 0);
    const Texture::Level& level = scene.textures.at(0).levels[0];
    ASSERT_EQ(level.width, 2);
    ASSERT_EQ(level.height, 2);
    const int expected[4][3] = {{255, 0, 0}, {0, 128, 0}, {10, 20, 30}, {200, 100, 50}};
    for (std::size_t i = 0; i < 4; ++i) {
        for (std::size_t c = 0; c < 3; ++c) {
            EXPECT_NEAR(level.texels[i][c], linear(expected[i][c] / 255.0) * 65535.0, 0.5) << i << " " << c;
        }
    }
}

TEST(GltfTextures, DeepGreyAndTransparentPicturesKeepTheirColour)
{
    const Scene grey = load(file_with_picture(kDeepPicture));
    for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_NEAR(grey.textures.at(0).levels[0].texels[0][c], linear(32768.0 / 65535.0) * 65535.0, 0.5);
    }
    const Scene clear = load(file_with_picture(kTransparentPicture));
    const auto& texels = clear.textures.at(0).levels[0].texels;
    for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(texels[0][c], texels[1][c]);  // not multiplied by alpha
    EXPECT_EQ(texels[0][3], 0);
    EXPECT_EQ(texels[1][3], 65535);
    EXPECT_NEAR(texels[0][1], linear(128 / 255.0) * 65535.0, 0.5);
}

TEST(GltfTextures, AreSharedWithASceneThatHasThemOfTheSamePicture)
{
    const TemporaryFolder folder;
    const std::string file = folder / "scene.glb";
    write_bytes(file, file_with_picture(kPicture).glb());
    const Scene first = load_scene(file);
    const Scene again = load_scene(file, {}, {.like = &first}), alone = load_scene(file);
    EXPECT_EQ(again.textures.at(0).levels.begin(), first.textures.at(0).levels.begin());
    EXPECT_NE(alone.textures.at(0).levels.begin(), first.textures.at(0).levels.begin());
    EXPECT_EQ(alone.textures.at(0).levels.hash(), first.textures.at(0).levels.hash());
    write_bytes(file, file_with_picture(kDeepPicture).glb());
    const Scene other = load_scene(file, {}, {.like = &first}), decoded = load_scene(file);
    EXPECT_NE(other.textures.at(0).levels.begin(), first.textures.at(0).levels.begin()) << "by the name alone";
    EXPECT_EQ(other.textures.at(0).levels.hash(), decoded.textures.at(0).levels.hash());
}

TEST(GltfTextures, PicturesMayLieBesideTheSceneAndAreReadOnce)
{
    const TemporaryFolder folder;
    GltfBuilder b = file_with_picture(kPicture);
    b.root["images"] = Json::array({{{"uri", "wall%20paper+1.png"}}});
    b.add("textures", {{"source", 0}});
    b.add("materials", {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 1}}}}}});
    b.root["meshes"][0]["primitives"].push_back({{"attributes", {{"POSITION", 0}}}, {"material", 1}});
    write_bytes(folder / "scene.glb", b.glb());
    write_bytes(folder / "wall paper+1.png", kPicture);
    const Scene scene = load_scene(folder / "scene.glb");
    EXPECT_EQ(scene.textures.size(), 1u);
    EXPECT_EQ(scene.materials.at(1).base_color_texture.texture, 0);
    std::filesystem::remove(folder / "wall paper+1.png");
    expect_error(ErrorCode::not_found, {"wall"}, [&] { load_scene(folder / "scene.glb"); });
}

TEST(GltfTextures, DamagedPicturesAreErrorsThatNameThem)
{
    std::string damaged = kPicture;  // not cut short: OpenImageIO 2.4 leaks its message about that
    damaged[50] = '\x55';
    expect_error(ErrorCode::bad_file, {"test.glb", "image 0"}, [&] { load(file_with_picture(damaged)); });
    expect_error(ErrorCode::unsupported, {"image 0", "PNG"}, [] { load(file_with_picture("no picture at all")); });
    std::string huge = kPicture;
    huge[16] = '\x7f';  // the width's highest byte
    expect_error(ErrorCode::bad_file, {"image 0"}, [&] { load(file_with_picture(huge)); });
}

}  // namespace
}  // namespace rcs::test
