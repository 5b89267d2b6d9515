#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "scene/gltf_file.h"
#include "scene/tinygltf.h"

namespace rcs {

/// Contents of accessors as floats or indices, from every component type, stride and sparse form that
/// glTF has. Nothing outside a buffer view is read, and nothing is allocated before its size is known to
/// lie in the file.
/// @param what  names the accessor's user in messages: "mesh 0 'floor', primitive 1, POSITION"
/// @throws Error bad_file, unsupported
std::vector<glm::vec3> read_vec3(const GltfFile& file, const tinygltf::Model& model, int accessor,
                                 const std::string& what);
std::vector<glm::vec2> read_vec2(const GltfFile& file, const tinygltf::Model& model, int accessor,
                                 const std::string& what);
std::vector<glm::vec4> read_vec4(const GltfFile& file, const tinygltf::Model& model, int accessor,
                                 const std::string& what);
/// Of three or four components; the fourth is 1 where it is missing.
std::vector<glm::vec4> read_colors(const GltfFile& file, const tinygltf::Model& model, int accessor,
                                   const std::string& what);
std::vector<glm::mat4> read_mat4(const GltfFile& file, const tinygltf::Model& model, int accessor,
                                 const std::string& what);
std::vector<float> read_scalars(const GltfFile& file, const tinygltf::Model& model, int accessor,
                                const std::string& what);
/// Number of elements that it says it has. @throws Error bad_file if there is no such accessor
std::size_t accessor_count(const GltfFile& file, const tinygltf::Model& model, int accessor, const std::string& what);
std::vector<std::uint32_t> read_indices(const GltfFile& file, const tinygltf::Model& model, int accessor,
                                        const std::string& what);

/// The bytes of a buffer view.
std::span<const std::uint8_t> view_bytes(const GltfFile& file, const tinygltf::Model& model, int view,
                                         const std::string& what);

}  // namespace rcs
