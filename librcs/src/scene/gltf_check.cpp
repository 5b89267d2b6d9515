#include "scene/gltf_check.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include <draco/compression/decode.h>
#include <nlohmann/json.hpp>

#include "scene/tinygltf.h"

namespace rcs {
namespace {

using Json = nlohmann::json;
using Bytes = std::span<const unsigned char>;

constexpr std::array<std::string_view, 4> kSupportedExtensions = {
    "KHR_draco_mesh_compression", "KHR_lights_punctual", "KHR_materials_emissive_strength", "KHR_mesh_quantization"};

struct Document {
    const GltfFile& file;
    Json root;
    Bytes binary;  ///< the second chunk of a .glb
};

std::uint32_t read_u32(Bytes bytes, std::size_t at)
{
    return std::uint32_t{bytes[at]} | std::uint32_t{bytes[at + 1]} << 8 | std::uint32_t{bytes[at + 2]} << 16 |
           std::uint32_t{bytes[at + 3]} << 24;
}

/// Splits a .glb into its two chunks. Layout: glTF 2.0, section 4.4.
std::pair<Bytes, Bytes> glb_chunks(const GltfFile& file, Bytes bytes)
{
    constexpr std::size_t kHeader = 12;
    constexpr std::size_t kChunkHeader = 8;
    constexpr std::uint32_t kJson = 0x4e4f534a;
    constexpr std::uint32_t kBin = 0x004e4942;
    if (bytes.size() < kHeader + kChunkHeader) bad_file(file, "is truncated: a .glb file has at least 20 bytes");
    if (read_u32(bytes, 4) != 2) {
        fail(file, ErrorCode::unsupported,
             "is .glb version " + std::to_string(read_u32(bytes, 4)) + ", expected version 2");
    }
    const std::size_t length = read_u32(bytes, 8);
    if (length > bytes.size()) {
        bad_file(file, "is truncated: its header says " + std::to_string(length) + " bytes, the file has " +
                           std::to_string(bytes.size()));
    }
    const auto chunk = [&](std::size_t at, std::uint32_t type) {
        if (length < at + kChunkHeader || read_u32(bytes, at) > length - at - kChunkHeader ||
            read_u32(bytes, at + 4) != type) {
            bad_file(file, "has a damaged chunk at byte " + std::to_string(at));
        }
        return bytes.subspan(at + kChunkHeader, read_u32(bytes, at));
    };
    const Bytes json = chunk(kHeader, kJson);
    const std::size_t next = kHeader + kChunkHeader + json.size();
    return {json, next < length ? chunk(next, kBin) : Bytes{}};
}

/// How deep arrays and objects lie in each other at most, if the text is JSON.
int nesting_depth(Bytes text)
{
    int depth = 0;
    int deepest = 0;
    bool in_string = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const unsigned char c = text[i];
        if (in_string) {
            if (c == '\\') ++i;
            else if (c == '"') in_string = false;
        } else if (c == '"') {
            in_string = true;
        } else if (c == '[' || c == '{') {
            deepest = std::max(deepest, ++depth);
        } else if (c == ']' || c == '}') {
            --depth;
        }
    }
    return deepest;
}

Json parse_json(const GltfFile& file, Bytes text)
{
    // tinygltf follows extras and extensions by recursion.
    constexpr int kMaxDepth = 128;
    if (nesting_depth(text) > kMaxDepth) {
        bad_file(file, "is no sound glTF file: it nests JSON deeper than " + std::to_string(kMaxDepth));
    }
    try {
        return Json::parse(text.begin(), text.end());
    } catch (const Json::exception& e) {
        bad_file(file, std::string("is no glTF file: ") + e.what());
    }
}

const Json& array_of(const Document& document, const char* key)
{
    static const Json empty = Json::array();
    const auto found = document.root.find(key);
    if (found == document.root.end()) return empty;
    if (!found->is_array()) bad_file(document.file, std::string("'") + key + "' is no array");
    return *found;
}

/// The member, a whole number >= 0; nullopt if it is missing.
std::optional<std::uint64_t> whole_number(const Document& document, const Json& object, const char* key,
                                          const std::string& what)
{
    const auto found = object.find(key);
    if (found == object.end()) return std::nullopt;
    if (!found->is_number_unsigned()) bad_file(document.file, what + ": '" + key + "' is no whole number >= 0");
    return found->get<std::uint64_t>();
}

/// The element of array `key` that `object[member]` points to.
const Json& element_of(const Document& document, const char* key, const Json& object, const char* member,
                       const std::string& what)
{
    const Json& elements = array_of(document, key);
    const auto index = whole_number(document, object, member, what);
    if (!index || *index >= elements.size()) {
        bad_file(document.file, what + ": '" + member + "' is " + (index ? std::to_string(*index) : "missing") +
                                    ", expected an index below " + std::to_string(elements.size()) + " into '" +
                                    key + "'");
    }
    return elements[*index];
}

void check_header(const Document& document)
{
    const Json& root = document.root;
    if (!root.is_object() || !root.contains("asset") || !root["asset"].is_object() ||
        !root["asset"].contains("version") || !root["asset"]["version"].is_string()) {
        bad_file(document.file, "is no glTF file: it has no asset.version");
    }
    const auto version = root["asset"]["version"].get<std::string>();
    if (version.rfind("2.", 0) != 0) {
        fail(document.file, ErrorCode::unsupported, "is glTF version '" + version + "', expected 2.x");
    }
    std::string missing;
    for (const Json& name : array_of(document, "extensionsRequired")) {
        const std::string text = name.is_string() ? name.get<std::string>() : name.dump();
        if (std::find(kSupportedExtensions.begin(), kSupportedExtensions.end(), text) == kSupportedExtensions.end()) {
            missing += (missing.empty() ? "" : ", ") + text;
        }
    }
    if (!missing.empty()) {
        fail(document.file, ErrorCode::unsupported, "requires what this build does not offer: " + missing);
    }
    for (const Json& name : array_of(document, "extensionsUsed")) {
        static constexpr GltfNoteKind kUnknown{"unknown features", "extension", "ignored"};
        const std::string text = name.is_string() ? name.get<std::string>() : name.dump();
        if (std::find(kSupportedExtensions.begin(), kSupportedExtensions.end(), text) == kSupportedExtensions.end()) {
            document.file.notes->add(kUnknown, text);
        }
    }
}

void check_buffers(const Document& document)
{
    std::size_t index = 0;
    for (const Json& buffer : array_of(document, "buffers")) {
        const std::string what = element_name("buffer", index++, "");
        if (!buffer.is_object()) bad_file(document.file, what + " is no object");
        if (!whole_number(document, buffer, "byteLength", what).value_or(0)) {
            bad_file(document.file, what + ": 'byteLength' is missing or 0");
        }
        const auto uri = buffer.find("uri");
        if (uri == buffer.end()) continue;
        if (!uri->is_string()) bad_file(document.file, what + ": 'uri' is no string");
        const auto text = uri->get<std::string>();
        if (!tinygltf::IsDataURI(text)) external_path(document.file, text, what);
    }
    index = 0;
    for (const Json& view : array_of(document, "bufferViews")) {
        const std::string what = element_name("buffer view", index++, "");
        if (!view.is_object()) bad_file(document.file, what + " is no object");
        const Json& buffer = element_of(document, "buffers", view, "buffer", what);
        const auto size = *whole_number(document, buffer, "byteLength", what);
        const auto offset = whole_number(document, view, "byteOffset", what).value_or(0);
        const auto length = whole_number(document, view, "byteLength", what).value_or(0);
        if (length < 1 || offset > size || length > size - offset) {
            bad_file(document.file, what + " has " + std::to_string(length) + " bytes from byte " +
                                        std::to_string(offset) + ", its buffer has " + std::to_string(size));
        }
    }
    index = 0;
    for (const Json& image : array_of(document, "images")) {
        const std::string what = element_name("image", index++, "");
        if (!image.is_object()) bad_file(document.file, what + " is no object");
        if (image.contains("bufferView")) element_of(document, "bufferViews", image, "bufferView", what);
    }
}

/// The bytes of a buffer that Draco data lie in.
std::vector<unsigned char> buffer_bytes(const Document& document, const Json& buffer, const std::string& what)
{
    const std::size_t size = buffer["byteLength"].get<std::size_t>();
    std::vector<unsigned char> bytes;
    if (const auto uri = buffer.find("uri"); uri == buffer.end()) {
        bytes.assign(document.binary.begin(), document.binary.end());
    } else if (std::string mime; tinygltf::IsDataURI(uri->get<std::string>())) {
        tinygltf::DecodeDataURI(&bytes, mime, uri->get<std::string>(), 0, false);
    } else {
        bytes = read_file(external_path(document.file, uri->get<std::string>(), what), "buffer");
    }
    if (bytes.size() < size) bad_file(document.file, what + ": its buffer is shorter than its 'byteLength' says");
    return bytes;
}

/// Decodes once for the check alone: tinygltf decodes again, but would follow an attribute that the data
/// lack, or one of more than four components.
void check_draco(const Document& document, const Json& primitive, const Json& compressed, const std::string& what)
{
    const Json& view = element_of(document, "bufferViews", compressed, "bufferView", what);
    const Json& buffer = element_of(document, "buffers", view, "buffer", what);
    const Json& indices = element_of(document, "accessors", primitive, "indices", what);
    const std::vector<unsigned char> bytes = buffer_bytes(document, buffer, what);

    draco::DecoderBuffer data;
    data.Init(reinterpret_cast<const char*>(bytes.data()) + view.value("byteOffset", std::size_t{0}),
              view["byteLength"].get<std::size_t>());
    draco::Decoder decoder;
    const auto decoded = decoder.DecodeMeshFromBuffer(&data);
    if (!decoded.ok()) {
        bad_file(document.file, what + ": its Draco data cannot be decoded (" + decoded.status().error_msg() + ")");
    }
    const draco::Mesh& mesh = *decoded.value();
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
    }
}

