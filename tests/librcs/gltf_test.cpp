#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "rcs/error.h"
#include "rcs/scene.h"
#include "support/gltf_builder.h"

// Geometry and damage: what a file may hold, and what must not bring the loader down.

namespace rcs::test {
namespace {

const std::vector<glm::vec3> kQuad = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};

/// The corner positions of every triangle of the scene's only mesh.
std::vector<glm::vec3> corners(const Scene& scene)
{
    std::vector<glm::vec3> result;
    const Mesh& mesh = scene.meshes.at(0);
    for (const glm::uvec3 t : mesh.triangles) {
        for (int i = 0; i < 3; ++i) result.push_back(mesh.positions.at(t[i]));
    }
    return result;
}

std::vector<glm::vec3> corners_of(const std::vector<int>& order)
{
    std::vector<glm::vec3> result;
    for (const int i : order) result.push_back(kQuad[static_cast<std::size_t>(i)]);
    return result;
}

GltfBuilder quad_file(const std::function<void(GltfBuilder&, Json& primitive)>& change)
{
    GltfBuilder b;
    Json primitive = {{"attributes", {{"POSITION", b.add_vec3(kQuad)}}}};
    change(b, primitive);
    b.add_node({{"mesh", b.add_mesh("quad", primitive)}});
    return b;
}

template <class T>
Scene indexed_quad()
{
    return load(quad_file([](GltfBuilder& b, Json& p) { p["indices"] = b.add_indices<T>({0, 1, 2, 0, 2, 3}); }));
}

TEST(GltfGeometry, EveryIndexTypeGivesTheSameTriangles)
{
    const std::vector<glm::vec3> expected = corners_of({0, 1, 2, 0, 2, 3});
    EXPECT_EQ(corners(indexed_quad<std::uint8_t>()), expected);
    EXPECT_EQ(corners(indexed_quad<std::uint16_t>()), expected);
    EXPECT_EQ(corners(indexed_quad<std::uint32_t>()), expected);
    GltfBuilder b;  // none at all: vertices in order
    b.add_node({{"mesh", b.add_mesh("quad", {{"attributes", {{"POSITION", b.add_vec3(expected)}}}})}});
    EXPECT_EQ(corners(load(b)), expected);
}

TEST(GltfGeometry, StripsAndFansKeepTheirWinding)
{
    const auto strip = load(quad_file([](GltfBuilder& b, Json& p) {
        p["mode"] = kTriangleStrip;
        p["indices"] = b.add_indices<std::uint16_t>({0, 1, 3, 2});
    }));
    EXPECT_EQ(corners(strip), corners_of({0, 1, 3, 1, 2, 3}));
    const auto fan = load(quad_file([](GltfBuilder&, Json& p) { p["mode"] = kTriangleFan; }));
    EXPECT_EQ(corners(fan), corners_of({1, 2, 0, 2, 3, 0}));
}

TEST(GltfGeometry, InterleavedVerticesEqualSeparateOnes)
{
    const auto scene = load(quad_file([](GltfBuilder& b, Json& p) {
        std::vector<float> mixed;  // position, normal, uv: 32 bytes a vertex
        for (const glm::vec3& v : kQuad) mixed.insert(mixed.end(), {v.x, v.y, v.z, 0, 0, 2, v.x, 1 - v.y});
        const int view = b.add_view(raw(mixed), 32);
        p["attributes"] = {{"POSITION", b.add_accessor(view, kFloat, "VEC3", 4, 0)},
                           {"NORMAL", b.add_accessor(view, kFloat, "VEC3", 4, 12)},
                           {"TEXCOORD_0", b.add_accessor(view, kFloat, "VEC2", 4, 24)}};
        p["mode"] = kTriangleFan;
    }));
    const Mesh& mesh = scene.meshes.at(0);
    EXPECT_EQ(mesh.positions, kQuad);
    ASSERT_EQ(mesh.normals.size(), 4u);
    ASSERT_EQ(mesh.uvs.size(), 4u);
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_EQ(mesh.normals[i], glm::vec3(0, 0, 1));  // made unit
        EXPECT_EQ(mesh.uvs[i], glm::vec2(kQuad[i].x, 1 - kQuad[i].y));
    }
}

