#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "rcs/splat.h"
#include "shared/gpu_record.h"

namespace rcs {

/// The G-buffer's visible points, tile by tile, next to each other in the cache: made once for many splats.
struct TiledSurfaces {
    static constexpr int kTile = 16;  ///< [px]; a row is one AVX-512 vector of floats, two AVX ones, four SSE ones
    static constexpr std::size_t kTilePixels = kTile * kTile;

    struct alignas(64) Tile {
        float px[kTilePixels], py[kTilePixels], pz[kTilePixels];  ///< relative to the camera [m]
        float nx[kTilePixels], ny[kTilePixels], nz[kTilePixels];
        float cover[kTilePixels];  ///< 1 where a surface is seen, else 0

        /// Puts what a pixel of the image sees in a place of the tile.
        void put(std::size_t place, const GBuffer& g, std::size_t pixel)
        {
            px[place] = g.position_x[pixel];
            py[place] = g.position_y[pixel];
            pz[place] = g.position_z[pixel];
            nx[place] = g.normal_x[pixel];
            ny[place] = g.normal_y[pixel];
            nz[place] = g.normal_z[pixel];
            cover[place] = g.covered(pixel) ? 1.0f : 0.0f;
        }
    };
    int width = 0, height = 0;  ///< of the image [px]
    int tiles_x = 0, tiles_y = 0;
    glm::dvec3 camera_position{0.0};
    std::vector<Tile> tiles;
    std::vector<std::uint16_t> rows;  ///< per tile, a bit for each row in which a surface is seen
};
TiledSurfaces make_tiled_surfaces(const GBuffer& gbuffer, ThreadPool& pool);

/// Which records touch each tile in which something is seen, in record order: a counting sort by tile.
struct TileBins {
    std::vector<std::uint32_t> first;    ///< per tile, and one more
    std::vector<std::uint32_t> records;  ///< indices, tile after tile
};
/// @param rows  TiledSurfaces::rows, of which 0 leaves a tile out
TileBins bin_records(std::span<const gpu::GpuRecord> records, int tiles_x, std::span<const std::uint16_t> rows,
                     ThreadPool& pool);

/// Adds the records' weights alone, for finding holes: one sum per pixel, row by row.
void add_weights(std::span<const Record> records, const TiledSurfaces& surfaces, const View& view,
                 const SplatSettings& options, ThreadPool& pool, std::vector<float>& weight);

/// Adds those of records of make_gpu_record(), in some rows alone. @param rows  of tiles, of TiledSurfaces::rows
void add_weights(std::span<const gpu::GpuRecord> records, const TiledSurfaces& surfaces,
                 std::span<const std::uint16_t> rows, ThreadPool& pool, std::vector<float>& weight);
/// Marks the rows in which a record may weigh something. @param rows  of tiles, as TiledSurfaces::rows
void add_rows(const gpu::GpuRecord& record, const TiledSurfaces& surfaces, std::span<std::uint16_t> rows);
/// Sets the weights of those rows to 0.
void clear_rows(const TiledSurfaces& surfaces, std::span<const std::uint16_t> rows, std::vector<float>& weight);

/// splat_tiles() of splat.h, on surfaces that are tiled already.
SplatBuffer splat_tiles(std::span<const Record> records, const TiledSurfaces& surfaces, const View& view,
                        const SplatSettings& options, ThreadPool& pool, SplatStats& stats,
                        const Shading* glossy = nullptr);

}  // namespace rcs
