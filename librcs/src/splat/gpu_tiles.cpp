#include "splat/gpu_tiles.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <utility>

#include "gl/gl_context_impl.h"
#include "shared/bindings.h"
#include "splat/bands.h"
#include "splat/gpu_records.h"
#include "splat/tiles.h"

namespace rcs {
namespace {

const std::string kTilesStage = "splatting tiles on the device";

constexpr int kGroupTile = RCS_SPLAT_TILE;
static_assert(kGroupTile == TiledSurfaces::kTile);

// Of a part: llvmpipe ends any loop of a shader after 65,535 rounds without a word, and a driver that waits too long
// for one a program.
constexpr std::size_t kMostInPart = std::size_t{1} << 15;

/// Records that are on the device at a time, and the tiles that they touch.
struct Part {
    std::size_t first, count;
    TileBins bins;
};

std::size_t tiles_of(const gpu::GpuRecord& record)
{
    const auto across = (record.pixels.z - 1) / kGroupTile - record.pixels.x / kGroupTile + 1;
    const auto down = (record.pixels.w - 1) / kGroupTile - record.pixels.y / kGroupTile + 1;
    return static_cast<std::size_t>(across) * static_cast<std::size_t>(down);
}

/// @param most_in_tiles  pairs of record and tile in a part, if it has more than one record
std::vector<Part> make_parts(const std::vector<gpu::GpuRecord>& records, glm::ivec2 tiles, std::size_t most_records,
                             std::size_t most_in_tiles, ThreadPool& pool)
{
    // What is seen in a tile the shader finds out.
    const std::vector<std::uint16_t> rows(static_cast<std::size_t>(tiles.x) * static_cast<std::size_t>(tiles.y), 1);
    std::vector<Part> parts;
    for (std::size_t first = 0, end = 0; first < records.size(); first = end) {
        for (std::size_t in_tiles = 0; end < records.size() && end - first < most_records; ++end) {
            in_tiles += tiles_of(records[end]);
            if (end > first && in_tiles > most_in_tiles) break;
        }
        parts.push_back(
            {first, end - first, bin_records(std::span(records).subspan(first, end - first), tiles.x, rows, pool)});
    }
    return parts;
}

/// Where parts lie on the device, each in its turn.
struct PartBuffers {
    RecordBlocks records;
    GlBuffer tiles, in_tiles;
};

PartBuffers make_part_buffers(const std::vector<Part>& parts, RecordBlocks records)
{
    std::size_t in_tiles = 0;
    for (const Part& part : parts) in_tiles = std::max(in_tiles, part.bins.records.size());
    const auto bytes = [](std::size_t words) { return static_cast<GLsizeiptr>(words * sizeof(std::uint32_t)); };
    return {std::move(records), make_buffer(bytes(parts.front().bins.first.size())), make_buffer(bytes(in_tiles))};
}

void upload_words(const std::vector<std::uint32_t>& words, GLuint binding, const GlBuffer& to)
{
    glNamedBufferSubData(to.id(), 0, static_cast<GLsizeiptr>(words.size() * sizeof(std::uint32_t)), words.data());
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, to.id());
}

void bind_targets(const BandBuffers& buffers)
{
    const std::array<std::pair<GLuint, const GlTexture*>, 3> wide = {{{RCS_SPLAT_TARGET_SUMS, &buffers.sums},
                                                                      {RCS_SPLAT_TARGET_ERROR, &buffers.errors},
                                                                      {RCS_SPLAT_TARGET_GLOSSY, &buffers.glossy}}};
    for (const auto& [unit, texture] : wide)
        if (texture->id() != 0) glBindImageTexture(unit, texture->id(), 0, GL_FALSE, 0, GL_READ_WRITE, GL_RGBA32F);
    glBindImageTexture(RCS_SPLAT_TARGET_COUNT, buffers.counts.id(), 0, GL_FALSE, 0, GL_READ_WRITE, GL_R32F);
}

/// Sums all parts over the rows [first_row, first_row + rows) of the image.
void splat_band(const GpuRecords& from, const std::vector<Part>& parts, const PartBuffers& to, int tiles_x,
                int first_row, int rows)
{
    const int tile_rows = (first_row + rows - 1) / kGroupTile - first_row / kGroupTile + 1;
    for (const Part& part : parts) {
        glUniform3i(RCS_SPLAT_UNIFORM_BAND, first_row, rows, part.first == 0 ? 1 : 0);
        upload_records(from, part.first, part.count, to.records);
        upload_words(part.bins.first, RCS_SPLAT_BUFFER_TILES, to.tiles);
        upload_words(part.bins.records, RCS_SPLAT_BUFFER_IN_TILES, to.in_tiles);
        glDispatchCompute(static_cast<GLuint>(tiles_x), static_cast<GLuint>(tile_rows), 1);
        glMemoryBarrier(GL_SHADER_IMAGE_ACCESS_BARRIER_BIT | GL_FRAMEBUFFER_BARRIER_BIT);
    }
}

}  // namespace

SplatBuffer splat_gpu_tiles(const TileDevice& device, const std::vector<Record>& records, const GBuffer& gbuffer,
                            const View& view, const SplatSettings& options, SplatStats& stats, const Shading* glossy)
{
    const bool has_lobes = glossy != nullptr;
    GpuRecords from;
    SplatBuffer splats = begin_splat({records, gbuffer, view, options, has_lobes}, device.pool, from, stats);
    if (gbuffer.size() == 0 || from.records.empty()) return splats;

    device.gl.impl().make_current();
    const std::size_t block_bytes = std::min(device.block_bytes, most_block_bytes());
    const glm::ivec2 tiles((gbuffer.width + kGroupTile - 1) / kGroupTile,
                           (gbuffer.height + kGroupTile - 1) / kGroupTile);
    const int max_rows = rows_of_band(gbuffer, has_lobes, block_bytes);
    const BandBuffers buffers = make_band_buffers(kTilesStage, gbuffer.width, max_rows, has_lobes, options.error_sums);
    RecordBlocks blocks = make_record_blocks(from, block_bytes);
    const std::vector<Part> parts = make_parts(from.records, tiles, std::min(blocks.most, kMostInPart),
                                               block_bytes / sizeof(std::uint32_t), device.pool);
    const PartBuffers part_buffers = make_part_buffers(parts, std::move(blocks));
    const GLuint program = device.gl.impl().compute_program("splat_tiles.comp", splat_variant(buffers));
    for (int first_row = 0; first_row < gbuffer.height; first_row += max_rows) {
        const int rows = std::min(max_rows, gbuffer.height - first_row);
        upload_gbuffer(gbuffer, first_row, rows, buffers, device.pool);
        if (has_lobes) lay_lobes(device.gl, {gbuffer, view, *glossy}, first_row, rows, buffers, device.pool);
        glUseProgram(program);
        bind_inputs(gbuffer, buffers);
        bind_targets(buffers);
        splat_band(from, parts, part_buffers, tiles.x, first_row, rows);
        read_back(first_row, rows, device.pool, splats);
    }
    check_gl(kTilesStage);
    return splats;
}

SplatBuffer splat_gpu_tiles(GlContext& gl, const std::vector<Record>& records, const GBuffer& gbuffer, const View& view,
                            const SplatSettings& options, ThreadPool& pool, SplatStats& stats, const Shading* glossy)
{
    return splat_gpu_tiles({gl, pool, std::numeric_limits<std::size_t>::max()}, records, gbuffer, view, options, stats,
                           glossy);
}

}  // namespace rcs
