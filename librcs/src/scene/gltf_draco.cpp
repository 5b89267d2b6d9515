#include "scene/gltf_draco.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

#include <draco/compression/decode.h>
#include <draco/compression/point_cloud/point_cloud_decoder.h>
#include <draco/core/varint_decoding.h>
#include <draco/metadata/metadata_decoder.h>

namespace rcs {
namespace {

// A flat regular grid, the simplest there is, takes a byte for some hundred triangles.
constexpr std::uint64_t kMostElementsPerByte = 4096;

/// The larger one of the numbers of faces and vertices that the data begin with: the decoder makes room for them at
/// once. 0 where they end before, or are no mesh: the decoder will say so.
std::uint64_t elements_promised(const GltfFile& file, const std::string& what, const char* bytes, std::size_t size)
{
    draco::DecoderBuffer data;
    data.Init(bytes, size);
    draco::DracoHeader header;
    if (!draco::PointCloudDecoder::DecodeHeader(&data, &header).ok()) return 0;
    const int version = DRACO_BITSTREAM_VERSION(header.version_major, header.version_minor);
    if (header.encoder_type != draco::TRIANGULAR_MESH || version != draco::kDracoMeshBitstreamVersion) {
        bad_file(file, what + ": its Draco data are of type " + std::to_string(header.encoder_type) + " and version " +
                           std::to_string(header.version_major) + "." + std::to_string(header.version_minor) +
                           ", expected a mesh, 1, and version 2.2");
    }
    data.set_bitstream_version(draco::kDracoMeshBitstreamVersion);
    if ((header.flags & METADATA_FLAG_MASK) != 0) {
        draco::GeometryMetadata metadata;
        if (!draco::MetadataDecoder().DecodeGeometryMetadata(&data, &metadata)) return 0;
    }
    // Edgebreaker: kind of traversal, vertices, faces. Sequential: faces, points.
    std::uint8_t traversal = 0;
    if (header.encoder_method == draco::MESH_EDGEBREAKER_ENCODING && !data.Decode(&traversal)) return 0;
    std::uint32_t first = 0, second = 0;
    if (!draco::DecodeVarint(&first, &data) || !draco::DecodeVarint(&second, &data)) return 0;
    return std::max(first, second);
}

}  // namespace

std::unique_ptr<draco::Mesh> decode_draco(const GltfFile& file, const std::string& what, const char* bytes,
                                          std::size_t size)
{
    const std::uint64_t elements = elements_promised(file, what, bytes, size);
    if (elements / kMostElementsPerByte > size) {
        bad_file(file, what + ": its Draco data promise " + std::to_string(elements) + " faces or vertices in " +
                           std::to_string(size) + " bytes");
    }
    draco::DecoderBuffer data;
    data.Init(bytes, size);
    draco::Decoder decoder;
    auto decoded = decoder.DecodeMeshFromBuffer(&data);
    if (!decoded.ok()) {
        bad_file(file, what + ": its Draco data cannot be decoded (" + decoded.status().error_msg() + ")");
    }
    return std::move(decoded).value();
}

}  // namespace rcs
