#pragma once

#include <functional>
#include <string>

#include "rcs/scene.h"

namespace rcs::stability {

/// Writes geometry, untextured materials, instances, punctual lights and cameras as a binary glTF file.
/// @return what the file lacks of the scene, in words; "" if nothing
/// @throws Error io
std::string export_glb(const Scene& scene, const std::string& path);

/// Puts a glTF document and its buffer, which may be empty, into one file.
/// @throws Error io
void write_glb(std::string json, const std::string& binary, const std::string& path);

/// Passes the document of a binary glTF file through `change`.
/// @throws Error io
void rewrite_glb(const std::string& path, const std::function<std::string(std::string)>& change);

}  // namespace rcs::stability
