#include "splat/tiles.h"

#include <algorithm>
#include <memory>

#include "gbuffer/shading.h"
#include "radiance/lobes.h"
#include "shared/gpu_record.h"
#include "shared/weight.h"
#include "splat/gpu_records.h"
#include "util/multiversion.h"

namespace rcs {
namespace {

constexpr int kTile = TiledSurfaces::kTile;
constexpr std::size_t kTilePixels = TiledSurfaces::kTilePixels;

template <typename Visit>
void for_each_tile(const gpu::GpuRecord& record, int tiles_x, const Visit& visit)
{
    for (int y = record.pixels.y / kTile; y <= (record.pixels.w - 1) / kTile; ++y)
        for (int x = record.pixels.x / kTile; x <= (record.pixels.z - 1) / kTile; ++x)
            visit(static_cast<std::size_t>(y * tiles_x + x));
}

GpuRecords make_gpu_records(std::span<const Record> records, glm::dvec3 camera, const View& view,
                            const SplatSettings& options, bool with_radiance, float unit, ThreadPool& pool)
{
    constexpr std::size_t kChunk = 2048;
    std::vector<GpuRecords> chunks((records.size() + kChunk - 1) / kChunk);
    pool.parallel_for(records.size(), kChunk, [&](std::size_t begin, std::size_t end, int) {
        append_gpu_records(records.subspan(begin, end - begin), camera, view, options, with_radiance, unit,
                           chunks[begin / kChunk]);
    });
    GpuRecords all;
    all.records.reserve(records.size());
    for (const GpuRecords& chunk : chunks) {
        all.records.insert(all.records.end(), chunk.records.begin(), chunk.records.end());
        all.radiance.insert(all.radiance.end(), chunk.radiance.begin(), chunk.radiance.end());
    }
    return all;
}

struct alignas(64) TileSums {
    float r[kTilePixels], g[kTilePixels], b[kTilePixels], weight[kTilePixels], count[kTilePixels];
    float squares[kTilePixels], variance[kTilePixels], variance_of_sum[kTilePixels];
};

/// What glossy pixels add to a tile: their lobes as harmonics, row by row of 16, and the sums.
struct alignas(64) GlossyTile {
    HarmonicLanes lobes[kTile];
    float r[kTilePixels], g[kTilePixels], b[kTilePixels];
    bool lit[kTile];  // rows that have a lobe
};
static_assert(kTile == kHarmonicLanes);

/// Sums one record's glossy light over one row.
RCS_ALWAYS_INLINE void splat_glossy_row(const float* weighted_r, const float* weighted_g, const float* weighted_b,
                                        const float* radiance, const HarmonicLanes& lobes, float* r, float* g, float* b)
{
    float dot_r[kTile] = {}, dot_g[kTile] = {}, dot_b[kTile] = {}, uniform[kTile] = {};
    for (int k = 0; k < kHarmonics; ++k) {
        const float lr = radiance[k], lg = radiance[kHarmonics + k], lb = radiance[2 * kHarmonics + k];
        const float lu = radiance[3 * kHarmonics + k];
        RCS_WHOLE_LOOP
        for (int i = 0; i < kTile; ++i) {
            dot_r[i] += lobes[k][i] * lr;
            dot_g[i] += lobes[k][i] * lg;
            dot_b[i] += lobes[k][i] * lb;
            uniform[i] += lobes[k][i] * lu;
        }
    }
    RCS_WHOLE_LOOP
    for (int i = 0; i < kTile; ++i) {
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
        const int row = y * kTile;
        float weighted_r[kTile], weighted_g[kTile], weighted_b[kTile];
        int reached = 0;
        for (int i = row; i < row + kTile; ++i) {
            const gpu::vec3 d{t.px[i] - kx, t.py[i] - ky, t.pz[i] - kz}, n{t.nx[i], t.ny[i], t.nz[i]};
            const float w = t.cover[i] * gpu::rcs_interpolation_weight(d, n, kn, inv_radius, inv_normal);
            sums.weight[i] += w;
            if constexpr (kWhat != Sums::weights) {
                const gpu::vec3 turn{kn.y * n.z - kn.z * n.y, kn.z * n.x - kn.x * n.z, kn.x * n.y - kn.y * n.x};
                const float r = gpu::rcs_extrapolate(e.r, d, turn, gt[0], gr[0]);
                const float g = gpu::rcs_extrapolate(e.g, d, turn, gt[1], gr[1]);
                const float b = gpu::rcs_extrapolate(e.b, d, turn, gt[2], gr[2]);
                weighted_r[i - row] = w * r;
                weighted_g[i - row] = w * g;
                weighted_b[i - row] = w * b;
                sums.r[i] += weighted_r[i - row];
                sums.g[i] += weighted_g[i - row];
                sums.b[i] += weighted_b[i - row];
                if constexpr (kWhat == Sums::light_and_errors) {
                    const float l = per_unit * gpu::rcs_luminance(r, g, b);
                    sums.squares[i] += w * l * l;
                    sums.variance[i] += w * variance;
                    sums.variance_of_sum[i] += w * (w * variance);
                }
                sums.count[i] += w > 0.0f ? 1.0f : 0.0f;
                reached |= w > 0.0f;
            }
        }
        if (kWhat != Sums::weights && glossy && glossy->lit[y] && reached != 0)
            splat_glossy_row(weighted_r, weighted_g, weighted_b, &radiance->coefficients[0].x, glossy->lobes[y],
                             glossy->r + row, glossy->g + row, glossy->b + row);
    }
}

/// The records that touch a tile.
struct TileRecords {
    const gpu::GpuRecord* records;
    const gpu::GpuRadiance* radiance;  // or null
    const std::uint32_t* begin;        // indices
    const std::uint32_t* end;
    int top;  // row of the image where the tile begins
    std::uint32_t rows;
};

template <Sums kWhat>
RCS_ALWAYS_INLINE void splat_tile(const TiledSurfaces::Tile& tile, TileSums& sums, const TileRecords& from,
                                  GlossyTile* glossy)
{
    for (const std::uint32_t* i = from.begin; i != from.end; ++i) {
        const gpu::GpuRecord& record = from.records[*i];
        splat_rows<kWhat>(tile, sums, record, std::max(record.pixels.y - from.top, 0),
                          std::min(record.pixels.w - from.top, kTile), from.rows, glossy,
                          glossy ? from.radiance + *i : nullptr);
    }
}

RCS_MULTIVERSION
void splat_tile_sums(const TiledSurfaces::Tile& tile, TileSums& sums, const TileRecords& from, GlossyTile* glossy)
{
    splat_tile<Sums::light_and_errors>(tile, sums, from, glossy);
}

RCS_MULTIVERSION
void splat_tile_light(const TiledSurfaces::Tile& tile, TileSums& sums, const TileRecords& from, GlossyTile* glossy)
{
    splat_tile<Sums::light>(tile, sums, from, glossy);
}

RCS_MULTIVERSION
void splat_tile_weights(const TiledSurfaces::Tile& tile, TileSums& sums, const TileRecords& from)
{
    splat_tile<Sums::weights>(tile, sums, from, nullptr);
}

/// Calls visit(pixel in the image, pixel in the tile) for the part of tile `t` inside the image.
template <typename Visit>
void for_each_pixel(const TiledSurfaces& s, std::size_t t, const Visit& visit)
{
    const int left = static_cast<int>(t % static_cast<std::size_t>(s.tiles_x)) * kTile;
    const int top = static_cast<int>(t / static_cast<std::size_t>(s.tiles_x)) * kTile;
    for (int y = top; y < std::min(top + kTile, s.height); ++y)
        for (int x = left; x < std::min(left + kTile, s.width); ++x)
            visit(static_cast<std::size_t>(y) * static_cast<std::size_t>(s.width) + static_cast<std::size_t>(x),
                  static_cast<std::size_t>((y - top) * kTile + (x - left)));
}

/// Calls visit(tile, its records) for every tile that records touch, if something is seen in it.
template <typename Visit>
void for_each_busy_tile(const TiledSurfaces& surfaces, const GpuRecords& from, ThreadPool& pool, const Visit& visit)
{
    const TileBins bins = bin_records(from.records, surfaces.tiles_x, surfaces.rows);
    pool.parallel_for(surfaces.tiles.size(), 4, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t t = begin; t < end; ++t) {
            if (bins.first[t] == bins.first[t + 1]) continue;
            const int top = static_cast<int>(t / static_cast<std::size_t>(surfaces.tiles_x)) * kTile;
            visit(t, TileRecords{from.records.data(), from.radiance.data(), bins.records.data() + bins.first[t],
                                 bins.records.data() + bins.first[t + 1], top, surfaces.rows[t]});
        }
    });
}