TEST(GltfGeometry, TextureCoordinatesMayBeNormalizedIntegers)
{
    const auto with = [](int type, const std::string& bytes, std::size_t stride) {
        return load(quad_file([&](GltfBuilder& b, Json& p) {
            const int accessor = b.add_accessor(b.add_view(bytes, stride), type, "VEC2", 4);
            b.root["accessors"][static_cast<std::size_t>(accessor)]["normalized"] = true;
            p["attributes"]["TEXCOORD_0"] = accessor;
            p["mode"] = kTriangleFan;
        }));
    };
    const auto bytes =
        with(kUnsignedByte, raw<std::uint8_t>({0, 255, 9, 9, 51, 0, 9, 9, 255, 255, 9, 9, 0, 0, 9, 9}), 4);
    EXPECT_EQ(bytes.meshes.at(0).uvs.at(0), glm::vec2(0, 1));
    EXPECT_FLOAT_EQ(bytes.meshes.at(0).uvs.at(1).x, 51.0f / 255.0f);
    const auto shorts = with(kUnsignedShort, raw<std::uint16_t>({0, 65535, 13107, 0, 65535, 65535, 0, 0}), 0);
    EXPECT_EQ(shorts.meshes.at(0).uvs.at(0), glm::vec2(0, 1));
    EXPECT_FLOAT_EQ(shorts.meshes.at(0).uvs.at(1).x, 0.2f);
}

TEST(GltfGeometry, SparseAccessorsReplaceSingleElements)
{
    const auto scene = load(quad_file([](GltfBuilder& b, Json& p) {
        const int indices = b.add_view(raw<std::uint8_t>({2}));
        const int values = b.add_view(raw<glm::vec3>({{5, 6, 7}}));
        b.root["accessors"][0]["sparse"] = {{"count", 1},
                                            {"indices", {{"bufferView", indices}, {"componentType", kUnsignedByte}}},
                                            {"values", {{"bufferView", values}}}};
        p["mode"] = kTriangleFan;
    }));
    EXPECT_EQ(scene.meshes.at(0).positions, (std::vector<glm::vec3>{kQuad[0], kQuad[1], {5, 6, 7}, kQuad[3]}));
}

TEST(GltfGeometry, ElementsOfNoViewAreZeros)
{
    // A file without any buffer: three corners in one place.
    GltfBuilder b;
    const int corners = b.add("accessors", {{"componentType", kFloat}, {"type", "VEC3"}, {"count", 3}});
    b.add_node({{"mesh", b.add_mesh("point", {{"attributes", {{"POSITION", corners}}}})}});
    Log log;
    load(b, &log);
    EXPECT_EQ(log.count("triangles without area"), 1);
}

TEST(GltfGeometry, PointsAreLeftOutWithAWarning)
{
    Log log;
    const Scene scene = load(quad_file([](GltfBuilder&, Json& p) { p["mode"] = kPoints; }), &log);
    EXPECT_TRUE(scene.meshes.empty());
    EXPECT_TRUE(scene.instances.empty());
    EXPECT_EQ(log.count("points or lines in 1 mesh (quad)"), 1);
}

TEST(GltfFiles, InWhichNothingCanBeDrawnAreNamed)
{
    const auto warnings = [](const GltfBuilder& b) {
        Log log;
        load(b, &log);
        return log.count("test.glb: has nothing that can be drawn");
    };
    EXPECT_EQ(warnings(quad_file([](GltfBuilder&, Json& p) { p["mode"] = kPoints; })), 1);
    EXPECT_EQ(warnings(quad_file([](GltfBuilder& b, Json&) { b.root["scenes"] = Json::array({Json::object()}); })), 1);
    EXPECT_EQ(warnings(GltfBuilder()), 1);
    EXPECT_EQ(warnings(quad_file([](GltfBuilder&, Json&) {})), 0);
}

