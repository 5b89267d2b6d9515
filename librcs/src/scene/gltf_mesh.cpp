#include "scene/gltf_mesh.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "scene/gltf_accessor.h"

namespace rcs {
namespace {

constexpr GltfNoteKind kLines{"points or lines", "mesh", "left out"};
constexpr GltfNoteKind kNoPositions{"primitives without positions", "mesh", "left out"};
constexpr GltfNoteKind kLeftOver{"indices that make no whole triangle", "mesh", "left out"};
constexpr GltfNoteKind kFlat{"triangles without area", "mesh", "dropped"};
constexpr GltfNoteKind kBadNormals{"normals that are zero or not finite", "mesh", "replaced by the faces' own"};
constexpr GltfNoteKind kBadUvs{"texture coordinates that are not finite", "mesh", "set to 0"};
constexpr GltfNoteKind kVertexColors{"vertex colours", "mesh", "ignored"};
constexpr GltfNoteKind kMorph{"morph targets", "mesh", "ignored"};

/// Beyond this, squares of lengths leave the range of float (1e38).
constexpr float kMaxCoordinate = 1e18f;

struct Context {
    const GltfFile& file;
    const tinygltf::Model& model;
    const tinygltf::Primitive& primitive;
    std::string what;  ///< "mesh 0 'floor', primitive 1"
    std::string name;  ///< of the mesh, for notes
};

std::vector<glm::vec3> read_positions(const Context& context, int accessor)
{
    const std::string what = context.what + ", POSITION";
    std::vector<glm::vec3> positions = read_vec3(context.file, context.model, accessor, what);
    for (std::size_t i = 0; i < positions.size(); ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            // Written so that NaN fails, too.
            if (!(std::fabs(positions[i][axis]) <= kMaxCoordinate)) {
                bad_file(context.file, what + " (accessor " + std::to_string(accessor) + "): vertex " +
                                           std::to_string(i) + " has the coordinate " +
                                           std::to_string(positions[i][axis]) +
                                           ", expected a number within 1e18 of zero");
            }
        }
    }
    return positions;
}

std::vector<std::uint32_t> read_vertex_order(const Context& context, std::size_t vertices)
{
    std::vector<std::uint32_t> order;
    if (context.primitive.indices < 0) {
        order.resize(vertices);
        std::iota(order.begin(), order.end(), 0u);
        return order;
    }
    const std::string what = context.what + ", indices";
    order = read_indices(context.file, context.model, context.primitive.indices, what);
    const auto outside = std::find_if(order.begin(), order.end(), [&](std::uint32_t i) { return i >= vertices; });
    if (outside != order.end()) {
        bad_file(context.file, what + " (accessor " + std::to_string(context.primitive.indices) +
                                   ") name vertex " + std::to_string(*outside) + ", the primitive has " +
                                   std::to_string(vertices));
    }
    return order;
}

/// glTF 2.0, section 3.7.2.1.
std::vector<glm::uvec3> triangles_of(const Context& context, const std::vector<std::uint32_t>& order)
{
    const int mode = context.primitive.mode;
    const std::size_t n = order.size();
    std::vector<glm::uvec3> triangles;
    if (mode == TINYGLTF_MODE_TRIANGLES) {
        triangles.reserve(n / 3);
        for (std::size_t i = 0; i + 3 <= n; i += 3) triangles.emplace_back(order[i], order[i + 1], order[i + 2]);
        if (n % 3 != 0) context.file.notes->add(kLeftOver, context.name, n % 3);
        return triangles;
    }
    for (std::size_t i = 0; i + 3 <= n; ++i) {
        if (mode == TINYGLTF_MODE_TRIANGLE_FAN) {
            triangles.emplace_back(order[i + 1], order[i + 2], order[0]);
        } else {
            triangles.emplace_back(order[i], order[i + 1 + i % 2], order[i + 2 - i % 2]);
        }
    }
    return triangles;
}

/// Twice the area times the normal.
glm::dvec3 area_vector(const std::vector<glm::vec3>& positions, glm::uvec3 triangle)
{
    const glm::dvec3 a = positions[triangle[0]];
    return glm::cross(glm::dvec3(positions[triangle[1]]) - a, glm::dvec3(positions[triangle[2]]) - a);
}

bool has_area(const std::vector<glm::vec3>& positions, glm::uvec3 triangle)
{
    // A triangle less high than the rounding of its longest side has a normal made of rounding errors.
    constexpr double kFloatRounding = 0x1p-23;
    double longest = 0.0;
    for (int i = 0; i < 3; ++i) {
        const glm::dvec3 edge = glm::dvec3(positions[triangle[(i + 1) % 3]]) - glm::dvec3(positions[triangle[i]]);
        longest = std::max(longest, glm::dot(edge, edge));
    }
    return glm::length(area_vector(positions, triangle)) > kFloatRounding * longest;
}

void drop_flat_triangles(const Context& context, Mesh& mesh)
{
    const std::size_t before = mesh.triangles.size();
    std::erase_if(mesh.triangles, [&](glm::uvec3 triangle) { return !has_area(mesh.positions, triangle); });
    if (mesh.triangles.size() < before) {
        context.file.notes->add(kFlat, context.name, before - mesh.triangles.size());
    }
}

/// Mean of the adjacent faces' normals, weighted by area.
std::vector<glm::dvec3> face_normal_sums(const Mesh& mesh)
{
    std::vector<glm::dvec3> sums(mesh.positions.size(), glm::dvec3(0.0));
    for (const glm::uvec3 triangle : mesh.triangles) {
        const glm::dvec3 normal = area_vector(mesh.positions, triangle);
        for (int i = 0; i < 3; ++i) sums[triangle[i]] += normal;
    }
    return sums;
}

bool is_usable(glm::dvec3 vector)
{
    const double square = glm::dot(vector, vector);
    return std::isfinite(square) && square > 0.0;
}

void read_normals(const Context& context, Mesh& mesh, int accessor)
{
    const std::string what = context.what + ", NORMAL";
    mesh.normals = read_vec3(context.file, context.model, accessor, what);
    if (mesh.normals.size() != mesh.positions.size()) {
        bad_file(context.file, what + " has " + std::to_string(mesh.normals.size()) + " elements, POSITION has " +
                                   std::to_string(mesh.positions.size()));
    }
    std::vector<glm::dvec3> sums;
    std::size_t replaced = 0;
    for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
        glm::dvec3 normal = mesh.normals[i];
        if (!is_usable(normal)) {
            if (sums.empty()) sums = face_normal_sums(mesh);
            // A vertex of no face, or of faces that cancel, takes any direction.
            normal = is_usable(sums[i]) ? sums[i] : glm::dvec3(0.0, 1.0, 0.0);
            ++replaced;
        }
        mesh.normals[i] = glm::vec3(glm::normalize(normal));
    }
    if (replaced > 0) context.file.notes->add(kBadNormals, context.name, replaced);
}

