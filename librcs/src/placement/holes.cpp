#include "placement/holes.h"

#include <cstddef>

#include "gbuffer/views.h"
#include "util/random.h"

namespace rcs {

static_assert(kPartGrid % kCoarsestStride == 0);

std::vector<Wave> waves()
{
    std::vector<Wave> list;
    for (int stride = kCoarsestStride; stride >= 4; stride /= 2) list.push_back({stride, -1, stride == 4});
    for (int stride : {2, 1})
        for (int phase = 0; phase < 4; ++phase) list.push_back({stride, phase, stride == 1 && phase == 0});
    return list;
}

namespace {

/// The pixel that a wave takes in one cell of its grid; at or beyond the image's edge it may be none of it.
glm::ivec2 pixel_of_cell(int cx, int cy, int stride, std::uint64_t seed)
{
    if (stride == 1) return {cx, cy};
    const std::uint64_t cell = static_cast<std::uint64_t>(cy) << 32 | static_cast<std::uint64_t>(cx);
    const std::uint64_t key = stream_key(seed + static_cast<std::uint64_t>(stride), Stream::placement, cell);
    const std::uint64_t side = static_cast<std::uint64_t>(stride);
    return {cx * stride + static_cast<int>(key % side), cy * stride + static_cast<int>((key >> 32) % side)};
}

}  // namespace

std::vector<std::uint32_t> find_holes(const GBuffer& g, glm::ivec2 corner, const std::vector<float>& weight, Wave wave,
                                      std::uint64_t seed, ThreadPool& pool)
{
    const glm::ivec2 first = corner / wave.stride;
    const int columns = (g.width + wave.stride - 1) / wave.stride;
    std::vector<std::vector<std::uint32_t>> rows(static_cast<std::size_t>((g.height + wave.stride - 1) / wave.stride));
    pool.parallel_for(rows.size(), 16, [&](std::size_t begin, std::size_t end, int) {
        for (int cy = static_cast<int>(begin); cy < static_cast<int>(end); ++cy) {
            if (wave.phase >= 0 && ((first.y + cy) & 1) != wave.phase >> 1) continue;
            const int step = wave.phase >= 0 ? 2 : 1;
            for (int cx = wave.phase >= 0 ? (first.x ^ wave.phase) & 1 : 0; cx < columns; cx += step) {
                const glm::ivec2 cell = first + glm::ivec2(cx, cy);
                const glm::ivec2 p = pixel_of_cell(cell.x, cell.y, wave.stride, seed) - first * wave.stride;
                if (p.x >= g.width || p.y >= g.height) continue;
                const std::size_t i =
                    static_cast<std::size_t>(p.y) * static_cast<std::size_t>(g.width) + static_cast<std::size_t>(p.x);
                if (g.covered(i) && !(weight[i] > 0.0f))
                    rows[static_cast<std::size_t>(cy)].push_back(static_cast<std::uint32_t>(i));
            }
        }
    });
    std::vector<std::uint32_t> holes;
    for (const auto& row : rows) holes.insert(holes.end(), row.begin(), row.end());
    return holes;
}

}  // namespace rcs