TEST(GltfGeometry, TrianglesWithoutAreaAreDroppedAndCounted)
{
    Log log;
    const auto scene =
        load(quad_file([](GltfBuilder& b, Json& p) {
                 // Equal corners; corners on a line (also one that rounding bends a little).
                 p["attributes"]["POSITION"] = b.add_vec3(
                     {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0.1f, 0.1f, 0.1f}, {0.2f, 0.2f, 0.2f}, {0.7f, 0.7f, 0.7f}});
                 p["indices"] = b.add_indices<std::uint16_t>({0, 1, 2, 0, 0, 1, 3, 4, 5});
             }),
             &log);
    EXPECT_EQ(scene.meshes.at(0).triangles.size(), 1u);
    EXPECT_EQ(log.count("2 triangles without area in 1 mesh (quad): dropped"), 1);
}

TEST(GltfGeometry, MissingNormalsMeanFlatShading)
{
    EXPECT_TRUE(indexed_quad<std::uint8_t>().meshes.at(0).normals.empty());
}

TEST(GltfGeometry, DamagedNormalsAreReplacedByTheFaces)
{
    Log log;
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const auto scene = load(quad_file([&](GltfBuilder& b, Json& p) {
                                p["attributes"]["NORMAL"] = b.add_vec3({{0, 0, 0}, {nan, 0, 0}, {0, 1, 0}, {0, 0, 3}});
                                p["mode"] = kTriangleFan;
                            }),
                            &log);
    const std::vector<glm::vec3> expected = {{0, 0, 1}, {0, 0, 1}, {0, 1, 0}, {0, 0, 1}};
    EXPECT_EQ(scene.meshes.at(0).normals, expected);
    EXPECT_EQ(log.count("2 normals that are zero or not finite in 1 mesh (quad)"), 1);
}

TEST(GltfDamage, ACoordinateThatIsNoNumberIsNamed)
{
    for (const float value :
         {std::numeric_limits<float>::quiet_NaN(), -std::numeric_limits<float>::infinity(), 1e38f}) {
        const GltfBuilder b = quad_file([&](GltfBuilder& file, Json& p) {
            p["attributes"]["POSITION"] = file.add_vec3({{0, 0, 0}, {1, value, 0}, {1, 1, 0}});
        });
        expect_error(ErrorCode::bad_file, {"test.glb", "mesh 0 'quad'", "primitive 0", "accessor 1", "vertex 1"},
                     [&] { load(b); });
    }
}

TEST(GltfDamage, AnIndexBeyondTheVerticesIsAnError)
{
    expect_error(ErrorCode::bad_file, {"vertex 4", "mesh 0 'quad'"}, [] {
        load(quad_file([](GltfBuilder& b, Json& p) { p["indices"] = b.add_indices<std::uint8_t>({0, 1, 4}); }));
    });
}

TEST(GltfDamage, AccessorsThatReachOutsideTheirViewAreRefusedBeforeAnythingIsAllocated)
{
    const auto with = [](const char* key, const Json& value) {
        return quad_file([&](GltfBuilder& b, Json&) { b.root["accessors"][0][key] = value; });
    };
    const std::vector<Json> counts = {5, 4000000000u, std::numeric_limits<std::uint64_t>::max()};
    for (const Json& count : counts) {
        expect_error(ErrorCode::bad_file, {"test.glb"}, [&] { load(with("count", count)); });
    }
    const std::vector<Json> offsets = {4, 48, std::numeric_limits<std::uint64_t>::max() - 3};
    for (const Json& offset : offsets) {
        expect_error(ErrorCode::bad_file, {"outside its buffer view"}, [&] { load(with("byteOffset", offset)); });
    }
    expect_error(ErrorCode::bad_file, {"accessor"}, [&] { load(with("bufferView", 7)); });
    expect_error(ErrorCode::bad_file, {"component type"}, [&] { load(with("componentType", 5124)); });
    expect_error(ErrorCode::bad_file, {"VEC3"}, [&] { load(with("type", "VEC2")); });
}