void read_uvs(const Context& context, Mesh& mesh, int accessor, const std::string& attribute)
{
    const std::string what = context.what + ", " + attribute;
    mesh.uvs = read_vec2(context.file, context.model, accessor, what);
    if (mesh.uvs.size() != mesh.positions.size()) {
        bad_file(context.file, what + " has " + std::to_string(mesh.uvs.size()) + " elements, POSITION has " +
                                   std::to_string(mesh.positions.size()));
    }
    std::size_t replaced = 0;
    for (glm::vec2& uv : mesh.uvs) {
        if (std::isfinite(uv.x) && std::isfinite(uv.y)) continue;
        uv = glm::vec2(0.0f);
        ++replaced;
    }
    if (replaced > 0) context.file.notes->add(kBadUvs, context.name, replaced);
}

/// The texture coordinates that the material's base colour texture asks for.
std::string uv_attribute(const Context& context)
{
    const int material = context.primitive.material;
    if (material < 0 || static_cast<std::size_t>(material) >= context.model.materials.size()) return "TEXCOORD_0";
    const auto& base = context.model.materials[static_cast<std::size_t>(material)].pbrMetallicRoughness;
    return "TEXCOORD_" + std::to_string(std::max(0, base.baseColorTexture.texCoord));
}

int attribute(const tinygltf::Primitive& primitive, const std::string& name)
{
    const auto found = primitive.attributes.find(name);
    return found == primitive.attributes.end() ? -1 : found->second;
}

}  // namespace

std::optional<Mesh> read_primitive(const GltfFile& file, const tinygltf::Model& model, std::size_t mesh_index,
                                   std::size_t primitive_index)
{
    const tinygltf::Mesh& source = model.meshes[mesh_index];
    const tinygltf::Primitive& primitive = source.primitives[primitive_index];
    const Context context{file, model, primitive,
                          element_name("mesh", mesh_index, source.name) + ", primitive " +
                              std::to_string(primitive_index),
                          short_name(mesh_index, source.name)};
    if (primitive.mode < TINYGLTF_MODE_TRIANGLES || primitive.mode > TINYGLTF_MODE_TRIANGLE_FAN) {
        file.notes->add(kLines, context.name);
        return std::nullopt;
    }
    const int positions = attribute(primitive, "POSITION");
    if (positions < 0) {
        file.notes->add(kNoPositions, context.name);
        return std::nullopt;
    }
    if (attribute(primitive, "COLOR_0") >= 0) file.notes->add(kVertexColors, context.name);
    if (!primitive.targets.empty()) file.notes->add(kMorph, context.name);

    Mesh mesh;
    mesh.name = source.name;
    if (source.primitives.size() > 1) mesh.name.append("/").append(std::to_string(primitive_index));
    mesh.positions = read_positions(context, positions);
    mesh.triangles = triangles_of(context, read_vertex_order(context, mesh.positions.size()));
    drop_flat_triangles(context, mesh);
    if (mesh.triangles.empty()) return std::nullopt;
    if (const int normals = attribute(primitive, "NORMAL"); normals >= 0) read_normals(context, mesh, normals);
    const std::string uv_name = uv_attribute(context);
    if (const int uvs = attribute(primitive, uv_name); uvs >= 0) read_uvs(context, mesh, uvs, uv_name);
    return mesh;
}

}  // namespace rcs
