#include "stability/export_glb.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "rcs/error.h"
#include "scene/material_fields.h"

namespace rcs::stability {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kFloat = 5126, kUnsignedInt = 5125;

Json array_of(glm::vec3 v) { return {v.x, v.y, v.z}; }

Json array_of(const glm::dmat4& m)
{
    Json values = Json::array();
    for (int column = 0; column < 4; ++column)
        for (int row = 0; row < 4; ++row) values.push_back(m[column][row]);
    return values;
}

/// The document under construction and its one buffer.
struct Document {
    Json root = {{"asset", {{"version", "2.0"}, {"generator", "librcs"}}}};
    std::string binary;

    template <class Value>
    int add(const std::vector<Value>& values, int component, const char* type, std::size_t count)
    {
        root["bufferViews"].push_back(
            {{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", values.size() * sizeof(Value)}});
        binary.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Value));
        root["accessors"].push_back({{"bufferView", root["bufferViews"].size() - 1},
                                     {"componentType", component},
                                     {"type", type},
                                     {"count", count}});
        return static_cast<int>(root["accessors"].size()) - 1;
    }
};

Json material_json(const Material& m)
{
    Json json = {{"name", m.name},
                 {"doubleSided", m.double_sided},
                 {"pbrMetallicRoughness",
                  {{"baseColorFactor", {m.base_color.r, m.base_color.g, m.base_color.b, m.alpha}},
                   {"metallicFactor", m.metallic},
                   {"roughnessFactor", m.roughness}}}};
    const float brightest = std::max({m.emission.r, m.emission.g, m.emission.b, 1.0f});
    json["emissiveFactor"] = array_of(m.emission / brightest);
    Json extensions;
    extensions["KHR_materials_emissive_strength"] = {{"emissiveStrength", brightest}};
    for (const MaterialFactor& factor : kMaterialFactors)
        if (factor.extension) extensions[factor.extension][factor.key] = m.*factor.value;
    for (const MaterialColor& color : kMaterialColors)
        if (color.extension) extensions[color.extension][color.key] = array_of(m.*color.value);
    if (m.unlit) extensions["KHR_materials_unlit"] = Json::object();
    json["extensions"] = extensions;
    if (m.alpha_mode != AlphaMode::opaque) json["alphaMode"] = m.alpha_mode == AlphaMode::mask ? "MASK" : "BLEND";
    if (m.alpha_mode == AlphaMode::mask) json["alphaCutoff"] = m.alpha_cutoff;
    return json;
}

/// Empty arrays are no accessors in glTF: a mesh without triangles has no primitive to be written.
Json mesh_json(const Mesh& mesh, Document& document)
{
    Json attributes = {{"POSITION", document.add(mesh.positions, kFloat, "VEC3", mesh.positions.size())}};
    glm::vec3 low(mesh.positions[0]), high(low);
    for (const glm::vec3& p : mesh.positions) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    document.root["accessors"].back()["min"] = array_of(low);
    document.root["accessors"].back()["max"] = array_of(high);
    if (!mesh.normals.empty()) attributes["NORMAL"] = document.add(mesh.normals, kFloat, "VEC3", mesh.normals.size());
    if (!mesh.uvs.empty()) attributes["TEXCOORD_0"] = document.add(mesh.uvs, kFloat, "VEC2", mesh.uvs.size());
    if (!mesh.colors.empty()) attributes["COLOR_0"] = document.add(mesh.colors, kFloat, "VEC4", mesh.colors.size());
    const int indices = document.add(mesh.triangles, kUnsignedInt, "SCALAR", 3 * mesh.triangles.size());
    const Json primitive = {{"attributes", attributes}, {"indices", indices}, {"material", mesh.material}};
    return {{"name", mesh.name}, {"primitives", Json::array({primitive})}};
}

Json light_json(const PunctualLight& light)
{
    const float brightest = std::max({light.intensity.r, light.intensity.g, light.intensity.b});
    Json json = {{"name", light.name},
                 {"type", light.kind == LightKind::point  ? "point"
                          : light.kind == LightKind::spot ? "spot"
                                                          : "directional"},
                 {"intensity", brightest},
                 {"color", array_of(brightest > 0.0f ? light.intensity / brightest : glm::vec3(1.0f))}};
    if (light.range < std::numeric_limits<float>::infinity()) json["range"] = light.range;
    if (light.kind == LightKind::spot)
        json["spot"] = {{"innerConeAngle", light.inner_cone}, {"outerConeAngle", light.outer_cone}};
    return json;
}

/// Turns -Z into the light's direction.
glm::dmat4 light_matrix(const PunctualLight& light)
{
    const Camera camera = look_at_camera("", light.position, light.position + light.direction, 1.0,
                                         std::abs(light.direction.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0));
    return camera.world_from_view;
}

void add_nodes(const Scene& scene, const std::vector<int>& written, Document& document)
{
    Json nodes = Json::array();
    Json lights = Json::array(), cameras = Json::array();
    for (const Instance& instance : scene.instances) {
        const int mesh = written[static_cast<std::size_t>(instance.mesh)];
        if (mesh >= 0)
            nodes.push_back(
                {{"name", instance.name}, {"mesh", mesh}, {"matrix", array_of(instance.world_from_object)}});
    }
    for (const PunctualLight& light : scene.lights) {
        lights.push_back(light_json(light));
        nodes.push_back({{"name", light.name},
                         {"matrix", array_of(light_matrix(light))},
                         {"extensions", {{"KHR_lights_punctual", {{"light", lights.size() - 1}}}}}});
    }
    for (const Camera& camera : scene.cameras) {
        if (camera.projection == Projection::perspective)
            cameras.push_back({{"type", "perspective"}, {"perspective", {{"yfov", camera.yfov}, {"znear", 1e-3}}}});
        else
            cameras.push_back(
                {{"type", "orthographic"},
                 {"orthographic", {{"xmag", camera.ymag}, {"ymag", camera.ymag}, {"znear", 0}, {"zfar", 1e6}}}});
        nodes.push_back(
            {{"name", camera.name}, {"camera", cameras.size() - 1}, {"matrix", array_of(camera.world_from_view)}});
    }
    Json roots = Json::array();
    for (std::size_t i = 0; i < nodes.size(); ++i) roots.push_back(i);
    document.root["nodes"] = nodes;
    if (!lights.empty()) document.root["extensions"] = {{"KHR_lights_punctual", {{"lights", lights}}}};
    if (!cameras.empty()) document.root["cameras"] = cameras;
    document.root["scenes"] = Json::array({{{"nodes", roots}}});
    document.root["scene"] = 0;
}

void append(std::string& bytes, std::size_t value)
{
    const auto number = static_cast<std::uint32_t>(value);
    char raw[4];
    std::memcpy(raw, &number, 4);
    bytes.append(raw, 4);
}

std::string what_lacks(const Scene& scene)
{
    std::string lacks;
    if (!scene.textures.empty()) lacks = "textures";
    if (scene.sky_radiance != glm::vec3(0.0f) || !scene.environment.empty())
        lacks += std::string(lacks.empty() ? "" : " and ") + "the sky (--environment)";
    return lacks;
}

}  // namespace

std::string export_glb(const Scene& scene, const std::string& path)
{
    Document document;
    std::set<std::string> used{"KHR_lights_punctual"};
    for_each_material_key([&](const char* name, const char*, MaterialKey::Kind) { used.insert(name); });
    document.root["extensionsUsed"] = used;
    for (const Material& material : scene.materials) document.root["materials"].push_back(material_json(material));
    Json meshes = Json::array();
    std::vector<int> written(scene.meshes.size(), -1);
    for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
        if (scene.meshes[i].triangles.empty()) continue;
        meshes.push_back(mesh_json(scene.meshes[i], document));
        written[i] = static_cast<int>(meshes.size()) - 1;
    }
    if (!meshes.empty()) document.root["meshes"] = meshes;
    add_nodes(scene, written, document);
    if (!document.binary.empty()) document.root["buffers"] = Json::array({{{"byteLength", document.binary.size()}}});
    write_glb(document.root.dump(-1, ' ', false, Json::error_handler_t::replace), document.binary, path);
    return what_lacks(scene);
}