TEST(GltfDamage, BufferViewsThatReachOutsideTheirBufferAreRefused)
{
    const std::vector<std::pair<const char*, Json>> damages = {
        {"byteLength", std::numeric_limits<std::uint64_t>::max()},
        {"byteOffset", 1000},
        {"byteOffset", -4},
        {"buffer", 1},
        {"buffer", -1},
        {"byteLength", 0}};
    for (const auto& [key, value] : damages) {
        const GltfBuilder b =
            quad_file([&, k = key, v = value](GltfBuilder& file, Json&) { file.root["bufferViews"][0][k] = v; });
        expect_error(ErrorCode::bad_file, {"buffer view 0"}, [&] { load(b); });
    }
}

TEST(GltfDamage, EveryTruncatedFileIsACleanError)
{
    const std::string whole =
        quad_file([](GltfBuilder& b, Json& p) { p["indices"] = b.add_indices<std::uint8_t>({0, 1, 2}); }).glb();
    for (std::size_t size = 0; size < whole.size(); ++size) {
        EXPECT_THROW(load(whole.substr(0, size)), Error) << "first " << size << " bytes";
    }
    EXPECT_NO_THROW(load(whole));
}

/// Loads or throws Error: anything else (a crash, another exception) fails the test.
void try_loading(const std::string& bytes)
{
    try {
        load(bytes);
    } catch (const Error&) {
    }
}

/// Overwrites a few bytes at random places, `rounds` times from the start.
void damage_at_random(const std::string& whole, int rounds, unsigned seed)
{
    std::mt19937 random(seed);
    for (int round = 0; round < rounds; ++round) {
        std::string bytes = whole;
        for (unsigned i = 0; i < 1 + random() % 4; ++i) bytes[random() % bytes.size()] = static_cast<char>(random());
        try_loading(bytes);
    }
}

