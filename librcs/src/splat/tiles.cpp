#include "splat/tiles.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "gbuffer/shading.h"
#include "radiance/lobes.h"
#include "shared/gpu_record.h"
#include "splat/gpu_records.h"
#include "splat/tile_sums.h"

namespace rcs {
namespace {

constexpr int kTile = TiledSurfaces::kTile;
constexpr std::size_t kTilePixels = TiledSurfaces::kTilePixels;

template <typename Visit>
void for_each_tile(const gpu::GpuRecord& record, int tiles_x, const Visit& visit)
{
    if (record.pixels.x >= record.pixels.z) return;
    for (int y = record.pixels.y / kTile; y <= (record.pixels.w - 1) / kTile; ++y)
        for (int x = record.pixels.x / kTile; x <= (record.pixels.z - 1) / kTile; ++x)
            visit(static_cast<std::size_t>(y * tiles_x + x));
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

/// Calls visit(tile, its records) for every tile that records touch, if it has any of the rows.
/// @param rows  of tiles, as TiledSurfaces::rows
template <typename Visit>
void for_each_busy_tile(const TiledSurfaces& surfaces, std::span<const std::uint16_t> rows,
                        std::span<const gpu::GpuRecord> records, const gpu::GpuRadiance* radiance, ThreadPool& pool,
                        const Visit& visit)
{
    const TileBins bins = bin_records(records, surfaces.tiles_x, rows, pool);
    pool.parallel_for(surfaces.tiles.size(), 4, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t t = begin; t < end; ++t) {
            if (bins.first[t] == bins.first[t + 1]) continue;
            const int top = static_cast<int>(t / static_cast<std::size_t>(surfaces.tiles_x)) * kTile;
            visit(t, TileRecords{records.data(), radiance, bins.records.data() + bins.first[t],
                                 bins.records.data() + bins.first[t + 1], top, rows[t]});
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
    const glm::vec3 parallel = parallel_outgoing(camera);
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

TileBins bin_records(std::span<const gpu::GpuRecord> records, int tiles_x, std::span<const std::uint16_t> rows,
                     ThreadPool& pool)
{
    // Parts of the records are counted side by side, and then put one after the other in each tile.
    constexpr std::size_t kMostParts = 8, kOfPart = 1024;
    const std::size_t parts = std::clamp<std::size_t>(records.size() / kOfPart, 1, kMostParts);
    std::vector<std::vector<std::uint32_t>> next(parts);
    const auto for_each_in_part = [&](std::size_t part, const auto& visit) {
        const std::size_t end = records.size() * (part + 1) / parts;
        for (std::size_t i = records.size() * part / parts; i < end; ++i)
            for_each_tile(records[i], tiles_x, [&](std::size_t tile) {
                if (rows[tile] != 0) visit(i, next[part][tile]);
            });
    };
    pool.parallel_for(parts, 1, [&](std::size_t part, std::size_t, int) {
        next[part].assign(rows.size(), 0);
        for_each_in_part(part, [](std::size_t, std::uint32_t& count) { ++count; });
    });
    TileBins bins;
    bins.first.reserve(rows.size() + 1);
    std::uint32_t all = 0;
    for (std::size_t tile = 0; tile < rows.size(); ++tile) {
        bins.first.push_back(all);
        for (std::vector<std::uint32_t>& of_part : next) all += std::exchange(of_part[tile], all);
    }
    bins.first.push_back(all);
    bins.records.resize(all);
    pool.parallel_for(parts, 1, [&](std::size_t part, std::size_t, int) {
        for_each_in_part(
            part, [&](std::size_t i, std::uint32_t& place) { bins.records[place++] = static_cast<std::uint32_t>(i); });
    });
    return bins;
}

void add_rows(const gpu::GpuRecord& record, const TiledSurfaces& surfaces, std::span<std::uint16_t> rows)
{
    for_each_tile(record, surfaces.tiles_x, [&](std::size_t t) {
        const int top = static_cast<int>(t / static_cast<std::size_t>(surfaces.tiles_x)) * kTile;
        const int begin = std::max(record.pixels.y - top, 0), end = std::min(record.pixels.w - top, kTile);
        const std::uint32_t touched = (1u << end) - (1u << begin);
        rows[t] |= static_cast<std::uint16_t>(touched & surfaces.rows[t]);
    });
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
                tile.put(to, g, from);
                if (g.covered(from)) s.rows[t] |= static_cast<std::uint16_t>(1u << to / kTile);
            });
        }
    });
    return s;
}

void add_weights(std::span<const Record> records, const TiledSurfaces& surfaces, const View& view,
                 const SplatSettings& options, ThreadPool& pool, std::vector<float>& weight)
{
    add_weights(make_gpu_records(records, surfaces.camera_position, view, options, false, 1.0f, pool).records, surfaces,
                surfaces.rows, pool, weight);
}

void add_weights(std::span<const gpu::GpuRecord> records, const TiledSurfaces& surfaces,
                 std::span<const std::uint16_t> rows, ThreadPool& pool, std::vector<float>& weight)
{
    for_each_busy_tile(surfaces, rows, records, nullptr, pool, [&](std::size_t t, const TileRecords& in_tile) {
        TileSums sums{};
        splat_tile_weights(surfaces.tiles[t], sums, in_tile);
        for_each_pixel(surfaces, t, [&](std::size_t to, std::size_t at) { weight[to] += sums.weight[at]; });
    });
}

void clear_rows(const TiledSurfaces& surfaces, std::span<const std::uint16_t> rows, std::vector<float>& weight)
{
    for (std::size_t t = 0; t < surfaces.tiles.size(); ++t) {
        if (rows[t] == 0) continue;
        for_each_pixel(surfaces, t, [&](std::size_t to, std::size_t at) {
            if ((rows[t] >> at / kTile & 1u) != 0u) weight[to] = 0.0f;
        });
    }
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
    const auto splat_tile = [&](std::size_t t, const TileRecords& in_tile) {
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
    };
    for_each_busy_tile(surfaces, surfaces.rows, from.records, from.radiance.data(), pool, splat_tile);
    return out;
}

SplatBuffer splat_tiles(const std::vector<Record>& records, const GBuffer& gbuffer, const View& view,
                        const SplatSettings& options, ThreadPool& pool, SplatStats& stats, const Shading* glossy)
{
    return splat_tiles(records, make_tiled_surfaces(gbuffer, pool), view, options, pool, stats, glossy);
}

}  // namespace rcs
