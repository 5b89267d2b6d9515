#include "scene/gltf_document.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <limits>
#include <string_view>
#include <utility>

namespace rcs {
namespace {

constexpr std::size_t kHeader = 12;
constexpr std::size_t kChunkHeader = 8;
constexpr std::uint32_t kMagic = 0x46546c67;  // "glTF"
constexpr std::uint32_t kJson = 0x4e4f534a;
constexpr std::uint32_t kBin = 0x004e4942;

std::uint32_t read_u32(Bytes bytes, std::size_t at)
{
    return std::uint32_t{bytes[at]} | std::uint32_t{bytes[at + 1]} << 8 | std::uint32_t{bytes[at + 2]} << 16 |
           std::uint32_t{bytes[at + 3]} << 24;
}

/// Splits a .glb into its two chunks. Layout: glTF 2.0, section 4.4.
std::pair<Bytes, Bytes> glb_chunks(const GltfFile& file, Bytes bytes)
{
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
            if (c == '\\')
                ++i;
            else if (c == '"')
                in_string = false;
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
    } catch (const Json::parse_error& e) {
        const std::string_view expected = "is no glTF file; expected .gltf or .glb, glTF 2.0";
        const auto begins = std::find_if(text.begin(), text.end(), [](unsigned char c) { return c > ' '; });
        if (begins == text.end() || *begins != '{') bad_file(file, std::string(expected));
        const auto line =
            std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(std::min(e.byte, text.size())), '\n') +
            1;
        bad_file(file, "is damaged: its JSON breaks off or goes wrong in line " + std::to_string(line) + " (byte " +
                           std::to_string(e.byte) + ")");
    } catch (const Json::exception&) {
        bad_file(file, "is no glTF file: its JSON holds a number that is out of range");
    }
}

void check_version(const GltfDocument& document)
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
}

/// Whether glTF has indices, counts or constants under a key, alone, in arrays, or as members of an object there.
bool has_whole_numbers(std::string_view key)
{
    static constexpr std::string_view kKeys[] = {
        "attributes", "buffer",        "bufferView", "byteLength", "byteOffset", "byteStride", "camera",
        "children",   "componentType", "count",      "index",      "indices",    "input",      "inverseBindMatrices",
        "joints",     "light",         "magFilter",  "material",   "mesh",       "minFilter",  "mode",
        "node",       "nodes",         "output",     "sampler",    "scene",      "skeleton",   "skin",
        "source",     "target",        "targets",    "texCoord",   "wrapS",      "wrapT"};
    return std::find(std::begin(kKeys), std::end(kKeys), key) != std::end(kKeys);
}

/// @param key  under which the value lies
bool make_whole(Json& value, std::string_view key)
{
    // Beyond, tinygltf has no whole numbers.
    constexpr double kMost = std::numeric_limits<std::int32_t>::max();
    bool changed = false;
    if (value.is_number_float() && has_whole_numbers(key)) {
        const double number = value.get<double>();
        changed = number >= 0.0 && number <= kMost && std::trunc(number) == number;
        if (changed) value = static_cast<std::uint32_t>(number);
    } else if (value.is_array()) {
        for (Json& element : value) changed = make_whole(element, key) || changed;
    } else if (value.is_object() && key != "extras") {
        const bool named_freely = key == "attributes" || key == "targets";
        for (auto& [name, member] : value.items()) changed = make_whole(member, named_freely ? key : name) || changed;
    }
    return changed;
}

}  // namespace

GltfDocument read_document(const GltfFile& file, const std::vector<unsigned char>& bytes)
{
    const auto [text, binary] = is_glb(bytes) ? glb_chunks(file, bytes) : std::pair<Bytes, Bytes>{bytes, {}};
    GltfDocument document{file, parse_json(file, text), binary};
    check_version(document);
    return document;
}

bool make_indices_whole(GltfDocument& document) { return make_whole(document.root, ""); }

bool is_glb(Bytes bytes) { return bytes.size() >= 4 && std::memcmp(bytes.data(), "glTF", 4) == 0; }

std::vector<unsigned char> glb_bytes(const GltfDocument& document)
{
    std::string text = document.root.dump(-1, ' ', false, Json::error_handler_t::replace);
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const std::size_t padded = (document.binary.size() + 3) / 4 * 4;
    const std::size_t size = kHeader + kChunkHeader + text.size() + (padded > 0 ? kChunkHeader + padded : 0);
    if (size > std::numeric_limits<std::uint32_t>::max()) {
        fail(document.file, ErrorCode::unsupported, "is larger than the 4 GiB that a .glb file can have");
    }
    std::vector<unsigned char> bytes;
    bytes.reserve(size);
    const auto add_u32 = [&](std::size_t value) {
        for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<unsigned char>(value >> shift & 0xff));
    };
    add_u32(kMagic);
    add_u32(2);
    add_u32(size);
    add_u32(text.size());
    add_u32(kJson);
    bytes.insert(bytes.end(), text.begin(), text.end());
    if (padded > 0) {
        add_u32(padded);
        add_u32(kBin);
        bytes.insert(bytes.end(), document.binary.begin(), document.binary.end());
        bytes.resize(size);
    }
    return bytes;
}

const Json& array_of(const GltfDocument& document, const char* key)
{
    static const Json empty = Json::array();
    const auto found = document.root.find(key);
    if (found == document.root.end()) return empty;
    if (!found->is_array()) bad_file(document.file, std::string("'") + key + "' is no array");
    return *found;
}

std::optional<std::uint64_t> whole_number(const GltfDocument& document, const Json& object, const char* key,
                                          const std::string& what)
{
    const auto found = object.find(key);
    if (found == object.end()) return std::nullopt;
    if (!found->is_number_unsigned()) bad_file(document.file, what + ": '" + key + "' is no whole number >= 0");
    return found->get<std::uint64_t>();
}

const Json& element_of(const GltfDocument& document, const char* key, const Json& object, const char* member,
                       const std::string& what)
{
    const Json& elements = array_of(document, key);
    const auto index = whole_number(document, object, member, what);
    if (!index || *index >= elements.size()) {
        bad_file(document.file, what + ": '" + member + "' is " + (index ? std::to_string(*index) : "missing") +
                                    ", expected an index below " + std::to_string(elements.size()) + " into '" + key +
                                    "'");
    }
    return elements[*index];
}

const Json* extension_of(const GltfDocument& document, const Json& object, const char* name, const std::string& what)
{
    const auto extensions = object.find("extensions");
    if (extensions == object.end()) return nullptr;
    if (!extensions->is_object()) bad_file(document.file, what + ": 'extensions' is no object");
    const auto found = extensions->find(name);
    if (found == extensions->end()) return nullptr;
    if (!found->is_object()) bad_file(document.file, what + ": its " + name + " is no object");
    return &*found;
}

}  // namespace rcs
