#include "scene/gltf_mesh.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "scene/gltf_accessor.h"
#include "scene/gltf_material.h"
#include "scene/gltf_tangents.h"

namespace rcs {
namespace {

constexpr GltfNoteKind kLines{"points or lines", "mesh", "left out"};
constexpr GltfNoteKind kNoPositions{"primitives without positions", "mesh", "left out"};
constexpr GltfNoteKind kLeftOver{"indices that make no whole triangle", "mesh", "left out"};
constexpr GltfNoteKind kFlat{"triangles without area", "mesh", "dropped"};
constexpr GltfNoteKind kBadNormals{"normals that are zero or not finite", "mesh", "replaced by the faces' own"};
constexpr GltfNoteKind kBadUvs{"texture coordinates that are not finite", "mesh", "set to 0"};
constexpr GltfNoteKind kNoUvs{"no texture coordinates for its textures", "mesh", "one texel of them is shown"};
constexpr GltfNoteKind kBadColors{"vertex colours outside [0, 1]", "mesh", "clamped"};
constexpr GltfNoteKind kBadTangents{"tangents that are zero, not finite or along the normal", "mesh", "replaced"};

/// Beyond this, squares of lengths leave the range of float (1e38).
constexpr float kMaxCoordinate = 1e18f;

struct Context {
    const GltfFile& file;
    const tinygltf::Model& model;
    const tinygltf::Primitive& primitive;
    std::string what;  ///< "mesh 0 'floor', primitive 1"
    std::string name;  ///< of the mesh, for notes
};

int attribute(const tinygltf::Primitive& primitive, const std::string& name)
{
    const auto found = primitive.attributes.find(name);
    return found == primitive.attributes.end() ? -1 : found->second;
}

void check_positions(const Context& context, const std::vector<glm::vec3>& positions, const char* when)
{
    for (std::size_t i = 0; i < positions.size(); ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            // Written so that NaN fails, too.
            if (!(std::fabs(positions[i][axis]) <= kMaxCoordinate)) {
                bad_file(context.file, context.what + ", POSITION (accessor " +
                                           std::to_string(attribute(context.primitive, "POSITION")) + "): vertex " +
                                           std::to_string(i) + when + " has the coordinate " +
                                           std::to_string(positions[i][axis]) +
                                           ", expected a number within 1e18 of zero");
            }
        }
    }
}

/// @throws Error bad_file unless there is one element per position
void check_count(const Context& context, const std::string& what, std::size_t count, const Mesh& mesh)
{
    if (count == mesh.positions.size()) return;
    bad_file(context.file, what + " has " + std::to_string(count) + " elements, POSITION has " +
                               std::to_string(mesh.positions.size()));
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
        bad_file(context.file, what + " (accessor " + std::to_string(context.primitive.indices) + ") name vertex " +
                                   std::to_string(*outside) + ", the primitive has " + std::to_string(vertices));
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

void read_normals(const Context& context, const Deformer& deformer, Mesh& mesh, int accessor)
{
    const std::string what = context.what + ", NORMAL";
    mesh.normals = read_vec3(context.file, context.model, accessor, what);
    check_count(context, what, mesh.normals.size(), mesh);
    deformer.morph("NORMAL", mesh.normals);
    deformer.skin_normals(mesh.normals);
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

std::vector<glm::vec2> read_uvs(const Context& context, const Mesh& mesh, int set)
{
    const std::string name = "TEXCOORD_" + std::to_string(set);
    const int accessor = attribute(context.primitive, name);
    if (accessor < 0) return {};
    const std::string what = context.what + ", " + name;
    std::vector<glm::vec2> uvs = read_vec2(context.file, context.model, accessor, what);
    check_count(context, what, uvs.size(), mesh);
    std::size_t replaced = 0;
    for (glm::vec2& uv : uvs) {
        if (std::isfinite(uv.x) && std::isfinite(uv.y)) continue;
        uv = glm::vec2(0.0f);
        ++replaced;
    }
    if (replaced > 0) context.file.notes->add(kBadUvs, context.name, replaced);
    return uvs;
}

void read_colors(const Context& context, Mesh& mesh)
{
    const int accessor = attribute(context.primitive, "COLOR_0");
    if (accessor < 0) return;
    const std::string what = context.what + ", COLOR_0";
    mesh.colors = read_colors(context.file, context.model, accessor, what);
    check_count(context, what, mesh.colors.size(), mesh);
    std::size_t clamped = 0;
    for (glm::vec4& color : mesh.colors) {
        const glm::vec4 asked = color;
        // The comparison is false for NaN, which becomes 0.
        for (int i = 0; i < 4; ++i) color[i] = color[i] > 0.0f ? std::min(color[i], 1.0f) : 0.0f;
        if (color != asked) ++clamped;
    }
    if (clamped > 0) context.file.notes->add(kBadColors, context.name, clamped);
}

void read_tangents(const Context& context, const Deformer& deformer, Mesh& mesh, int accessor)
{
    const std::string what = context.what + ", TANGENT";
    mesh.tangents = read_vec4(context.file, context.model, accessor, what);
    check_count(context, what, mesh.tangents.size(), mesh);
    std::vector<glm::vec3> directions(mesh.tangents.begin(), mesh.tangents.end());
    deformer.morph("TANGENT", directions);
    deformer.skin_tangents(directions);
    std::size_t replaced = 0;
    for (std::size_t i = 0; i < mesh.tangents.size(); ++i) {
        const glm::dvec3 normal = mesh.normals[i];
        const glm::dvec3 given = directions[i];
        glm::dvec3 tangent = given - normal * glm::dot(normal, given);
        if (!is_usable(tangent) || glm::dot(tangent, tangent) < 1e-8 * glm::dot(given, given)) {
            tangent = any_tangent(normal);
            ++replaced;
        }
        mesh.tangents[i] = glm::vec4(glm::vec3(glm::normalize(tangent)), mesh.tangents[i].w < 0.0f ? -1.0f : 1.0f);
    }
    if (replaced > 0) context.file.notes->add(kBadTangents, context.name, replaced);
}

const tinygltf::Material& material_of(const Context& context)
{
    static const tinygltf::Material none;
    const int material = context.primitive.material;
    const bool known = material >= 0 && static_cast<std::size_t>(material) < context.model.materials.size();
    return known ? context.model.materials[static_cast<std::size_t>(material)] : none;
}

/// Texture coordinates, and tangents where something is mapped along them: the file's own, unless it has none or
/// they belong to normals that are missing.
void read_mapping(const Context& context, const Deformer& deformer, Mesh& mesh)
{
    const tinygltf::Material& material = material_of(context);
    const UvSets sets = uv_sets_of(material);
    mesh.uvs = read_uvs(context, mesh, sets[0]);
    if (sets[1] >= 0 && uses_uv_set(material, sets[1])) mesh.uvs1 = read_uvs(context, mesh, sets[1]);
    const bool lacks_uvs = (mesh.uvs.empty() && sets[0] >= 0 && uses_uv_set(material, sets[0])) ||
                           (mesh.uvs1.empty() && sets[1] >= 0 && uses_uv_set(material, sets[1]));
    if (lacks_uvs) context.file.notes->add(kNoUvs, context.name);

    const std::optional<TextureUse> mapping = tangent_texture_use(material);
    if (!mapping) return;
    const int tangents = attribute(context.primitive, "TANGENT");
    const auto set = std::find(sets.begin(), sets.end(), mapping->uv_set);
    if (tangents >= 0 && !mesh.normals.empty()) {
        read_tangents(context, deformer, mesh, tangents);
    } else if (set != sets.end() && !(set == sets.begin() ? mesh.uvs : mesh.uvs1).empty()) {
        make_tangents(mesh, static_cast<int>(set - sets.begin()), mapping->texture_from_uv);
    }
}

}  // namespace

std::optional<Mesh> read_primitive(const GltfFile& file, const tinygltf::Model& model, std::size_t mesh_index,
                                   std::size_t primitive_index, const Deformation& deformation)
{
    const tinygltf::Mesh& source = model.meshes[mesh_index];
    const tinygltf::Primitive& primitive = source.primitives[primitive_index];
    const Context context{
        file, model, primitive,
        element_name("mesh", mesh_index, source.name) + ", primitive " + std::to_string(primitive_index),
        short_name(mesh_index, source.name)};
    if (primitive.mode > TINYGLTF_MODE_TRIANGLE_FAN) {
        bad_file(file, context.what + " has the mode " + std::to_string(primitive.mode) + ", expected 0 to 6");
    }
    if (primitive.mode < TINYGLTF_MODE_TRIANGLES) {
        file.notes->add(kLines, context.name);
        return std::nullopt;
    }
    const int positions = attribute(primitive, "POSITION");
    if (positions < 0) {
        file.notes->add(kNoPositions, context.name);
        return std::nullopt;
    }

    Mesh mesh;
    mesh.name = source.name;
    if (source.primitives.size() > 1) mesh.name.append("/").append(std::to_string(primitive_index));
    mesh.positions = read_vec3(file, model, positions, context.what + ", POSITION");
    check_positions(context, mesh.positions, "");
    const Deformer deformer(file, model, primitive, deformation, mesh.positions.size(), context.what, context.name);
    deformer.morph("POSITION", mesh.positions);
    deformer.skin_positions(mesh.positions);
    if (!deformation.rigid()) check_positions(context, mesh.positions, " as posed");
    mesh.triangles = triangles_of(context, read_vertex_order(context, mesh.positions.size()));
    drop_flat_triangles(context, mesh);
    if (mesh.triangles.empty()) return std::nullopt;
    const int normals = attribute(primitive, "NORMAL");
    if (normals >= 0) read_normals(context, deformer, mesh, normals);
    read_colors(context, mesh);
    read_mapping(context, deformer, mesh);
    return mesh;
}

}  // namespace rcs
