#include "splat/at_pixels.h"

#include <algorithm>

#include "splat/gpu_records.h"
#include "splat/tile_sums.h"

namespace rcs {
namespace {

constexpr std::size_t kPacked = TiledSurfaces::kTilePixels;

/// Which of the pixels lie in each tile of the image: a counting sort by tile.
struct PixelBins {
    std::vector<std::uint32_t> first;  // per tile, and one more
    std::vector<std::uint32_t> which;  // places in the list of pixels, tile after tile
    std::vector<std::uint16_t> rows;   // per tile, not 0 where one lies in it
};

PixelBins bin_pixels(std::span<const std::uint32_t> pixels, int width, int height)
{
    constexpr auto kSide = static_cast<std::uint32_t>(TiledSurfaces::kTile);
    const auto w = static_cast<std::uint32_t>(width), h = static_cast<std::uint32_t>(height);
    const std::uint32_t tiles_x = (w + kSide - 1) / kSide, tiles_y = (h + kSide - 1) / kSide;
    const auto tile_of = [&](std::uint32_t pixel) { return pixel / w / kSide * tiles_x + pixel % w / kSide; };
    PixelBins bins;
    bins.rows.assign(std::size_t{tiles_x} * tiles_y, 0);
    bins.first.assign(bins.rows.size() + 1, 0);
    for (const std::uint32_t pixel : pixels) {
        ++bins.first[tile_of(pixel) + 1];
        bins.rows[tile_of(pixel)] = 1;
    }
    for (std::size_t t = 1; t < bins.first.size(); ++t) bins.first[t] += bins.first[t - 1];
    bins.which.resize(pixels.size());
    std::vector<std::uint32_t> next(bins.first.begin(), bins.first.end() - 1);
    for (std::uint32_t i = 0; i < pixels.size(); ++i) bins.which[next[tile_of(pixels[i])]++] = i;
    return bins;
}

/// As many of the pixels as one tile holds, packed into its first rows.
TiledSurfaces::Tile pack(const GBuffer& g, std::span<const std::uint32_t> pixels, std::span<const std::uint32_t> which)
{
    TiledSurfaces::Tile tile{};
    for (std::size_t k = 0; k < which.size(); ++k) tile.put(k, g, pixels[which[k]]);
    return tile;
}

PixelSums no_sums(std::size_t pixels, bool with_errors)
{
    PixelSums sums{std::vector<glm::vec3>(pixels, glm::vec3(0.0f)), std::vector<float>(pixels, 0.0f), {}, {}, {}};
    if (with_errors) sums.squares = sums.variance = sums.variance_of_sum = sums.weight;
    return sums;
}

void put(PixelSums& out, std::size_t to, const TileSums& sums, std::size_t from)
{
    out.weighted[to] = {sums.r[from], sums.g[from], sums.b[from]};
    out.weight[to] = sums.weight[from];
    if (out.squares.empty()) return;
    out.squares[to] = sums.squares[from];
    out.variance[to] = sums.variance[from];
    out.variance_of_sum[to] = sums.variance_of_sum[from];
}

}  // namespace

PixelSums splat_at_pixels(std::span<const Record> records, const GBuffer& gbuffer,
                          std::span<const std::uint32_t> pixels, const View& view, const SplatSettings& options,
                          ThreadPool& pool)
{
    PixelSums out = no_sums(pixels.size(), options.error_sums);
    if (options.error_sums) out.luminance_unit = luminance_unit(records);
    const GpuRecords from =
        make_gpu_records(records, gbuffer.camera_position, view, options, false, out.luminance_unit, pool);
    const PixelBins places = bin_pixels(pixels, gbuffer.width, gbuffer.height);
    const TileBins bins =
        bin_records(from.records, (gbuffer.width + TiledSurfaces::kTile - 1) / TiledSurfaces::kTile, places.rows, pool);
    pool.parallel_for(places.rows.size(), 4, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t t = begin; t < end; ++t) {
            if (bins.first[t] == bins.first[t + 1]) continue;
            for (std::size_t p = places.first[t]; p < places.first[t + 1]; p += kPacked) {
                const std::size_t count = std::min(kPacked, places.first[t + 1] - p);
                const auto which = std::span(places.which).subspan(p, count);
                const std::uint32_t rows = (1u << (count + TiledSurfaces::kTile - 1) / TiledSurfaces::kTile) - 1u;
                TileSums sums{};
                (options.error_sums ? splat_tile_sums : splat_tile_light)(
                    pack(gbuffer, pixels, which), sums,
                    {from.records.data(), nullptr, bins.records.data() + bins.first[t],
                     bins.records.data() + bins.first[t + 1], 0, rows, true},
                    nullptr);
                for (std::size_t i = 0; i < count; ++i) put(out, which[i], sums, i);
            }
        }
    });
    return out;
}

}  // namespace rcs
