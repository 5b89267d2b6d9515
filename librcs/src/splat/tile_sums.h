#pragma once

#include <cstdint>

#include "radiance/lobes.h"
#include "splat/tiles.h"

namespace rcs {

/// Sums over the records at the pixels of a tile.
struct alignas(64) TileSums {
    static constexpr std::size_t kPixels = TiledSurfaces::kTilePixels;
    float r[kPixels], g[kPixels], b[kPixels], weight[kPixels], count[kPixels];
    float squares[kPixels], variance[kPixels], variance_of_sum[kPixels];
};

/// What glossy pixels add to a tile: their lobes as harmonics, row by row of 16, and the sums.
struct alignas(64) GlossyTile {
    static constexpr std::size_t kPixels = TiledSurfaces::kTilePixels;
    HarmonicLanes lobes[TiledSurfaces::kTile];
    float r[kPixels], g[kPixels], b[kPixels];
    bool lit[TiledSurfaces::kTile];  ///< rows that have a lobe
};
static_assert(TiledSurfaces::kTile == kHarmonicLanes);

/// The records that touch a tile.
struct TileRecords {
    const gpu::GpuRecord* records;
    const gpu::GpuRadiance* radiance;  ///< or null
    const std::uint32_t* begin;        ///< indices
    const std::uint32_t* end;
    int top;                 ///< row of the image where the tile begins
    std::uint32_t rows;      ///< a bit for each row in which something is seen
    bool is_packed = false;  ///< its rows are not the image's: any record may reach any of them
};

/// Adds them, in their order, to sums of weights alone, of light, or of light and what the error estimate takes.
void splat_tile_weights(const TiledSurfaces::Tile& tile, TileSums& sums, const TileRecords& from);
void splat_tile_light(const TiledSurfaces::Tile& tile, TileSums& sums, const TileRecords& from, GlossyTile* glossy);
void splat_tile_sums(const TiledSurfaces::Tile& tile, TileSums& sums, const TileRecords& from, GlossyTile* glossy);

}  // namespace rcs
