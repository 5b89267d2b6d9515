#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "scene/gltf_file.h"

namespace rcs {

using Json = nlohmann::json;
using Bytes = std::span<const unsigned char>;

/// A .gltf or .glb file as JSON, before tinygltf reads it.
struct GltfDocument {
    const GltfFile& file;
    Json root;     ///< of any content: gltf_check.h says what holds once it is checked
    Bytes binary;  ///< the second chunk of a .glb
};

/// @throws Error bad_file, unsupported: no glTF 2.0, damaged chunks, no JSON, JSON nested too deeply
GltfDocument read_document(const GltfFile& file, const std::vector<unsigned char>& bytes);

/// Whether the bytes begin like a .glb file.
bool is_glb(Bytes bytes);

/// JSON may write a whole number as 4.0: turns those where glTF has an index, a count or a constant into whole numbers.
/// @return whether there were any
bool make_indices_whole(GltfDocument& document);

/// The document as a .glb file.
std::vector<unsigned char> glb_bytes(const GltfDocument& document);

/// The elements of a top-level array; none if the file has no such array. @throws Error bad_file
const Json& array_of(const GltfDocument& document, const char* key);

/// The member, a whole number >= 0; nullopt if it is missing. @throws Error bad_file
std::optional<std::uint64_t> whole_number(const GltfDocument& document, const Json& object, const char* key,
                                          const std::string& what);

/// The element of array `key` that `object[member]` points to. @throws Error bad_file
const Json& element_of(const GltfDocument& document, const char* key, const Json& object, const char* member,
                       const std::string& what);

/// The extension `name` of `object`, an object; nullptr if it has none. @throws Error bad_file
const Json* extension_of(const GltfDocument& document, const Json& object, const char* name, const std::string& what);

}  // namespace rcs
