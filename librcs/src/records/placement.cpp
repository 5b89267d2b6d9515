#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "rcs/error.h"
#include "rcs/records.h"
#include "records/gather.h"
#include "records/spacing.h"
#include "splat/tiles.h"
#include "util/random.h"

namespace rcs {
namespace {

// The coarsest grid of candidates [px]: about the widest spacing of default options.
constexpr int kCoarsestStride = 32;

/// One wave: in each cell of a grid, one pixel by rule.
struct Wave {
    int stride;
    int phase;  // which quarter of the cells, so that neighbours do not both claim a hole; -1 takes all
};

std::vector<Wave> waves()
{
    std::vector<Wave> list;
    for (int stride = kCoarsestStride; stride >= 4; stride /= 2)
        list.push_back({stride, -1});
    for (int stride : {2, 1})
        for (int phase = 0; phase < 4; ++phase)
            list.push_back({stride, phase});
    return list;
}

/// The visible points of this wave's grid that no record serves.
std::vector<std::uint32_t> find_holes(const GBuffer& g, const std::vector<float>& weight, Wave wave, std::uint64_t seed)
{
    std::vector<std::uint32_t> holes;
    for (int cy = 0; cy * wave.stride < g.height; ++cy) {
        for (int cx = 0; cx * wave.stride < g.width; ++cx) {
            if (wave.phase >= 0 && ((cx & 1) | (cy & 1) << 1) != wave.phase)
                continue;
            const std::uint64_t cell = static_cast<std::uint64_t>(cy) << 32 | static_cast<std::uint64_t>(cx);
            const std::uint64_t key = stream_key(seed + static_cast<std::uint64_t>(wave.stride), Stream::placement, cell);
            const int x = cx * wave.stride + static_cast<int>(key % static_cast<std::uint64_t>(wave.stride));
            const int y = cy * wave.stride + static_cast<int>((key >> 32) % static_cast<std::uint64_t>(wave.stride));
            if (x >= g.width || y >= g.height)
                continue;
            const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(g.width) + static_cast<std::size_t>(x);
            if (g.covered(i) && !(weight[i] > 0.0f))
                holes.push_back(static_cast<std::uint32_t>(i));
        }
    }
    return holes;
}

template <typename T>
void require(bool valid, const char* field, T value, const char* range)
{
    if (!valid)
        throw Error(ErrorCode::bad_argument,
                    std::string(field) + " is " + std::to_string(value) + ", expected " + range);
}

}  // namespace

void validate(const RecordOptions& o)
{
    require(o.error_tolerance > 0.0f && o.error_tolerance <= 1.0f, "records.error_tolerance", o.error_tolerance,
            "a value in (0, 1]");
    require(o.rays >= 16 && o.rays <= 65536, "records.rays", o.rays, "a value in [16, 65536]");
    require(o.max_reach > 0.0f && std::isfinite(o.max_reach), "records.max_reach", o.max_reach,
            "a positive number of pixels");
    require(o.min_reach > 0.0f && o.min_reach <= o.max_reach, "records.min_reach", o.min_reach,
            "a value in (0, max_reach]");
    require(o.gradient_limit > 0.0f, "records.gradient_limit", o.gradient_limit, "a positive value");
}

void place_records(const RayScene& rays, const GBuffer& gbuffer, const View& view, const RecordOptions& options,
                   ThreadPool& pool, std::vector<Record>& records, RecordStats& stats,
                   const ProgressFunction& progress)
{
    validate(options);
    const RecordGatherer gatherer(rays, options);
    const SplatOptions reach{options.error_tolerance, 1.0f};
    SpacingLimiter spacing(options);
    spacing.limit(records, pool);
    std::vector<float> weight = splat_weights(records, gbuffer, view, reach, pool);
    const std::vector<Wave> list = waves();
    const Wave every_pixel{1, -1};
    for (std::size_t w = 0;; ++w) {
        const bool planned = w < list.size();
        if (progress && !progress("records", planned ? static_cast<float>(w) / static_cast<float>(list.size()) : 1.0f))
            throw Error(ErrorCode::cancelled, "cancelled while gathering records");
        const std::vector<std::uint32_t> holes =
            find_holes(gbuffer, weight, planned ? list[w] : every_pixel, options.seed);
        // A late record may clamp a neighbour so that a pixel already passed is a hole again. Each such pixel
        // gets a record of its own, which always serves it: the loop ends.
        if (holes.empty() && !planned)
            break;
        if (holes.empty())
            continue;
        const std::vector<Record> fresh = gatherer.gather(gbuffer, holes, pool, stats);
        records.insert(records.end(), fresh.begin(), fresh.end());
        spacing.limit(records, pool);
        ++stats.waves;
        // What neighbours took from older records shows when the grid changes; until then the new ones are added.
        const bool same_grid = w + 1 < list.size() && list[w + 1].stride == list[w].stride;
        if (same_grid)
            add_weights({records.end() - static_cast<std::ptrdiff_t>(fresh.size()), records.end()}, gbuffer, view, reach,
                        pool, weight);
        else
            weight = splat_weights(records, gbuffer, view, reach, pool);
    }
}

}  // namespace rcs
