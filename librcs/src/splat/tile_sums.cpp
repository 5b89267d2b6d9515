#include "splat/tile_sums.h"

#include <algorithm>

#include "shared/weight.h"
#include "util/multiversion.h"

namespace rcs {
namespace {

constexpr int kRow = TiledSurfaces::kTile;

/// Sums one record's glossy light over one row.
RCS_ALWAYS_INLINE void splat_glossy_row(const float* weighted_r, const float* weighted_g, const float* weighted_b,
                                        const float* radiance, const HarmonicLanes& lobes, float* r, float* g, float* b)
{
    float dot_r[kRow] = {}, dot_g[kRow] = {}, dot_b[kRow] = {}, uniform[kRow] = {};
    for (int k = 0; k < kHarmonics; ++k) {
        const float lr = radiance[k], lg = radiance[kHarmonics + k], lb = radiance[2 * kHarmonics + k];
        const float lu = radiance[3 * kHarmonics + k];
        RCS_WHOLE_LOOP
        for (int i = 0; i < kRow; ++i) {
            dot_r[i] += lobes[k][i] * lr;
            dot_g[i] += lobes[k][i] * lg;
            dot_b[i] += lobes[k][i] * lb;
            uniform[i] += lobes[k][i] * lu;
        }
    }
    RCS_WHOLE_LOOP
    for (int i = 0; i < kRow; ++i) {
        const float scale = gpu::rcs_radiance_scale(uniform[i]);
        r[i] += weighted_r[i] * scale * gpu::max(0.0f, dot_r[i]);
        g[i] += weighted_g[i] * scale * gpu::max(0.0f, dot_g[i]);
        b[i] += weighted_b[i] * scale * gpu::max(0.0f, dot_b[i]);
    }
}

gpu::vec3 scalars(glm::vec4 v) { return {v.x, v.y, v.z}; }

/// What a splat sums up.
enum class Sums { weights, light, light_and_errors };

/// Sums one record over those of the rows [y0, y1) of the tile in which something is seen.
template <Sums kWhat>
RCS_ALWAYS_INLINE void splat_rows(const TiledSurfaces::Tile& t, TileSums& sums, const gpu::GpuRecord& record, int y0,
                                  int y1, std::uint32_t rows, GlossyTile* glossy, const gpu::GpuRadiance* radiance)
{
    const float kx = record.position.x, ky = record.position.y, kz = record.position.z;
    const float inv_radius = record.position.w, inv_normal = record.normal.w;
    // Copies: the compiler must know that the tile's sums do not overlap them.
    const glm::vec3 e(record.irradiance);
    const gpu::vec3 kn = scalars(record.normal);
    const gpu::vec3 gr[3] = {scalars(record.rotation_gradient[0]), scalars(record.rotation_gradient[1]),
                             scalars(record.rotation_gradient[2])};
    const gpu::vec3 gt[3] = {scalars(record.translation_gradient[0]), scalars(record.translation_gradient[1]),
                             scalars(record.translation_gradient[2])};
    const float per_unit = record.irradiance.w, variance = record.rotation_gradient[0].w;
    for (int y = y0; y < y1; ++y) {
        if ((rows >> y & 1u) == 0u) continue;
        const int row = y * kRow;
        float weights[kRow], weighted_r[kRow], weighted_g[kRow], weighted_b[kRow];
        int reached = 0;
        RCS_WHOLE_LOOP
        for (int l = 0; l < kRow; ++l) {
            const int i = row + l;
            const gpu::vec3 d{t.px[i] - kx, t.py[i] - ky, t.pz[i] - kz}, n{t.nx[i], t.ny[i], t.nz[i]};
            weights[l] = t.cover[i] * gpu::rcs_interpolation_weight(d, n, kn, inv_radius, inv_normal);
            reached |= weights[l] > 0.0f;
        }
        // Of the rectangle around the sphere's image, much is of other surfaces or beyond the rim.
        if (kWhat != Sums::weights && reached == 0) continue;
        RCS_WHOLE_LOOP
        for (int l = 0; l < kRow; ++l) {
            const int i = row + l;
            const float w = weights[l];
            sums.weight[i] += w;
            if constexpr (kWhat != Sums::weights) {
                const gpu::vec3 d{t.px[i] - kx, t.py[i] - ky, t.pz[i] - kz}, n{t.nx[i], t.ny[i], t.nz[i]};
                const gpu::vec3 turn{kn.y * n.z - kn.z * n.y, kn.z * n.x - kn.x * n.z, kn.x * n.y - kn.y * n.x};
                const float r = gpu::rcs_extrapolate(e.r, d, turn, gt[0], gr[0]);
                const float g = gpu::rcs_extrapolate(e.g, d, turn, gt[1], gr[1]);
                const float b = gpu::rcs_extrapolate(e.b, d, turn, gt[2], gr[2]);
                weighted_r[l] = w * r;
                weighted_g[l] = w * g;
                weighted_b[l] = w * b;
                sums.r[i] += weighted_r[l];
                sums.g[i] += weighted_g[l];
                sums.b[i] += weighted_b[l];
                if constexpr (kWhat == Sums::light_and_errors) {
                    const float luminance = per_unit * gpu::rcs_luminance(r, g, b);
                    sums.squares[i] += w * luminance * luminance;
                    sums.variance[i] += w * variance;
                    sums.variance_of_sum[i] += w * (w * variance);
                }
                sums.count[i] += w > 0.0f ? 1.0f : 0.0f;
            }
        }
        if (kWhat != Sums::weights && glossy && glossy->lit[y])
            splat_glossy_row(weighted_r, weighted_g, weighted_b, &radiance->coefficients[0].x, glossy->lobes[y],
                             glossy->r + row, glossy->g + row, glossy->b + row);
    }
}

template <Sums kWhat>
RCS_ALWAYS_INLINE void splat_tile(const TiledSurfaces::Tile& tile, TileSums& sums, const TileRecords& from,
                                  GlossyTile* glossy)
{
    for (const std::uint32_t* i = from.begin; i != from.end; ++i) {
        const gpu::GpuRecord& record = from.records[*i];
        const int y0 = from.is_packed ? 0 : std::max(record.pixels.y - from.top, 0);
        const int y1 = from.is_packed ? kRow : std::min(record.pixels.w - from.top, kRow);
        splat_rows<kWhat>(tile, sums, record, y0, y1, from.rows, glossy, glossy ? from.radiance + *i : nullptr);
    }
}

// Versions for several instruction sets would be seen outside of the library, were they not of this file alone.

RCS_MULTIVERSION
void add_weights_of(const TiledSurfaces::Tile& tile, TileSums& sums, const TileRecords& from)
{
    splat_tile<Sums::weights>(tile, sums, from, nullptr);
}

RCS_MULTIVERSION
void add_light_of(const TiledSurfaces::Tile& tile, TileSums& sums, const TileRecords& from, GlossyTile* glossy)
{
    splat_tile<Sums::light>(tile, sums, from, glossy);
}

RCS_MULTIVERSION
void add_all_of(const TiledSurfaces::Tile& tile, TileSums& sums, const TileRecords& from, GlossyTile* glossy)
{
    splat_tile<Sums::light_and_errors>(tile, sums, from, glossy);
}

}  // namespace

void splat_tile_weights(const TiledSurfaces::Tile& tile, TileSums& sums, const TileRecords& from)
{
    add_weights_of(tile, sums, from);
}

void splat_tile_light(const TiledSurfaces::Tile& tile, TileSums& sums, const TileRecords& from, GlossyTile* glossy)
{
    add_light_of(tile, sums, from, glossy);
}

void splat_tile_sums(const TiledSurfaces::Tile& tile, TileSums& sums, const TileRecords& from, GlossyTile* glossy)
{
    add_all_of(tile, sums, from, glossy);
}

}  // namespace rcs