TEST(GltfDamage, RandomlyDamagedFilesLoadOrThrow)
{
    GltfBuilder b = quad_file([](GltfBuilder& file, Json& p) {
        p["indices"] = file.add_indices<std::uint8_t>({0, 1, 2, 0, 2, 3});
        p["attributes"]["NORMAL"] = file.add_vec3(kQuad);
        p["material"] = 0;
    });
    b.add("materials", {{"pbrMetallicRoughness", {{"baseColorFactor", {1, 0.5, 0.25, 1}}}}});
    b.add_node({{"camera", 0}, {"translation", {0, 0, 5}}, {"children", {0}}});
    b.add("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 0.1}}}});
    damage_at_random(b.glb(), 1500, 1);
}

TEST(GltfDamage, RandomlyDamagedDracoFilesLoadOrThrow)
{
    const std::string path = RCS_SCENES_DIR "/cornell-box-draco.glb";
    if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is missing";
    damage_at_random(bytes_of(path), 200, 2);
}

TEST(GltfDamage, DracoAttributesThatTheDataLackAreRefused)
{
    const std::string path = RCS_SCENES_DIR "/cornell-box-draco.glb";
    if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is missing";
    std::string bytes = bytes_of(path);
    const std::size_t at = bytes.find("\"POSITION\":", bytes.find("KHR_draco_mesh_compression\":{"));
    ASSERT_NE(at, std::string::npos);
    bytes[bytes.find_first_of("0123456789", at)] = '9';
    expect_error(ErrorCode::bad_file, {"Draco", "attribute 9"}, [&] { load(bytes); });
}

TEST(GltfDamage, JsonThatIsNoGltfIsAnErrorThatNamesTheFile)
{
    expect_error(ErrorCode::bad_file, {"test.glb", "JSON breaks off"}, [] { load("{"); });
    for (const char* text : {"", "[]", "12", "{\"a\": 1}", "{\"asset\": {\"version\": 2}}", "not json", "\0\0"}) {
        expect_error(ErrorCode::bad_file, {"test.glb", "glTF"}, [&] { load(std::string(text)); });
    }
    expect_error(ErrorCode::unsupported, {"version '1.0'"}, [] { load("{\"asset\": {\"version\": \"1.0\"}}"); });
    const std::string deep =
        "{\"asset\": {\"version\": \"2.0\"}, \"extras\": " + std::string(100000, '[') + std::string(100000, ']') + "}";
    expect_error(ErrorCode::bad_file, {"deeper"}, [&] { load(deep); });
}

TEST(GltfDamage, RequiredExtensionsThatAreMissingAreNamed)
{
    GltfBuilder b;
    b.root["extensionsRequired"] = {"KHR_lights_punctual", "KHR_texture_basisu", "EXT_meshopt_compression", "MY_own"};
    expect_error(ErrorCode::unsupported, {"KHR_texture_basisu, MY_own"}, [&] { load(b); });
}

TEST(GltfFiles, MissingFilesAndFoldersAreErrors)
{
    expect_error(ErrorCode::not_found, {"scene file 'nowhere/x.glb' does not exist"},
                 [] { load_scene("nowhere/x.glb"); });
    expect_error(ErrorCode::bad_file, {"folder"}, [] { load_scene(std::filesystem::temp_directory_path().string()); });
}

TEST(GltfFiles, BuffersMayLieBesideTheScene)
{
    const TemporaryFolder folder;
    std::filesystem::create_directory(folder / "data");
    GltfBuilder b;
    b.add_node({{"mesh", b.add_triangle_mesh()}});
    write_bytes(folder / "data/my buffer.bin", b.binary);
    write_bytes(folder / "scene.gltf", b.gltf("data/my%20buffer.bin"));
    EXPECT_EQ(load_scene(folder / "scene.gltf").meshes.size(), 1u);
    write_bytes(folder / "scene.gltf", b.gltf("data/other.bin"));
    expect_error(ErrorCode::not_found, {"buffer 0", "other.bin"}, [&] { load_scene(folder / "scene.gltf"); });
}

TEST(GltfFiles, BuffersMayBeEmbeddedAsText)
{
    GltfBuilder b;
    b.add_node(
        {{"mesh", b.add_mesh("m", {{"attributes", {{"POSITION", b.add_vec3({{0, 0, 0}, {0, 0, 0}, {0, 0, 0}})}}}})}});
    // 36 zero bytes: three corners in one place, a triangle without area.
    const Scene scene = load(b.gltf("data:application/octet-stream;base64," + std::string(48, 'A')));
    EXPECT_TRUE(scene.meshes.empty());
}

TEST(GltfFiles, NothingOutsideTheScenesFolderIsRead)
{
    const TemporaryFolder folder;
    std::filesystem::create_directory(folder / "inside");
    GltfBuilder b;
    b.add_node({{"mesh", b.add_triangle_mesh()}});
    write_bytes(folder / "secret.bin", b.binary);
    const std::string path = folder / "inside/scene.gltf";
    const std::string absolute = folder / "secret.bin";
    for (const std::string& uri :
         {std::string("../secret.bin"), std::string("a/../../secret.bin"), absolute, std::string("%2e%2e/secret.bin"),
          "file://" + absolute, std::string("https://example.org/secret.bin"), std::string("..\\secret.bin")}) {
        write_bytes(path, b.gltf(uri));
        expect_error(ErrorCode::bad_file, {"inside the scene's folder"}, [&] { load_scene(path); });
        Json document = b.root;
        document.erase("bufferViews");
        document.erase("accessors");
        document.erase("meshes");
        document.erase("nodes");
        document["images"] = Json::array({{{"uri", uri}}});
        write_bytes(path, document.dump());
        EXPECT_NO_THROW(load_scene(path));  // an image that nothing uses is not read at all
    }
}

}  // namespace
}  // namespace rcs::test
