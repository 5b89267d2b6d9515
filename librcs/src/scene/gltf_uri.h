#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "scene/gltf_file.h"

namespace rcs {

/// Path of a buffer or image. @throws Error bad_file unless `uri` is relative and what it names, links
/// followed, lies in the scene's folder
std::filesystem::path external_path(const GltfFile& file, const std::string& uri, const std::string& what);

/// What a URI stands for: data that it holds itself (RFC 2397, base64 or percent-encoded), or a file.
/// @throws Error bad_file, not_found, io
std::vector<unsigned char> uri_bytes(const GltfFile& file, const std::string& uri, const std::string& what);

}  // namespace rcs
