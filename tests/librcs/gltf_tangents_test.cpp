#include "scene/gltf_tangents.h"

#include <cmath>
#include <fstream>
#include <vector>

#include <gtest/gtest.h>

#include "scene/mikktspace.h"
#include "support/gltf_builder.h"
#include "support/pictures.h"

namespace rcs::test {
namespace {

constexpr glm::mat3x2 kPlain{1.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f};

/// A unit square in the plane z = 0, seen from +z, with the image upright on it (v points down).
Mesh square()
{
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    mesh.normals.assign(4, {0, 0, 1});
    mesh.uvs = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
}

/// Orthonormal with the normal, w = 1 or -1, at every vertex.
void expect_frames(const Mesh& mesh)
{
    ASSERT_EQ(mesh.tangents.size(), mesh.positions.size());
    for (std::size_t i = 0; i < mesh.tangents.size(); ++i) {
        const glm::vec3 tangent(mesh.tangents[i]);
        EXPECT_NEAR(glm::length(tangent), 1.0f, 1e-6f);
        EXPECT_NEAR(glm::dot(tangent, mesh.normals.at(i)), 0.0f, 1e-6f);
        EXPECT_EQ(std::fabs(mesh.tangents[i].w), 1.0f);
    }
}

TEST(Tangents, PointAlongUAndTheBitangentUpInTheImage)
{
    Mesh mesh = square();
    make_tangents(mesh, 0, kPlain);
    expect_frames(mesh);
    for (const glm::vec4& t : mesh.tangents) EXPECT_EQ(t, glm::vec4(1, 0, 0, 1));  // cross((0,0,1), t) w = +y
    for (glm::vec2& uv : mesh.uvs) uv.x = 1.0f - uv.x;  // mirrored: u to the left, up is still up
    mesh.tangents.clear();
    make_tangents(mesh, 0, kPlain);
    for (const glm::vec4& t : mesh.tangents) EXPECT_EQ(t, glm::vec4(-1, 0, 0, -1));
}

TEST(Tangents, FollowTheTextureTransformAndTheSecondSet)
{
    Mesh mesh = square();
    mesh.uvs1 = mesh.uvs;
    mesh.uvs.clear();
    make_tangents(mesh, 1, {0.0f, 1.0f, -1.0f, 0.0f, 0.0f, 0.0f});  // u' = -v, v' = u
    expect_frames(mesh);
    // u' grows with -v, which is up; v' grows with u, so that the image's up is -x.
    for (const glm::vec4& t : mesh.tangents) {
        EXPECT_LT(glm::distance(glm::vec3(t), glm::vec3(0, 1, 0)), 1e-6f);
        EXPECT_EQ(t.w, 1.0f);
    }
}

TEST(Tangents, AVertexBetweenMirroredHalvesIsSplit)
{
    Mesh mesh;
    mesh.positions = {{-1, 0, 0}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.normals.assign(4, {0, 0, 1});
    mesh.uvs = {{1, 1}, {0, 1}, {1, 1}, {0, 0}};
    mesh.triangles = {{0, 1, 3}, {1, 2, 3}};
    mesh.colors.assign(4, glm::vec4(0.5f));
    make_tangents(mesh, 0, kPlain);
    expect_frames(mesh);
    EXPECT_EQ(mesh.positions.size(), 6u);
    EXPECT_EQ(mesh.colors.size(), 6u);
    EXPECT_EQ(mesh.uvs.size(), 6u);
    for (int k = 0; k < 3; ++k) {
        EXPECT_EQ(mesh.tangents[mesh.triangles[0][k]], glm::vec4(-1, 0, 0, -1));
        EXPECT_EQ(mesh.tangents[mesh.triangles[1][k]], glm::vec4(1, 0, 0, 1));
    }
}

TEST(Tangents, FlatMeshesGetTheirFacesNormals)
{
    Mesh mesh = square();
    mesh.positions[3].z = 1.0f;  // the second triangle is tilted
    mesh.normals.clear();
    make_tangents(mesh, 0, kPlain);
    EXPECT_EQ(mesh.positions.size(), 6u);
    EXPECT_EQ(mesh.normals.at(0), glm::vec3(0, 0, 1));
    EXPECT_NEAR(mesh.normals.at(3).z, std::sqrt(1.0f / 3.0f), 1e-6f);  // of (0,0,0) (1,1,0) (0,1,1)
    expect_frames(mesh);
}

TEST(Tangents, DegenerateMappingsStillGiveFrames)
{
    Mesh mesh = square();
    mesh.uvs.assign(4, {0.5f, 0.5f});
    make_tangents(mesh, 0, kPlain);
    expect_frames(mesh);
}

/// What Blender 3.4 makes of a ball with a seam and of a cube whose halves share a mirrored picture, two triangles of
/// which have none (tests/blender/make_tangents.py); 4.5 and 5.0 make the same.
TEST(Tangents, AreBlendersOwn)
{
    std::ifstream file(RCS_TESTS_DIR "/librcs/blender_tangents.json");
    const Json meshes = Json::parse(file);
    ASSERT_EQ(meshes.size(), 2u);
    int undecided = 0;  // corners where nothing says where a tangent points
    for (const auto& [name, corners] : meshes.items()) {
        Mesh mesh;
        std::vector<glm::vec4> expected;
        for (const Json& c : corners) {
            const auto at = [&](std::size_t i) { return c.at(i).get<float>(); };
            mesh.positions.emplace_back(at(0), at(1), at(2));
            mesh.normals.emplace_back(at(3), at(4), at(5));
            mesh.uvs.emplace_back(at(6), at(7));
            expected.emplace_back(at(8), at(9), at(10), at(11));
        }
        for (std::uint32_t i = 0; i + 2 < mesh.positions.size(); i += 3) mesh.triangles.push_back({i, i + 1, i + 2});
        const std::vector<glm::vec4> made = mikktspace(mesh, mesh.uvs);
        ASSERT_EQ(made.size(), expected.size());
        for (std::size_t i = 0; i < made.size(); ++i) {
            undecided += glm::vec3(made[i]) == glm::vec3(0.0f);
            if (glm::vec3(made[i]) == glm::vec3(0.0f)) continue;
            EXPECT_LT(glm::distance(glm::vec3(made[i]), glm::vec3(expected[i])), 1e-4f) << name << ", corner " << i;
            EXPECT_EQ(made[i].w, expected[i].w) << name << ", corner " << i;
        }
    }
    EXPECT_EQ(undecided, 6) << "the two triangles without a picture";
}

TEST(Tangents, OneVertexHasAsManyAsItsTrianglesWant)
{
    // Two triangles that meet in a vertex alone: no edge joins them, and each keeps its own.
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {-1, 0, 0}, {-1, -1, 0}};
    mesh.normals.assign(5, {0, 0, 1});
    mesh.uvs = {{0, 0}, {1, 0}, {1, -1}, {0, 1}, {1, 1}};
    mesh.triangles = {{0, 1, 2}, {0, 3, 4}};
    make_tangents(mesh, 0, kPlain);
    expect_frames(mesh);
    EXPECT_EQ(mesh.positions.size(), 6u);
    for (int k = 0; k < 3; ++k) {
        EXPECT_EQ(mesh.tangents[mesh.triangles[0][k]], glm::vec4(1, 0, 0, 1));
        EXPECT_EQ(mesh.tangents[mesh.triangles[1][k]], glm::vec4(0, -1, 0, 1));
    }
}

/// A quad with a normal texture. @param attributes  more of them
GltfBuilder bumpy_quad(const std::function<void(GltfBuilder&, Json& attributes)>& change)
{
    GltfBuilder b;
    const Mesh mesh = square();
    Json attributes = {{"POSITION", b.add_vec3(mesh.positions)},
                       {"NORMAL", b.add_vec3(mesh.normals)},
                       {"TEXCOORD_0", b.add_vec2(mesh.uvs)}};
    change(b, attributes);
    b.add("materials", {{"normalTexture", {{"index", 0}}}});
    b.add("textures", {{"source", 0}});
    b.add("images", {{"bufferView", b.add_view(kPicture)}, {"mimeType", "image/png"}});
    b.add_node({{"mesh", b.add_mesh("quad", {{"attributes", attributes}, {"mode", kTriangleFan}, {"material", 0}})}});
    return b;
}

TEST(Tangents, OfTheFileAreKeptMadeOrthogonalAndUnit)
{
    const Scene scene = load(bumpy_quad([](GltfBuilder& b, Json& attributes) {
        attributes["TANGENT"] =
            b.add_accessor(b.add_view(raw(std::vector<glm::vec4>(4, {0, 3, 1, -1}))), kFloat, "VEC4", 4);
    }));
    for (const glm::vec4& t : scene.meshes.at(0).tangents) EXPECT_EQ(t, glm::vec4(0, 1, 0, -1));
}

TEST(Tangents, AreMadeForNormalTexturesAlone)
{
    GltfBuilder b = bumpy_quad([](GltfBuilder&, Json&) {});
    EXPECT_EQ(load(b).meshes.at(0).tangents.at(2), glm::vec4(1, 0, 0, 1));
    b.root["materials"][0] = Json::object();
    EXPECT_TRUE(load(b).meshes.at(0).tangents.empty());
}

}  // namespace
}  // namespace rcs::test
