#include "scene/gltf_check.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <string_view>
#include <utility>

#include "scene/gltf_draco.h"
#include "scene/gltf_schema.h"
#include "scene/gltf_uri.h"
#include "scene/material_fields.h"
#include "scene/tinygltf.h"

namespace rcs {
namespace {

/// Beside those of materials.
constexpr std::string_view kSupportedExtensions[] = {
    "EXT_mesh_gpu_instancing", "EXT_meshopt_compression",    "EXT_texture_webp",
    "KHR_animation_pointer",   "KHR_draco_mesh_compression", "KHR_lights_punctual",
    "KHR_mesh_quantization",   "KHR_node_visibility",        "KHR_texture_transform"};

bool is_supported(std::string_view name)
{
    bool supported = std::find(std::begin(kSupportedExtensions), std::end(kSupportedExtensions), name) !=
                     std::end(kSupportedExtensions);
    for_each_material_key([&](std::string_view extension, const char*, MaterialKey::Kind) {
        supported = supported || extension == name;
    });
    return supported;
}

void check_extensions(const GltfDocument& document)
{
    std::string missing;
    for (const Json& name : array_of(document, "extensionsRequired")) {
        const std::string text = name.is_string() ? name.get<std::string>() : name.dump();
        if (!is_supported(text)) {
            missing += (missing.empty() ? "" : ", ") + text;
        }
    }
    if (!missing.empty()) {
        fail(document.file, ErrorCode::unsupported, "requires what this build does not offer: " + missing);
    }
    for (const Json& name : array_of(document, "extensionsUsed")) {
        static constexpr GltfNoteKind kUnknown{"unknown features", "extension", "ignored"};
        const std::string text = name.is_string() ? name.get<std::string>() : name.dump();
        if (!is_supported(text)) document.file.notes->add(kUnknown, text);
    }
}

/// @return whether it says that it is there only for readers without EXT_meshopt_compression
bool is_fallback(const GltfDocument& document, const Json& buffer, const std::string& what)
{
    const Json* extension = extension_of(document, buffer, "EXT_meshopt_compression", what);
    const auto flag = extension ? extension->find("fallback") : Json::const_iterator();
    return extension && flag != extension->end() && flag->is_boolean() && flag->get<bool>();
}

void check_buffers(const GltfDocument& document, GltfSource& source)
{
    std::size_t index = 0;
    for (const Json& buffer : array_of(document, "buffers")) {
        const std::string what = element_name("buffer", index++, "");
        if (!buffer.is_object()) bad_file(document.file, what + " is no object");
        GltfSource::Buffer& made = source.buffers.emplace_back();
        made.size = whole_number(document, buffer, "byteLength", what).value_or(0);
        if (made.size == 0) bad_file(document.file, what + ": 'byteLength' is missing or 0");
        const auto uri = buffer.find("uri");
        if (uri != buffer.end() && !uri->is_string()) bad_file(document.file, what + ": 'uri' is no string");
        if (uri != buffer.end()) made.uri = uri->get<std::string>();
        // The second chunk is the first buffer's alone; another one without a URI is for an extension to fill.
        const bool held = &made == &source.buffers.front() && !document.binary.empty();
        made.absent = is_fallback(document, buffer, what) || (made.uri.empty() && !held);
        if (made.absent) continue;
        if (!made.uri.empty() && !made.uri.starts_with("data:")) external_path(document.file, made.uri, what);
        if (made.uri.empty() && made.size > document.binary.size()) {
            bad_file(document.file, what + " has " + std::to_string(made.size) + " bytes, the file holds " +
                                        std::to_string(document.binary.size()));
        }
    }
}

void check_views(const GltfDocument& document, GltfSource& source)
{
    std::size_t index = 0;
    for (const Json& view : array_of(document, "bufferViews")) {
        const std::string what = element_name("buffer view", index, "");
        if (!view.is_object()) bad_file(document.file, what + " is no object");
        const Json& buffer = element_of(document, "buffers", view, "buffer", what);
        const auto size = *whole_number(document, buffer, "byteLength", what);
        const auto offset = whole_number(document, view, "byteOffset", what).value_or(0);
        const auto length = whole_number(document, view, "byteLength", what).value_or(0);
        if (length < 1 || offset > size || length > size - offset) {
            bad_file(document.file, what + " has " + std::to_string(length) + " bytes from byte " +
                                        std::to_string(offset) + ", its buffer has " + std::to_string(size));
        }
        if (const Json* packed = extension_of(document, view, "EXT_meshopt_compression", what)) {
            source.packed_views.push_back(packed_view(document, *packed, index, what));
        }
        ++index;
    }
}

void check_images(const GltfDocument& document, GltfSource& source)
{
    std::size_t index = 0;
    for (const Json& image : array_of(document, "images")) {
        const std::string what = element_name("image", index++, "");
        if (image.contains("bufferView")) {
            const Json& view = element_of(document, "bufferViews", image, "bufferView", what);
            if (source.buffers[*whole_number(document, view, "buffer", what)].absent) {
                bad_file(document.file, what + " lies in a buffer that holds nothing");
            }
        }
        if (image.contains("bufferView") == image.contains("uri")) {
            bad_file(document.file, what + " needs either a uri or a bufferView");
        }
        source.image_uris.push_back(image.value("uri", std::string()));
    }
}

/// Decodes once for the check alone: tinygltf decodes again, but would follow an attribute that the data
/// lack, or one of more than four components, and read any byte as a truth value.
void check_draco(const GltfDocument& document, const GltfSource& source, const Json& primitive, const Json& compressed,
                 const std::string& what)
{
    const Json& view = element_of(document, "bufferViews", compressed, "bufferView", what);
    const std::uint64_t buffer = *whole_number(document, view, "buffer", what);
    const Json& indices = element_of(document, "accessors", primitive, "indices", what);
    std::vector<unsigned char> held;
    Bytes bytes = document.binary;
    if (source.buffers[buffer].absent || !source.buffers[buffer].uri.empty()) {
        bytes = held = buffer_bytes(document.file, source.buffers[buffer], {}, element_name("buffer", buffer, ""));
    }
    const std::size_t offset = view.value("byteOffset", std::size_t{0});
    const auto length = view["byteLength"].get<std::size_t>();
    if (offset > bytes.size() || length > bytes.size() - offset) {
        bad_file(document.file, what + ": its Draco data lie outside their buffer");
    }

    const std::unique_ptr<draco::Mesh> decoded =
        decode_draco(document.file, what, reinterpret_cast<const char*>(bytes.data()) + offset, length);
    const draco::Mesh& mesh = *decoded;
    const int index_type = indices.value("componentType", 0);
    const std::uint64_t most_points = index_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE    ? 0x100
                                      : index_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ? 0x10000
                                      : index_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT   ? 0x100000000
                                                                                             : 0;
    if (mesh.num_faces() < 1 || mesh.num_points() < 1 || mesh.num_points() > most_points) {
        bad_file(document.file, what + ": its Draco data have " + std::to_string(mesh.num_faces()) + " faces and " +
                                    std::to_string(mesh.num_points()) + " points, expected 1 to " +
                                    std::to_string(most_points) + " points");
    }
    const auto attributes = compressed.find("attributes");
    if (attributes == compressed.end() || !attributes->is_object()) {
        bad_file(document.file, what + ": its Draco extension names no attributes");
    }
    for (const auto& [name, id] : attributes->items()) {
        element_of(document, "accessors", primitive["attributes"], name.c_str(), what);
        const auto* attribute = id.is_number_unsigned() && id.get<std::uint64_t>() <= 0x7fffffff
                                    ? mesh.GetAttributeByUniqueId(id.get<std::uint32_t>())
                                    : nullptr;
        if (!attribute || attribute->num_components() < 1 || attribute->num_components() > 4) {
            bad_file(document.file, what + ": its Draco data have no attribute " + id.dump() + " for " + name);
        }
        if (attribute->data_type() == draco::DT_BOOL) {
            bad_file(document.file, what + ": its Draco data hold " + name + " as true or false, expected numbers");
        }
    }
}

void check_meshes(const GltfDocument& document, const GltfSource& source)
{
    std::size_t index = 0;
    for (const Json& mesh : array_of(document, "meshes")) {
        const std::string mesh_name = element_name("mesh", index++, "");
        std::size_t number = 0;
        for (const Json& primitive : mesh["primitives"]) {
            const std::string what = mesh_name + ", primitive " + std::to_string(number++);
            if (!primitive.contains("attributes") || !primitive["attributes"].is_object()) {
                bad_file(document.file, what + " has no attributes");
            }
            for (const auto& attribute : primitive["attributes"].items()) {
                element_of(document, "accessors", primitive["attributes"], attribute.key().c_str(), what);
            }
            if (primitive.contains("indices")) element_of(document, "accessors", primitive, "indices", what);
            const Json* compressed = extension_of(document, primitive, "KHR_draco_mesh_compression", what);
            if (compressed) check_draco(document, source, primitive, *compressed, what);
        }
    }
}

/// tinygltf drops channels without a node, as those of KHR_animation_pointer are: gives them one that is none.
/// @return whether there were any
bool keep_pointers(GltfDocument& document)
{
    bool any = false;
    if (!document.root.contains("animations")) return any;
    for (Json& animation : document.root["animations"]) {
        for (Json& channel : animation["channels"]) {
            Json& target = channel["target"];
            if (target.contains("node") || target.value("path", "") != "pointer") continue;
            target["node"] = -1;
            any = true;
        }
    }
    return any;
}

/// Replaces every URI by a number, so that this library alone decides what is read.
void take_out_uris(GltfDocument& document, const GltfSource& source)
{
    for (std::size_t i = 0; i < source.buffers.size(); ++i) {
        Json& buffer = document.root["buffers"][i];
        if (source.buffers[i].absent) buffer["byteLength"] = 1;
        if (source.buffers[i].absent || !source.buffers[i].uri.empty()) buffer["uri"] = kBufferUri + std::to_string(i);
    }
    for (std::size_t i = 0; i < source.image_uris.size(); ++i) {
        if (!source.image_uris[i].empty()) document.root["images"][i]["uri"] = kImageUri + std::to_string(i);
    }
}

bool has_uris(const GltfSource& source)
{
    return std::any_of(source.buffers.begin(), source.buffers.end(),
                       [](const auto& buffer) { return buffer.absent || !buffer.uri.empty(); }) ||
           std::any_of(source.image_uris.begin(), source.image_uris.end(),
                       [](const auto& uri) { return !uri.empty(); });
}

}  // namespace

GltfSource check_gltf(const GltfFile& file, std::vector<unsigned char> bytes,
                      const std::vector<PosedProperty>& properties)
{
    GltfDocument document = read_document(file, bytes);
    GltfSource source;
    check_extensions(document);
    const bool made_whole = make_indices_whole(document);
    set_properties(document, properties);
    check_types(document);
    const bool has_pointers = keep_pointers(document);
    check_buffers(document, source);
    check_views(document, source);
    check_images(document, source);
    check_meshes(document, source);
    if (has_uris(source) || made_whole || has_pointers || !properties.empty()) {
        take_out_uris(document, source);
        if (is_glb(bytes)) {
            bytes = glb_bytes(document);
        } else {
            const std::string text = document.root.dump(-1, ' ', false, Json::error_handler_t::replace);
            bytes.assign(text.begin(), text.end());
        }
    }
    source.bytes = std::move(bytes);
    return source;
}

std::vector<unsigned char> buffer_bytes(const GltfFile& file, const GltfSource::Buffer& buffer, Bytes binary,
                                        const std::string& what)
{
    if (buffer.absent) return {0};
    std::vector<unsigned char> bytes;
    if (buffer.uri.empty())
        bytes.assign(binary.begin(), binary.end());
    else
        bytes = uri_bytes(file, buffer.uri, what);
    if (bytes.size() < buffer.size) {
        bad_file(file, what + " is shorter than its 'byteLength' says: " + std::to_string(bytes.size()) +
                           " bytes, expected " + std::to_string(buffer.size));
    }
    bytes.resize(buffer.size);
    return bytes;
}

}  // namespace rcs
