#include "splat/tiles.h"

#include <algorithm>
#include <cstdint>

#include "shared/gpu_record.h"
#include "shared/weight.h"
#include "splat/gpu_records.h"
#include "util/multiversion.h"

namespace rcs {
namespace {

constexpr int kTile = TiledSurfaces::kTile;
constexpr std::size_t kTilePixels = TiledSurfaces::kTilePixels;

/// Which records touch each tile, in record order: a counting sort by tile.
struct Bins {
    std::vector<std::uint32_t> first;    // per tile, and one more
    std::vector<std::uint32_t> records;  // indices, tile after tile
};

template <typename Visit>
void for_each_tile(const gpu::GpuRecord& record, int tiles_x, const Visit& visit)
{
    for (int y = record.pixels.y / kTile; y <= (record.pixels.w - 1) / kTile; ++y)
        for (int x = record.pixels.x / kTile; x <= (record.pixels.z - 1) / kTile; ++x)
            visit(static_cast<std::size_t>(y * tiles_x + x));
}

Bins bin_records(const std::vector<gpu::GpuRecord>& records, const TiledSurfaces& surfaces)
{
    Bins bins;
    bins.first.assign(surfaces.tiles.size() + 1, 0);
    for (const gpu::GpuRecord& record : records)
        for_each_tile(record, surfaces.tiles_x, [&](std::size_t tile) { ++bins.first[tile + 1]; });
    for (std::size_t tile = 1; tile < bins.first.size(); ++tile)
        bins.first[tile] += bins.first[tile - 1];
    bins.records.resize(bins.first.back());
    std::vector<std::uint32_t> next(bins.first.begin(), bins.first.end() - 1);
    for (std::uint32_t i = 0; i < records.size(); ++i)
        for_each_tile(records[i], surfaces.tiles_x, [&](std::size_t tile) { bins.records[next[tile]++] = i; });
    return bins;
}

std::vector<gpu::GpuRecord> make_gpu_records(std::span<const Record> records, glm::dvec3 camera, const View& view,
                                             const SplatOptions& options, ThreadPool& pool)
{
    constexpr std::size_t kChunk = 2048;
    std::vector<std::vector<gpu::GpuRecord>> chunks((records.size() + kChunk - 1) / kChunk);
    pool.parallel_for(records.size(), kChunk, [&](std::size_t begin, std::size_t end, int) {
        append_gpu_records(records.subspan(begin, end - begin), camera, view, options, chunks[begin / kChunk]);
    });
    std::vector<gpu::GpuRecord> all;
    all.reserve(records.size());
    for (const auto& chunk : chunks)
        all.insert(all.end(), chunk.begin(), chunk.end());
    return all;
}

struct alignas(64) TileSums {
    float r[kTilePixels], g[kTilePixels], b[kTilePixels], weight[kTilePixels], count[kTilePixels];
};

/// Sums one record over rows [y0, y1) of the tile.
template <bool kWeightsOnly>
RCS_ALWAYS_INLINE void splat_rows(const TiledSurfaces::Tile& t, TileSums& sums, const gpu::GpuRecord& record, int y0, int y1)
{
    const float kx = record.position.x, ky = record.position.y, kz = record.position.z;
    const float knx = record.normal.x, kny = record.normal.y, knz = record.normal.z;
    const float inv_radius = record.position.w, inv_normal = record.normal.w, factor = record.irradiance.w;
    // Copies: the compiler must know that the tile's sums do not overlap them.
    const glm::vec3 e(record.irradiance);
    const glm::vec3 gr[3] = {record.rotation_gradient[0], record.rotation_gradient[1], record.rotation_gradient[2]};
    const glm::vec3 gt[3] = {record.translation_gradient[0], record.translation_gradient[1],
                             record.translation_gradient[2]};
    for (int y = y0; y < y1; ++y) {
        const int row = y * kTile;
        for (int i = row; i < row + kTile; ++i) {
            const float dx = t.px[i] - kx, dy = t.py[i] - ky, dz = t.pz[i] - kz;
            const float nx = t.nx[i], ny = t.ny[i], nz = t.nz[i];
            const float raw = t.cover[i] * gpu::rcs_interpolation_weight(dx, dy, dz, nx, ny, nz, knx, kny, knz,
                                                                         inv_radius, inv_normal);
            const float w = raw * factor;
            sums.weight[i] += w;
            if constexpr (!kWeightsOnly) {
                const float rx = kny * nz - knz * ny, ry = knz * nx - knx * nz, rz = knx * ny - kny * nx;
                sums.r[i] += w * gpu::rcs_extrapolate(e.r, dx, dy, dz, rx, ry, rz, gt[0].x, gt[0].y, gt[0].z,
                                                   gr[0].x, gr[0].y, gr[0].z);
                sums.g[i] += w * gpu::rcs_extrapolate(e.g, dx, dy, dz, rx, ry, rz, gt[1].x, gt[1].y, gt[1].z,
                                                   gr[1].x, gr[1].y, gr[1].z);
                sums.b[i] += w * gpu::rcs_extrapolate(e.b, dx, dy, dz, rx, ry, rz, gt[2].x, gt[2].y, gt[2].z,
                                                   gr[2].x, gr[2].y, gr[2].z);
                sums.count[i] += raw > 0.0f ? 1.0f : 0.0f;
            }
        }
    }
}

template <bool kWeightsOnly>
RCS_ALWAYS_INLINE void splat_tile(const TiledSurfaces::Tile& tile, TileSums& sums, const gpu::GpuRecord* records, const std::uint32_t* begin,
                                  const std::uint32_t* end, int top)
{
    for (const std::uint32_t* i = begin; i != end; ++i) {
        const gpu::GpuRecord& record = records[*i];
        splat_rows<kWeightsOnly>(tile, sums, record, std::max(record.pixels.y - top, 0),
                                 std::min(record.pixels.w - top, kTile));
    }
}

RCS_MULTIVERSION
void splat_tile_sums(const TiledSurfaces::Tile& tile, TileSums& sums, const gpu::GpuRecord* records, const std::uint32_t* begin,
                     const std::uint32_t* end, int top)
{
    splat_tile<false>(tile, sums, records, begin, end, top);
}

RCS_MULTIVERSION
void splat_tile_weights(const TiledSurfaces::Tile& tile, TileSums& sums, const gpu::GpuRecord* records, const std::uint32_t* begin,
                        const std::uint32_t* end, int top)
{
    splat_tile<true>(tile, sums, records, begin, end, top);
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

/// Runs `sum` on every tile that records touch, then hands its sums to `store`.
template <typename Sum, typename Store>
void for_each_busy_tile(const TiledSurfaces& surfaces, const std::vector<gpu::GpuRecord>& records, ThreadPool& pool,
                        const Sum& sum, const Store& store)
{
    const Bins bins = bin_records(records, surfaces);
    pool.parallel_for(surfaces.tiles.size(), 4, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t t = begin; t < end; ++t) {
            if (bins.first[t] == bins.first[t + 1])
                continue;
            const int top = static_cast<int>(t / static_cast<std::size_t>(surfaces.tiles_x)) * kTile;
            TileSums sums{};
            sum(surfaces.tiles[t], sums, records.data(), bins.records.data() + bins.first[t],
                bins.records.data() + bins.first[t + 1], top);
            store(sums, t);
        }
    });
}

}  // namespace