/// Lobes of the tile's pixels; false if none of them is lit by records.
bool find_lobes(const TiledSurfaces& surfaces, std::size_t t, const Camera& camera, const Shading& shading,
                GlossyTile& tile)
{
    const Lobe* lobes[kTilePixels] = {};
    glm::vec3 normals[kTilePixels], outgoing[kTilePixels];
    const TiledSurfaces::Tile& s = surfaces.tiles[t];
    const glm::vec3 parallel(glm::normalize(glm::dvec3(camera.world_from_view[2])));
    bool any = false;
    std::fill(tile.lit, tile.lit + kTile, false);
    for_each_pixel(surfaces, t, [&](std::size_t from, std::size_t to) {
        if (s.cover[to] == 0.0f || !(lobes[to] = shading.recorded(from))) return;
        normals[to] = {s.nx[to], s.ny[to], s.nz[to]};
        outgoing[to] = camera.projection == Projection::orthographic
                           ? parallel
                           : -glm::normalize(glm::vec3(s.px[to], s.py[to], s.pz[to]));
        tile.lit[to / kTile] = any = true;
    });
    for (std::size_t row = 0; row < kTile; ++row)
        if (tile.lit[row])
            evaluate_lobes(lobes + row * kTile, normals + row * kTile, outgoing + row * kTile, tile.lobes[row]);
    for (float* sums : {tile.r, tile.g, tile.b}) std::fill(sums, sums + kTilePixels, 0.0f);
    return any;
}

}  // namespace

