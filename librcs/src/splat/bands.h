#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "gl/gl_objects.h"
#include "gl/program.h"
#include "rcs/splat.h"
#include "splat/gpu_records.h"

namespace rcs {

/// What splats on the device read and write: buffers of the width of the image and the height of a band of it.
struct BandBuffers {
    GlTexture positions, normals, sums, counts;
    GlTexture errors;  ///< only if they are estimated
    GlTexture glossy;  ///< only with glossy light, like the next three
    GlTexture kinds;   ///< of lobes
    GlBuffer fits, lobes;
    GlFramebuffer framebuffer;  ///< of sums, counts, errors and glossy light
};
BandBuffers make_band_buffers(const std::string& stage, int width, int rows, bool glossy, bool with_errors);

/// Records on the device: so many at a time as a storage block holds.
struct RecordBlocks {
    GlBuffer records, radiance;
    std::size_t most = 0;
};
/// @param from  at least one
RecordBlocks make_record_blocks(const GpuRecords& from, std::size_t block_bytes);
/// Brings the records [first, first + count) there, and binds them.
void upload_records(const GpuRecords& from, std::size_t first, std::size_t count, const RecordBlocks& blocks);

/// Empty sums, and the records that reach the image; counts them.
struct SplatTask {
    const std::vector<Record>& records;
    const GBuffer& gbuffer;
    const View& view;
    const SplatSettings& options;
    bool glossy;
};
SplatBuffer begin_splat(const SplatTask& task, ThreadPool& pool, GpuRecords& from, SplatStats& stats);

/// A storage block is at most so large: what the driver has, and no more than is of use.
std::size_t most_block_bytes();

/// Rows of the image at a time. @throws Error unsupported: the GL's limit on the size of an image
int rows_of_band(const GBuffer& gbuffer, bool glossy, std::size_t block_bytes);

void upload_gbuffer(const GBuffer& gbuffer, int first_row, int rows, const BandBuffers& buffers, ThreadPool& pool);
/// What of a view shines by lobes.
struct LobedView {
    const GBuffer& gbuffer;
    const View& view;
    const Shading& shading;
};
/// Makes the lobes' coefficients on the device, from what upload_gbuffer() brought there. Another program is in use
/// afterwards.
void lay_lobes(GlContext& gl, const LobedView& lobed, int first_row, int rows, const BandBuffers& buffers,
               ThreadPool& pool);

/// What shaders of splats are compiled with for these buffers.
ShaderDefines splat_variant(const BandBuffers& buffers);
/// Binds what they read, for the program in use, and the framebuffer.
void bind_inputs(const GBuffer& gbuffer, const BandBuffers& buffers);
/// Copies a band of the framebuffer that is bound into the sums of the whole image.
void read_back(int first_row, int rows, ThreadPool& pool, SplatBuffer& splats);

}  // namespace rcs
