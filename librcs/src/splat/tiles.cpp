#include "splat/tiles.h"

#include <algorithm>
#include <cstdint>

#include "shared/gpu_record.h"
#include "shared/weight.h"
#include "splat/gpu_records.h"
#include "util/multiversion.h"

namespace rcs {
namespace {

// A tile row is one AVX-512 vector of floats, two AVX ones, four SSE ones.
constexpr int kTile = 16;
constexpr std::size_t kTilePixels = kTile * kTile;

/// Which records touch each tile, in record order: a counting sort by tile.
struct Bins {
    int tiles_x = 0, tiles_y = 0;
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

Bins bin_records(const std::vector<gpu::GpuRecord>& records, int width, int height)
{
    Bins bins;
    bins.tiles_x = (width + kTile - 1) / kTile;
    bins.tiles_y = (height + kTile - 1) / kTile;
    bins.first.assign(static_cast<std::size_t>(bins.tiles_x) * static_cast<std::size_t>(bins.tiles_y) + 1, 0);
    for (const gpu::GpuRecord& record : records)
        for_each_tile(record, bins.tiles_x, [&](std::size_t tile) { ++bins.first[tile + 1]; });
    for (std::size_t tile = 1; tile < bins.first.size(); ++tile)
        bins.first[tile] += bins.first[tile - 1];
    bins.records.resize(bins.first.back());
    std::vector<std::uint32_t> next(bins.first.begin(), bins.first.end() - 1);
    for (std::uint32_t i = 0; i < records.size(); ++i)
        for_each_tile(records[i], bins.tiles_x, [&](std::size_t tile) { bins.records[next[tile]++] = i; });
    return bins;
}

/// A tile's visible points and sums, next to each other in the cache.
struct alignas(64) Tile {
    float px[kTilePixels], py[kTilePixels], pz[kTilePixels];  // relative to the camera [m]
    float nx[kTilePixels], ny[kTilePixels], nz[kTilePixels];
    float cover[kTilePixels];  // 1 where a surface is seen, else 0
    float r[kTilePixels], g[kTilePixels], b[kTilePixels], weight[kTilePixels], count[kTilePixels];
};

/// Sums one record over rows [y0, y1) of the tile.
template <bool kWeightsOnly>
RCS_ALWAYS_INLINE void splat_rows(Tile& t, const gpu::GpuRecord& record, int y0, int y1)
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
            t.weight[i] += w;
            if constexpr (!kWeightsOnly) {
                const float rx = kny * nz - knz * ny, ry = knz * nx - knx * nz, rz = knx * ny - kny * nx;
                t.r[i] += w * gpu::rcs_extrapolate(e.r, dx, dy, dz, rx, ry, rz, gt[0].x, gt[0].y, gt[0].z,
                                                   gr[0].x, gr[0].y, gr[0].z);
                t.g[i] += w * gpu::rcs_extrapolate(e.g, dx, dy, dz, rx, ry, rz, gt[1].x, gt[1].y, gt[1].z,
                                                   gr[1].x, gr[1].y, gr[1].z);
                t.b[i] += w * gpu::rcs_extrapolate(e.b, dx, dy, dz, rx, ry, rz, gt[2].x, gt[2].y, gt[2].z,
                                                   gr[2].x, gr[2].y, gr[2].z);
                t.count[i] += raw > 0.0f ? 1.0f : 0.0f;
            }
        }
    }
}

template <bool kWeightsOnly>
RCS_ALWAYS_INLINE void splat_tile(Tile& tile, const gpu::GpuRecord* records, const std::uint32_t* begin,
                                  const std::uint32_t* end, int top)
{
    for (const std::uint32_t* i = begin; i != end; ++i) {
        const gpu::GpuRecord& record = records[*i];
        splat_rows<kWeightsOnly>(tile, record, std::max(record.pixels.y - top, 0),
                                 std::min(record.pixels.w - top, kTile));
    }
}

RCS_MULTIVERSION
void splat_tile_sums(Tile& tile, const gpu::GpuRecord* records, const std::uint32_t* begin,
                     const std::uint32_t* end, int top)
{
    splat_tile<false>(tile, records, begin, end, top);
}

RCS_MULTIVERSION
void splat_tile_weights(Tile& tile, const gpu::GpuRecord* records, const std::uint32_t* begin,
                        const std::uint32_t* end, int top)
{
    splat_tile<true>(tile, records, begin, end, top);
}