void write_glb(std::string json, const std::string& binary, const std::string& path)
{
    json.resize((json.size() + 3) / 4 * 4, ' ');
    std::string chunk = binary;
    chunk.resize((chunk.size() + 3) / 4 * 4);
    std::string file = "glTF";
    append(file, 2);
    append(file, 12 + 8 + json.size() + (chunk.empty() ? 0 : 8 + chunk.size()));
    append(file, json.size());
    file += "JSON" + json;
    if (!chunk.empty()) {
        append(file, chunk.size());
        file.append("BIN\0", 4);
        file += chunk;
    }
    std::ofstream out(path, std::ios::binary);
    if (!out.write(file.data(), static_cast<std::streamsize>(file.size())).flush())
        throw Error(ErrorCode::io, "cannot write " + path);
}

void rewrite_glb(const std::string& path, const std::function<std::string(std::string)>& change)
{
    std::ifstream in(path, std::ios::binary);
    const std::string file{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    constexpr std::size_t kHeader = 12, kChunkHeader = 8;
    std::uint32_t length = 0;
    if (file.size() < kHeader + kChunkHeader) throw Error(ErrorCode::io, "cannot read " + path);
    std::memcpy(&length, file.data() + kHeader, 4);
    const std::size_t rest = kHeader + kChunkHeader + length;
    write_glb(change(file.substr(kHeader + kChunkHeader, length)),
              file.size() > rest ? file.substr(rest + kChunkHeader) : "", path);
}

}  // namespace rcs::stability
