#include "records/gather.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "rcs/error.h"
#include "rcs/records.h"
#include "records/gather_waves.h"
#include "records/gatherer.h"
#include "records/hemisphere.h"
#include "records/known_record.h"
#include "util/color.h"
#include "util/random.h"

namespace rcs {
namespace {

constexpr std::size_t kBatch = 2048;  // records between two reports of progress

/// By place, not by pixel: a record made in another pass or view is another sample.
std::uint64_t key_of(glm::vec3 position, std::uint64_t seed, std::uint64_t sample)
{
    std::uint64_t key = stream_key(seed, Stream::gather, std::bit_cast<std::uint32_t>(position.x));
    key = mix64(key ^ std::bit_cast<std::uint32_t>(position.y));
    return mix64(key ^ std::bit_cast<std::uint32_t>(position.z) ^ sample << 32);
}

}  // namespace

Birth birth_at(const GBuffer& g, std::uint32_t pixel, std::uint64_t seed, std::uint64_t sample)
{
    Birth b;
    b.position = g.scene_position(pixel);
    b.normal = g.normal(pixel);
    b.geometric_normal = g.geometric_normal[pixel];
    b.origin = b.position + g.position_error[pixel] * b.geometric_normal;
    b.footprint = g.footprint[pixel];
    b.instance = g.instance[pixel];
    b.key = key_of(b.position, seed, sample);
    return b;
}

Birth birth_of(const Record& record, std::uint64_t seed, std::uint64_t sample)
{
    const RecordWatch& watch = record.watch;
    return {record.position,
            watch.origin,
            record.normal,
            watch.geometric_normal,
            record.footprint,
            watch.instance,
            key_of(record.position, seed, sample)};
}

namespace {

// Part of a gather's rays that a map aims: from a quarter to seven tenths do about as well.
constexpr float kAimed = 0.5f;

// The first gather at a place also says how far the record reaches, and how its light changes: that takes so many
// strata, or most of the rays, whatever part of them would be looks.
constexpr int kLeastFirstStrata = 48;

int looks_of(int rays, float share) { return static_cast<int>(std::lround(share * static_cast<float>(rays))); }

/// @param times  so many gathers at once
GatherSize gather_size(int rays, float share, int times, bool aims)
{
    const int looks = looks_of(rays, share);
    const std::int64_t strata = std::int64_t{times} * make_hemisphere_grid(rays - looks).cells;
    return {make_hemisphere_grid(static_cast<int>(std::min<std::int64_t>(strata, kMostHemisphereRays))),
            aims ? 0 : times * looks, aims ? times * looks : 0};
}

GatherSize first_size(int rays, float share, bool aims)
{
    const int looks = std::min(looks_of(rays, share), most_first_looks(rays));
    return {make_hemisphere_grid(rays - looks), aims ? 0 : looks, aims ? looks : 0};
}

}  // namespace

int most_first_looks(int rays) { return rays - std::min(kLeastFirstStrata, 3 * rays / 4); }

struct RecordGatherer::Impl {
    GatherGuide* guide;  // may be null
    ArrivalMap* map;     // may be null
    RayCaster* caster;   // may be null
    Gatherer gatherer;
    int asked;    // rays of a gather
    float share;  // of looks
    GatherSize first, more;
    std::uint64_t seed;

    Impl(const LitScene& scene, const RecordSettings& options)
        : guide(scene.guide && scene.guide->share > 0.0f ? scene.guide : nullptr),
          map(scene.arrivals),
          caster(scene.caster),
          gatherer({scene.rays, options.bounces > 1 ? scene.cache : nullptr, guide, scene.gathered, nullptr,
                    scene.direct, scene.arrivals},
                   options),
          asked(options.rays),
          share(guide ? guide->share
                : map ? kAimed
                      : 0.0f),
          first(first_size(asked, share, map)),
          more(gather_size(asked, share, 1, map)),
          seed(options.seed)
    {
    }

    template <typename Task, typename Keep>
    GatherYield each(std::size_t count, int most_cells, const Task& task, ThreadPool& pool, const Keep& keep) const
    {
        return gather_each(gatherer, caster, count, most_cells, task, pool, keep);
    }