/// Calls visit(pixel in the image, pixel in the tile) for the part of the tile inside the image.
template <typename Visit>
void for_each_pixel(const GBuffer& g, int left, int top, const Visit& visit)
{
    for (int y = top; y < std::min(top + kTile, g.height); ++y)
        for (int x = left; x < std::min(left + kTile, g.width); ++x)
            visit(static_cast<std::size_t>(y) * static_cast<std::size_t>(g.width) + static_cast<std::size_t>(x),
                  static_cast<std::size_t>((y - top) * kTile + (x - left)));
}

void load_tile(const GBuffer& g, int left, int top, Tile& tile)
{
    tile = Tile{};
    for_each_pixel(g, left, top, [&](std::size_t from, std::size_t to) {
        tile.px[to] = g.position_x[from];
        tile.py[to] = g.position_y[from];
        tile.pz[to] = g.position_z[from];
        tile.nx[to] = g.normal_x[from];
        tile.ny[to] = g.normal_y[from];
        tile.nz[to] = g.normal_z[from];
        tile.cover[to] = g.covered(from) ? 1.0f : 0.0f;
    });
}

/// Runs `sum` on every tile that records touch, then hands the tile to `store`.
template <typename Sum, typename Store>
void for_each_busy_tile(const GBuffer& g, const std::vector<gpu::GpuRecord>& records, ThreadPool& pool, const Sum& sum,
                        const Store& store)
{
    const Bins bins = bin_records(records, g.width, g.height);
    pool.parallel_for(bins.first.size() - 1, 4, [&](std::size_t begin, std::size_t end, int) {
        Tile tile;
        for (std::size_t t = begin; t < end; ++t) {
            if (bins.first[t] == bins.first[t + 1])
                continue;
            const int left = static_cast<int>(t % static_cast<std::size_t>(bins.tiles_x)) * kTile;
            const int top = static_cast<int>(t / static_cast<std::size_t>(bins.tiles_x)) * kTile;
            load_tile(g, left, top, tile);
            sum(tile, records.data(), bins.records.data() + bins.first[t], bins.records.data() + bins.first[t + 1], top);
            store(tile, left, top);
        }
    });
}

}  // namespace

void add_weights(const std::vector<Record>& records, const GBuffer& gbuffer, const View& view,
                 const SplatOptions& options, ThreadPool& pool, std::vector<float>& weight)
{
    const auto store = [&](const Tile& tile, int left, int top) {
        for_each_pixel(gbuffer, left, top, [&](std::size_t to, std::size_t from) { weight[to] += tile.weight[from]; });
    };
    for_each_busy_tile(gbuffer, make_gpu_records(records, gbuffer, view, options), pool, splat_tile_weights, store);
}

std::vector<float> splat_weights(const std::vector<Record>& records, const GBuffer& gbuffer, const View& view,
                                 const SplatOptions& options, ThreadPool& pool)
{
    std::vector<float> weight(gbuffer.size(), 0.0f);
    add_weights(records, gbuffer, view, options, pool, weight);
    return weight;
}

SplatBuffer splat_tiles(const std::vector<Record>& records, const GBuffer& gbuffer, const View& view,
                        const SplatOptions& options, ThreadPool& pool, SplatStats& stats)
{
    SplatBuffer out;
    out.width = gbuffer.width;
    out.height = gbuffer.height;
    for (auto* plane : {&out.weighted_r, &out.weighted_g, &out.weighted_b, &out.weight, &out.count})
        plane->assign(gbuffer.size(), 0.0f);
    const auto store = [&](const Tile& tile, int left, int top) {
        for_each_pixel(gbuffer, left, top, [&](std::size_t to, std::size_t from) {
            out.weighted_r[to] = tile.r[from];
            out.weighted_g[to] = tile.g[from];
            out.weighted_b[to] = tile.b[from];
            out.weight[to] = tile.weight[from];
            out.count[to] = tile.count[from];
        });
    };
    const std::vector<gpu::GpuRecord> gpu_records = make_gpu_records(records, gbuffer, view, options);
    stats.splats += gpu_records.size();
    for (const gpu::GpuRecord& r : gpu_records)
        stats.samples += static_cast<std::uint64_t>(r.pixels.z - r.pixels.x) *
                         static_cast<std::uint64_t>(r.pixels.w - r.pixels.y);
    for_each_busy_tile(gbuffer, gpu_records, pool, splat_tile_sums, store);
    return out;
}

}  // namespace rcs
