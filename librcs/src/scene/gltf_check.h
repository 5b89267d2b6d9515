#pragma once

#include <string>
#include <vector>

#include "scene/gltf_animation.h"
#include "scene/gltf_document.h"
#include "scene/gltf_meshopt.h"

namespace rcs {

/// A checked file as tinygltf is to read it. URIs are taken out of it: those of buffers are replaced by
/// kBufferUri and their number, those of images by kImageUri and theirs.
struct GltfSource {
    struct Buffer {
        std::string uri;       ///< empty: the .glb's second chunk
        std::size_t size = 0;  ///< [bytes]
        bool absent = false;   ///< holds nothing: without a URI, or EXT_meshopt_compression's fallback
    };
    std::vector<unsigned char> bytes;
    std::vector<Buffer> buffers;
    std::vector<std::string> image_uris;  ///< empty: in a buffer view
    std::vector<PackedView> packed_views;
};
inline constexpr const char* kBufferUri = "rcs-buffer-";
inline constexpr const char* kImageUri = "rcs-image-";

/// Looks at a .gltf or .glb file before tinygltf does, which trusts a file in places: everything that it
/// would follow without a check (chunk lengths, buffer views, Draco attributes, types) is checked here.
/// @param properties  that take the place of what the file says
/// @throws Error bad_file, unsupported
GltfSource check_gltf(const GltfFile& file, std::vector<unsigned char> bytes,
                      const std::vector<PosedProperty>& properties);

/// Contents of a buffer as it is stored, exactly `size` bytes. @throws Error bad_file, not_found, io
std::vector<unsigned char> buffer_bytes(const GltfFile& file, const GltfSource::Buffer& buffer, Bytes binary,
                                        const std::string& what);

}  // namespace rcs