void check_meshes(const Document& document)
{
    std::size_t index = 0;
    for (const Json& mesh : array_of(document, "meshes")) {
        const std::string mesh_name = element_name("mesh", index++, "");
        const auto primitives = mesh.is_object() ? mesh.find("primitives") : mesh.end();
        if (primitives == mesh.end() || !primitives->is_array()) {
            bad_file(document.file, mesh_name + " has no array of primitives");
        }
        std::size_t number = 0;
        for (const Json& primitive : *primitives) {
            const std::string what = mesh_name + ", primitive " + std::to_string(number++);
            if (!primitive.is_object() || !primitive.contains("attributes") ||
                !primitive["attributes"].is_object()) {
                bad_file(document.file, what + " has no attributes");
            }
            for (const auto& attribute : primitive["attributes"].items()) {
                element_of(document, "accessors", primitive["attributes"], attribute.key().c_str(), what);
            }
            if (primitive.contains("indices")) element_of(document, "accessors", primitive, "indices", what);
            const auto extensions = primitive.find("extensions");
            if (extensions == primitive.end() || !extensions->is_object()) continue;
            const auto compressed = extensions->find("KHR_draco_mesh_compression");
            if (compressed == extensions->end()) continue;
            if (!compressed->is_object()) bad_file(document.file, what + ": its Draco extension is no object");
            check_draco(document, primitive, *compressed, what);
        }
    }
}

}  // namespace

bool is_glb(const std::vector<unsigned char>& bytes)
{
    return bytes.size() >= 4 && std::memcmp(bytes.data(), "glTF", 4) == 0;
}

void check_gltf(const GltfFile& file, const std::vector<unsigned char>& bytes)
{
    const auto [text, binary] = is_glb(bytes) ? glb_chunks(file, bytes) : std::pair<Bytes, Bytes>{bytes, {}};
    const Document document{file, parse_json(file, text), binary};
    check_header(document);
    check_buffers(document);
    for (const Json& accessor : array_of(document, "accessors")) {
        if (!accessor.is_object()) bad_file(file, "'accessors' holds something that is no object");
    }
    check_meshes(document);
}

}  // namespace rcs