TileBins bin_records(std::span<const gpu::GpuRecord> records, int tiles_x, std::span<const std::uint16_t> rows)
{
    TileBins bins;
    bins.first.assign(rows.size() + 1, 0);
    for (const gpu::GpuRecord& record : records)
        for_each_tile(record, tiles_x, [&](std::size_t tile) { bins.first[tile + 1] += rows[tile] != 0 ? 1 : 0; });
    for (std::size_t tile = 1; tile < bins.first.size(); ++tile) bins.first[tile] += bins.first[tile - 1];
    bins.records.resize(bins.first.back());
    std::vector<std::uint32_t> next(bins.first.begin(), bins.first.end() - 1);
    for (std::uint32_t i = 0; i < records.size(); ++i)
        for_each_tile(records[i], tiles_x, [&](std::size_t tile) {
            if (rows[tile] != 0) bins.records[next[tile]++] = i;
        });
    return bins;
}

TiledSurfaces make_tiled_surfaces(const GBuffer& g, ThreadPool& pool)
{
    TiledSurfaces s;
    s.width = g.width;
    s.height = g.height;
    s.tiles_x = (g.width + kTile - 1) / kTile;
    s.tiles_y = (g.height + kTile - 1) / kTile;
    s.camera_position = g.camera_position;
    s.tiles.resize(static_cast<std::size_t>(s.tiles_x) * static_cast<std::size_t>(s.tiles_y));
    s.rows.assign(s.tiles.size(), 0);
    static_assert(kTile <= 16);
    pool.parallel_for(s.tiles.size(), 16, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t t = begin; t < end; ++t) {
            TiledSurfaces::Tile& tile = s.tiles[t];
            for_each_pixel(s, t, [&](std::size_t from, std::size_t to) {
                tile.px[to] = g.position_x[from];
                tile.py[to] = g.position_y[from];
                tile.pz[to] = g.position_z[from];
                tile.nx[to] = g.normal_x[from];
                tile.ny[to] = g.normal_y[from];
                tile.nz[to] = g.normal_z[from];
                tile.cover[to] = g.covered(from) ? 1.0f : 0.0f;
                if (g.covered(from)) s.rows[t] |= static_cast<std::uint16_t>(1u << to / kTile);
            });
        }
    });
    return s;
}