    /// What looks found, for those to come: only when all are done, whatever thread did which.
    void learn(const GatherYield& yield, ThreadPool& pool) const
    {
        if (guide) guide->learn(yield.seen);
        if (map) map->learn(yield.gathers, yield.arrived, pool);
    }
};

RecordGatherer::RecordGatherer(const LitScene& scene, const RecordSettings& options) : impl_(new Impl(scene, options))
{
    if (options.bounces > 1 && !scene.cache)
        throw Error(ErrorCode::bad_argument, "bounces is " + std::to_string(options.bounces) +
                                                 ", which takes a light cache; expected 0 or 1 without one");
}

RecordGatherer::~RecordGatherer() = default;

int RecordGatherer::rays() const { return impl_->more.rays(); }
bool RecordGatherer::looks() const { return impl_->guide != nullptr; }

std::vector<Record> RecordGatherer::gather(const GBuffer& gbuffer, const std::vector<std::uint32_t>& pixels,
                                           ThreadPool& pool, RecordStats& stats) const
{
    std::vector<Record> records(pixels.size());
    const GatherYield yield = impl_->each(
        pixels.size(), impl_->first.cells(),
        [&](std::size_t i) { return GatherTask{birth_at(gbuffer, pixels[i], impl_->seed), &impl_->first}; }, pool,
        [&](std::size_t i, Record&& record, const GatherWorkspace&) { records[i] = std::move(record); });
    impl_->learn(yield, pool);
    yield.count(stats);
    stats.records += records.size();
    return records;
}

void RecordGatherer::gather_more(const GBuffer& gbuffer, std::span<const std::uint32_t> pixels,
                                 std::span<const int> extra, std::span<Record> records, ThreadPool& pool,
                                 RecordStats& stats, const std::function<void(float)>& report) const
{
    std::vector<std::size_t> wanted;  // which records get more
    std::map<int, GatherSize> sizes;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        if (extra[i] <= 0) continue;
        wanted.push_back(i);
        if (!sizes.contains(extra[i])) sizes[extra[i]] = gather_size(impl_->asked, impl_->share, extra[i], impl_->map);
    }
    if (wanted.empty()) return;
    int most_cells = 0;
    for (const auto& [times, size] : sizes) most_cells = std::max(most_cells, size.cells());
    RecordStats more;
    for (std::size_t done = 0; done < wanted.size(); done += kBatch) {
        report(static_cast<float>(done) / static_cast<float>(wanted.size()));
        const GatherYield yield = impl_->each(
            std::min(kBatch, wanted.size() - done), most_cells,
            [&](std::size_t i) {
                const std::size_t k = wanted[done + i];
                const auto sample = static_cast<std::uint64_t>(records[k].rays);
                const Birth birth = is_born(records[k]) ? birth_of(records[k], impl_->seed, sample)
                                                        : birth_at(gbuffer, pixels[k], impl_->seed, sample);
                return GatherTask{birth, &sizes.at(extra[k])};
            },
            pool,
            [&](std::size_t i, const Record& record, const GatherWorkspace&) {
                add_gather(records[wanted[done + i]], record);
            });
        impl_->learn(yield, pool);
        yield.count(more);
    }
    stats.hemisphere_rays += more.hemisphere_rays;
    stats.aimed_rays += more.aimed_rays;
    stats.shadow_rays += more.shadow_rays;
    stats.looks += more.looks;
    stats.refining_rays += more.hemisphere_rays + more.looks;
    stats.refined += wanted.size();
}

void RecordGatherer::renew(std::span<Record> records, std::span<const std::uint32_t> which, ThreadPool& pool,
                           RecordStats& stats) const
{
    std::vector<int> rays;
    for (const std::uint32_t k : which) rays.push_back(records[k].rays);
    renew(records, which, rays, pool, stats);
}

void RecordGatherer::renew(std::span<Record> records, std::span<const std::uint32_t> which, std::span<const int> rays,
                           ThreadPool& pool, RecordStats& stats) const
{
    const int once = impl_->more.rays();
    const auto gathers_more = [&](std::size_t i) {
        return std::max(0, static_cast<int>(std::lround(static_cast<double>(rays[i] - impl_->first.rays()) / once)));
    };
    std::map<int, GatherSize> sizes;
    std::vector<std::size_t> with_more;  // numbers in `which`
    int most_cells = 1;
    for (std::size_t i = 0; i < which.size(); ++i) {
        const int more = gathers_more(i);
        if (more == 0) continue;
        with_more.push_back(i);
        if (sizes.contains(more)) continue;
        most_cells =
            std::max(most_cells, (sizes[more] = gather_size(impl_->asked, impl_->share, more, impl_->map)).cells());
    }
    std::vector<Record> renewed(which.size());
    const GatherYield first = impl_->each(
        which.size(), impl_->first.cells(),
        [&](std::size_t i) { return GatherTask{birth_of(records[which[i]], impl_->seed), &impl_->first}; }, pool,
        [&](std::size_t i, Record&& record, const GatherWorkspace&) { renewed[i] = std::move(record); });
    const GatherYield more = impl_->each(
        with_more.size(), most_cells,
        [&](std::size_t k) {
            const std::size_t i = with_more[k];
            const auto sample = static_cast<std::uint64_t>(renewed[i].rays);
            return GatherTask{birth_of(records[which[i]], impl_->seed, sample), &sizes.at(gathers_more(i))};
        },
        pool,
        [&](std::size_t k, const Record& record, const GatherWorkspace&) {
            add_gather(renewed[with_more[k]], record);
        });
    for (std::size_t i = 0; i < which.size(); ++i) {
        Record& old = records[which[i]];
        Record& r = renewed[i];
        r.closeness = old.closeness;
        r.breadth = old.breadth;
        r.spacing_radius = old.spacing_radius;
        r.gradient_scale = old.gradient_scale;
        r.watch = std::move(old.watch);
        old = std::move(r);
    }
    for (const GatherYield* yield : {&first, &more}) {
        impl_->learn(*yield, pool);
        yield->count(stats);
    }
}

std::vector<Sounding> RecordGatherer::sound(const GBuffer& gbuffer, std::span<const std::uint32_t> pixels, int rays,
                                            std::uint64_t sample, ThreadPool& pool) const
{
    const GatherSize size = first_size(rays, impl_->share, impl_->map);
    const std::uint64_t seed = stream_key(impl_->seed, Stream::probes, sample);
    std::vector<Sounding> found(pixels.size());
    impl_->each(
        pixels.size(), size.cells(),
        [&](std::size_t i) { return GatherTask{birth_at(gbuffer, pixels[i], seed), &size}; }, pool,
        [&](std::size_t i, const Record& r, const GatherWorkspace&) {
            found[i] = {static_cast<double>(luminance(r.irradiance)), r.rays};
        });
    return found;
}

std::vector<Record> gather_records(const LitScene& scene, const GBuffer& gbuffer,
                                   const std::vector<std::uint32_t>& pixels, const RecordSettings& options,
                                   ThreadPool& pool, RecordStats& stats)
{
    return RecordGatherer(scene, options).gather(gbuffer, pixels, pool, stats);
}

}  // namespace rcs