TiledSurfaces make_tiled_surfaces(const GBuffer& g, ThreadPool& pool)
{
    TiledSurfaces s;
    s.width = g.width;
    s.height = g.height;
    s.tiles_x = (g.width + kTile - 1) / kTile;
    s.tiles_y = (g.height + kTile - 1) / kTile;
    s.camera_position = g.camera_position;
    s.tiles.resize(static_cast<std::size_t>(s.tiles_x) * static_cast<std::size_t>(s.tiles_y));
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
            });
        }
    });
    return s;
}

void add_weights(std::span<const Record> records, const TiledSurfaces& surfaces, const View& view,
                 const SplatOptions& options, ThreadPool& pool, std::vector<float>& weight)
{
    const auto store = [&](const TileSums& sums, std::size_t t) {
        for_each_pixel(surfaces, t, [&](std::size_t to, std::size_t from) { weight[to] += sums.weight[from]; });
    };
    for_each_busy_tile(surfaces, make_gpu_records(records, surfaces.camera_position, view, options, pool), pool,
                       splat_tile_weights, store);
}

SplatBuffer splat_tiles(std::span<const Record> records, const TiledSurfaces& surfaces, const View& view,
                        const SplatOptions& options, ThreadPool& pool, SplatStats& stats)
{
    SplatBuffer out;
    out.width = surfaces.width;
    out.height = surfaces.height;
    for (auto* plane : {&out.weighted_r, &out.weighted_g, &out.weighted_b, &out.weight, &out.count})
        plane->assign(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height), 0.0f);
    const auto store = [&](const TileSums& sums, std::size_t t) {
        for_each_pixel(surfaces, t, [&](std::size_t to, std::size_t from) {
            out.weighted_r[to] = sums.r[from];
            out.weighted_g[to] = sums.g[from];
            out.weighted_b[to] = sums.b[from];
            out.weight[to] = sums.weight[from];
            out.count[to] = sums.count[from];
        });
    };
    const std::vector<gpu::GpuRecord> gpu_records =
        make_gpu_records(records, surfaces.camera_position, view, options, pool);
    stats.splats += gpu_records.size();
    for (const gpu::GpuRecord& r : gpu_records)
        stats.samples += static_cast<std::uint64_t>(r.pixels.z - r.pixels.x) *
                         static_cast<std::uint64_t>(r.pixels.w - r.pixels.y);
    for_each_busy_tile(surfaces, gpu_records, pool, splat_tile_sums, store);
    return out;
}

SplatBuffer splat_tiles(const std::vector<Record>& records, const GBuffer& gbuffer, const View& view,
                        const SplatOptions& options, ThreadPool& pool, SplatStats& stats)
{
    return splat_tiles(records, make_tiled_surfaces(gbuffer, pool), view, options, pool, stats);
}

}  // namespace rcs
