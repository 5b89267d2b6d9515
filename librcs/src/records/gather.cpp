#include "records/gather.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "rcs/error.h"
#include "rcs/records.h"
#include "records/gatherer.h"
#include "records/hemisphere.h"
#include "util/color.h"
#include "util/random.h"

namespace rcs {
namespace {

constexpr std::size_t kBatch = 2048;  // records between two reports of progress

/// @param sample  sets the gathers at this place apart: each has its own rays
Birth birth_at(const GBuffer& g, std::uint32_t pixel, std::uint64_t seed, std::uint64_t sample = 0)
{
    Birth b;
    b.position = g.scene_position(pixel);
    b.normal = g.normal(pixel);
    b.geometric_normal = g.geometric_normal[pixel];
    b.origin = b.position + g.position_error[pixel] * b.geometric_normal;
    b.footprint = g.footprint[pixel];
    // Keyed by place, not by pixel: a record made in another pass or view is another sample.
    std::uint64_t key = stream_key(seed, Stream::gather, std::bit_cast<std::uint32_t>(b.position.x));
    key = mix64(key ^ std::bit_cast<std::uint32_t>(b.position.y));
    b.key = mix64(key ^ std::bit_cast<std::uint32_t>(b.position.z) ^ sample << 32);
    return b;
}

}  // namespace

void add_gather(Record& record, const Record& more)
{
    const float share = static_cast<float>(more.rays) / static_cast<float>(record.rays + more.rays);
    const float before = record.noise * luminance(record.irradiance);
    record.irradiance = glm::mix(record.irradiance, more.irradiance, share);
    for (std::size_t color = 0; color < 3; ++color) {
        record.rotation_gradient[color] =
            glm::mix(record.rotation_gradient[color], more.rotation_gradient[color], share);
        record.translation_gradient[color] =
            glm::mix(record.translation_gradient[color], more.translation_gradient[color], share);
    }
    for (std::size_t k = 0; k < record.radiance.size(); ++k)
        record.radiance[k] = glm::mix(record.radiance[k], more.radiance[k], share);
    const float error = std::hypot((1.0f - share) * before, share * more.noise * luminance(more.irradiance));
    const float e = luminance(record.irradiance);
    record.noise = e > 0.0f ? std::min(1.0f, error / e) : 0.0f;
    record.rays += more.rays;
}

struct RecordGatherer::Impl {
    Gatherer gatherer;
    HemisphereGrid grid;
    std::uint64_t seed;
};

RecordGatherer::RecordGatherer(const LitScene& scene, const RecordSettings& options)
    : impl_(new Impl{Gatherer(scene.rays, options, options.bounces > 1 ? scene.cache : nullptr),
                     make_hemisphere_grid(options.rays), options.seed})
{
    if (options.bounces > 1 && !scene.cache)
        throw Error(ErrorCode::bad_argument, "bounces is " + std::to_string(options.bounces) +
                                                 ", which takes a light cache; expected 0 or 1 without one");
}

RecordGatherer::~RecordGatherer() = default;

int RecordGatherer::rays() const { return impl_->grid.cells; }

namespace {

void count(const std::vector<GatherWorkspace>& workspaces, RecordStats& stats)
{
    for (const GatherWorkspace& w : workspaces) {
        stats.hemisphere_rays += w.hemisphere_rays;
        stats.shadow_rays += w.shadow_rays;
    }
}

}  // namespace

std::vector<Record> RecordGatherer::gather(const GBuffer& gbuffer, const std::vector<std::uint32_t>& pixels,
                                           ThreadPool& pool, RecordStats& stats) const
{
    const HemisphereGrid& grid = impl_->grid;
    std::vector<Record> records(pixels.size());
    std::vector<GatherWorkspace> workspaces(static_cast<std::size_t>(pool.size()), GatherWorkspace(grid.cells));
    pool.parallel_for(pixels.size(), 4, [&](std::size_t begin, std::size_t end, int thread) {
        for (std::size_t i = begin; i < end; ++i)
            records[i] = impl_->gatherer.gather(birth_at(gbuffer, pixels[i], impl_->seed), grid,
                                                workspaces[static_cast<std::size_t>(thread)]);
    });
    count(workspaces, stats);
    stats.records += records.size();
    return records;
}

void RecordGatherer::gather_more(const GBuffer& gbuffer, std::span<const std::uint32_t> pixels,
                                 std::span<const int> extra, std::span<Record> records, ThreadPool& pool,
                                 RecordStats& stats, const std::function<void(float)>& report) const
{
    std::vector<std::size_t> wanted;  // which records get more
    std::map<int, HemisphereGrid> grids;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        if (extra[i] <= 0) continue;
        wanted.push_back(i);
        if (!grids.contains(extra[i]))
            grids[extra[i]] = make_hemisphere_grid(
                static_cast<int>(std::min<std::int64_t>(std::int64_t{extra[i]} * rays(), kMostHemisphereRays)));
    }
    if (wanted.empty()) return;
    int most_cells = 0;
    for (const auto& [times, grid] : grids) most_cells = std::max(most_cells, grid.cells);
    std::vector<GatherWorkspace> workspaces(static_cast<std::size_t>(pool.size()), GatherWorkspace(most_cells));
    for (std::size_t done = 0; done < wanted.size(); done += kBatch) {
        report(static_cast<float>(done) / static_cast<float>(wanted.size()));
        pool.parallel_for(
            std::min(kBatch, wanted.size() - done), 4, [&](std::size_t begin, std::size_t end, int thread) {
                for (std::size_t k = done + begin; k < done + end; ++k) {
                    Record& record = records[wanted[k]];
                    const Birth birth =
                        birth_at(gbuffer, pixels[wanted[k]], impl_->seed, static_cast<std::uint64_t>(record.rays));
                    add_gather(record, impl_->gatherer.gather(birth, grids.at(extra[wanted[k]]),
                                                              workspaces[static_cast<std::size_t>(thread)]));
                }
            });
    }
    RecordStats more;
    count(workspaces, more);
    stats.hemisphere_rays += more.hemisphere_rays;
    stats.shadow_rays += more.shadow_rays;
    stats.refining_rays += more.hemisphere_rays;
    stats.refined += wanted.size();
}

std::vector<Record> gather_records(const LitScene& scene, const GBuffer& gbuffer,
                                   const std::vector<std::uint32_t>& pixels, const RecordSettings& options,
                                   ThreadPool& pool, RecordStats& stats)
{
    return RecordGatherer(scene, options).gather(gbuffer, pixels, pool, stats);
}

}  // namespace rcs