void add_weights(std::span<const Record> records, const TiledSurfaces& surfaces, const View& view,
                 const SplatSettings& options, ThreadPool& pool, std::vector<float>& weight)
{
    const GpuRecords from = make_gpu_records(records, surfaces.camera_position, view, options, false, 1.0f, pool);
    for_each_busy_tile(surfaces, from, pool, [&](std::size_t t, const TileRecords& in_tile) {
        TileSums sums{};
        splat_tile_weights(surfaces.tiles[t], sums, in_tile);
        for_each_pixel(surfaces, t, [&](std::size_t to, std::size_t at) { weight[to] += sums.weight[at]; });
    });
}

SplatBuffer splat_tiles(std::span<const Record> records, const TiledSurfaces& surfaces, const View& view,
                        const SplatSettings& options, ThreadPool& pool, SplatStats& stats, const Shading* glossy)
{
    SplatBuffer out;
    out.width = surfaces.width;
    out.height = surfaces.height;
    const std::size_t pixels = static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height);
    for (auto* plane : {&out.weighted_r, &out.weighted_g, &out.weighted_b, &out.weight, &out.count})
        plane->assign(pixels, 0.0f);
    if (options.error_sums)
        for (auto* plane : {&out.squares, &out.variance, &out.variance_of_sum}) plane->assign(pixels, 0.0f);
    out.luminance_unit = luminance_unit(records);
    if (glossy)
        for (auto* plane : {&out.glossy_r, &out.glossy_g, &out.glossy_b}) plane->assign(pixels, 0.0f);
    const GpuRecords from =
        make_gpu_records(records, surfaces.camera_position, view, options, glossy != nullptr, out.luminance_unit, pool);
    stats.splats += from.records.size();
    for (const gpu::GpuRecord& r : from.records)
        stats.samples +=
            static_cast<std::uint64_t>(r.pixels.z - r.pixels.x) * static_cast<std::uint64_t>(r.pixels.w - r.pixels.y);
    for_each_busy_tile(surfaces, from, pool, [&](std::size_t t, const TileRecords& in_tile) {
        TileSums sums{};
        const auto lobes = glossy ? std::make_unique<GlossyTile>() : nullptr;
        const bool lit = glossy && find_lobes(surfaces, t, view.camera, *glossy, *lobes);
        (options.error_sums ? splat_tile_sums : splat_tile_light)(surfaces.tiles[t], sums, in_tile,
                                                                  lit ? lobes.get() : nullptr);
        for_each_pixel(surfaces, t, [&](std::size_t to, std::size_t at) {
            out.weighted_r[to] = sums.r[at];
            out.weighted_g[to] = sums.g[at];
            out.weighted_b[to] = sums.b[at];
            out.weight[to] = sums.weight[at];
            out.count[to] = sums.count[at];
            if (options.error_sums) {
                out.squares[to] = sums.squares[at];
                out.variance[to] = sums.variance[at];
                out.variance_of_sum[to] = sums.variance_of_sum[at];
            }
            if (lit) {
                out.glossy_r[to] = lobes->r[at];
                out.glossy_g[to] = lobes->g[at];
                out.glossy_b[to] = lobes->b[at];
            }
        });
    });
    return out;
}

SplatBuffer splat_tiles(const std::vector<Record>& records, const GBuffer& gbuffer, const View& view,
                        const SplatSettings& options, ThreadPool& pool, SplatStats& stats, const Shading* glossy)
{
    return splat_tiles(records, make_tiled_surfaces(gbuffer, pool), view, options, pool, stats, glossy);
}

}  // namespace rcs
