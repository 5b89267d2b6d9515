#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "scene/gltf_document.h"
#include "scene/tinygltf.h"

namespace rcs {

/// A buffer view whose contents EXT_meshopt_compression packs.
struct PackedView {
    enum class Mode { attributes, triangles, indices };
    enum class Filter { none, octahedral, quaternion, exponential };
    std::size_t view = 0;
    std::size_t buffer = 0, offset = 0, length = 0;  ///< where the packed bytes lie
    std::size_t stride = 0, count = 0;               ///< of the elements in them
    Mode mode = Mode::attributes;
    Filter filter = Filter::none;
};

/// The extension of a buffer view; checked, but for the packed bytes themselves.
/// @throws Error bad_file
PackedView packed_view(const GltfDocument& document, const Json& extension, std::size_t view, const std::string& what);

/// Unpacks the views into buffers of their own. @throws Error bad_file
void unpack_views(const GltfFile& file, const std::vector<PackedView>& views, tinygltf::Model& model);

}  // namespace rcs
