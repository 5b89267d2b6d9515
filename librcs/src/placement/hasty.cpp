#include "placement/hasty.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <iterator>
#include <span>
#include <utility>

#include <glm/glm.hpp>

#include "placement/holes.h"
#include "records/gather.h"
#include "splat/tiles.h"
#include "util/random.h"

namespace rcs {
namespace {

// Finer grids than this would take more time than there ever is [px].
constexpr int kFinestStride = 4;
// Records between two looks at the clock: a few milliseconds of two cores.
constexpr std::size_t kBatch = 64;
// Weight of light that was filled in: any record counts for more.
constexpr float kHardlyAny = 1e-6f;

/// In an order that is spread all over the picture, however many there will be time for.
void scatter(std::vector<std::uint32_t>& pixels)
{
    std::sort(pixels.begin(), pixels.end(),
              [](std::uint32_t a, std::uint32_t b) { return std::pair(mix64(a), a) < std::pair(mix64(b), b); });
}

}  // namespace

std::vector<Record> gather_in_haste(const HastyView& at, double seconds, ThreadPool& pool, std::vector<float>& weight,
                                    RecordStats& stats)
{
    using Clock = std::chrono::steady_clock;
    const Clock::time_point end =
        Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
    std::vector<Record> made;
    const RecordGatherer gatherer(at.scene, at.records);
    const TiledSurfaces surfaces = make_tiled_surfaces(at.gbuffer, pool);
    for (int stride = kCoarsestStride; stride >= kFinestStride; stride /= 2) {
        std::vector<std::uint32_t> holes =
            find_holes(at.gbuffer, at.view.corner, weight, {stride, -1, false}, at.records.seed, pool);
        scatter(holes);
        const std::size_t before = made.size();
        for (std::size_t done = 0; done < holes.size() && (made.empty() || Clock::now() < end); done += kBatch) {
            const auto from = holes.begin() + static_cast<std::ptrdiff_t>(done);
            const std::vector<std::uint32_t> batch(
                from, from + static_cast<std::ptrdiff_t>(std::min(kBatch, holes.size() - done)));
            std::vector<Record> fresh = gatherer.gather(at.gbuffer, batch, pool, stats);
            std::move(fresh.begin(), fresh.end(), std::back_inserter(made));
        }
        if (made.size() > before) {
            ++stats.waves;
            limit_spacing(made, at.records, pool);
            add_weights(std::span(std::as_const(made)).subspan(before), surfaces, at.view,
                        {at.splat.error_tolerance, at.splat.overlap}, pool, weight);
        }
        if (Clock::now() >= end) break;
    }
    return made;
}

namespace {

/// Light of squares of pixels, and whether there is any.
struct Level {
    int width = 0, height = 0;
    std::vector<glm::vec4> light;  // of the served ones in it, their number in w

    glm::vec4& at(int x, int y)
    {
        return light[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
    }
};

Level halved(Level& from)
{
    Level to{(from.width + 1) / 2, (from.height + 1) / 2, {}};
    to.light.assign(static_cast<std::size_t>(to.width) * static_cast<std::size_t>(to.height), glm::vec4(0.0f));
    for (int y = 0; y < from.height; ++y)
        for (int x = 0; x < from.width; ++x) to.at(x / 2, y / 2) += from.at(x, y);
    return to;
}

}  // namespace

std::vector<std::uint32_t> fill_from_around(const GBuffer& g, SplatBuffer& sums)
{
    std::vector<std::uint32_t> holes;
    for (std::uint32_t i = 0; i < g.size(); ++i)
        if (g.covered(i) && !(sums.weight[i] > 0.0f)) holes.push_back(i);
    if (holes.empty()) return holes;
    Level pixels{g.width, g.height, std::vector<glm::vec4>(g.size(), glm::vec4(0.0f))};
    for (std::size_t i = 0; i < g.size(); ++i)
        if (sums.weight[i] > 0.0f)
            pixels.light[i] =
                glm::vec4(glm::vec3(sums.weighted_r[i], sums.weighted_g[i], sums.weighted_b[i]) / sums.weight[i], 1.0f);
    std::vector<Level> levels{std::move(pixels)};
    while (levels.back().width > 1 || levels.back().height > 1) levels.push_back(halved(levels.back()));
    for (const std::uint32_t i : holes) {
        int x = static_cast<int>(i) % g.width, y = static_cast<int>(i) / g.width;
        glm::vec4 around(0.0f);
        for (std::size_t level = 1; level < levels.size() && around.w == 0.0f; ++level)
            around = levels[level].at(x /= 2, y /= 2);
        if (around.w == 0.0f) break;  // no record reaches any pixel
        const glm::vec3 mean = glm::vec3(around) / around.w;
        sums.weight[i] = kHardlyAny;
        sums.weighted_r[i] = kHardlyAny * mean.r;
        sums.weighted_g[i] = kHardlyAny * mean.g;
        sums.weighted_b[i] = kHardlyAny * mean.b;
    }
    return holes;
}

}  // namespace rcs
