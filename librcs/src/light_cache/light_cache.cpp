#include "rcs/light_cache.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cells/light_cache_impl.h"
#include "facts/scene_effects.h"
#include "light_cache/bounces.h"
#include "light_cache/cell_finder.h"
#include "light_cache/cell_rays.h"
#include "rcs/error.h"
#include "util/random.h"

namespace rcs {
namespace {

constexpr int kRays = CellRays::kRays;

// Levels by which cells that only other cells see are coarser than those that visible points see.
constexpr int kCoarser = 2;

/// Some of them more than once where there are not enough.
std::array<SurfaceSample, CellRays::kPackets> places_of(const CellFinder& finder, std::size_t cell)
{
    const std::span<const SurfaceSample> places = finder.places(cell);
    std::array<SurfaceSample, CellRays::kPackets> result{};
    for (std::size_t k = 0; k < result.size(); ++k) result[k] = places[k % places.size()];
    return result;
}

class Builder {
public:
    Builder(const RayScene& rays, const CellGrid& grid, const LightCacheSettings& options, ThreadPool& pool)
        : rays_(rays),
          radiance_(rays, nullptr, effects_or_scene(options.effects, rays)),
          options_(options),
          pool_(pool),
          finder_(grid, options.max_cells, CellRays::kPackets),
          workers_(static_cast<std::size_t>(pool.size()), CellRays(rays_, radiance_))
    {
        cache_->grid = grid;
    }

    /// What cells find that are made here is two reflections before the camera at least: coarser ones will do for that,
    /// and only where no cell is near.
    void look_around(const GBuffer& gbuffer)
    {
        rcs::look_around(gbuffer, options_.seed, pool_, workers_, finder_);
        finder_.take_coarser(kCoarser);
    }
    std::vector<CellFind> link_new_cells(std::size_t first);
    void add(std::vector<CellFind> finds) { finder_.add(std::move(finds)); }
    void add_parents();
    void connect();

    std::size_t cells() const { return finder_.size(); }
    std::unique_ptr<LightCache::Impl> finish(LightCacheStats& stats);

private:
    const RayScene& rays_;
    HitRadiance radiance_;
    LightCacheSettings options_;
    ThreadPool& pool_;
    std::unique_ptr<LightCache::Impl> cache_ = std::make_unique<LightCache::Impl>();
    CellFinder finder_;
    std::vector<CellRays> workers_;
    std::vector<std::uint64_t> ends_;  // per link: the leaf where it ends, which may not exist
    BounceSystem system_;
};

/// Shoots the rays of the cells from `first` on. @return what they met outside of all cells
std::vector<CellFind> Builder::link_new_cells(std::size_t first)
{
    system_.resize_leaves(cells());
    ends_.resize(cells() * kRays);
    std::vector<std::vector<CellFind>> found(workers_.size());
    pool_.parallel_for(cells() - first, 16, [&](std::size_t begin, std::size_t end, int thread) {
        const auto t = static_cast<std::size_t>(thread);
        for (std::size_t c = first + begin; c < first + end; ++c) {
            const std::uint64_t key = stream_key(options_.seed + 2, Stream::light_cache, finder_.keys()[c]);
            workers_[t].trace(places_of(finder_, c), key, true);
            RandomStream random(mix64(key));
            system_.source[c] = workers_[t].direct_irradiance();
            for (std::size_t i = 0; i < kRays; ++i) {
                const CellHit& hit = workers_[t].hits()[i];
                system_.links[c * kRays + i] = make_link(hit.hit, hit.reflectance);
                if (hit.hit)
                    ends_[c * kRays + i] = leaf_near(cache_->grid, hit.surface.position, hit.surface.normal, random);
            }
            finder_.note(workers_[t].hits(), key, found[t]);
        }
    });
    std::vector<CellFind> finds;
    for (const std::vector<CellFind>& part : found) finds.insert(finds.end(), part.begin(), part.end());
    return finds;
}

/// The coarser cells above all leaves, and the one above everything.
void Builder::add_parents()
{
    const std::vector<std::uint64_t>& keys = finder_.keys();
    std::size_t count = keys.size();
    cache_->table.reserve(finder_.with_coarser());
    for (std::size_t c = 0; c < keys.size(); ++c) cache_->table.insert(keys[c], static_cast<std::uint32_t>(c));
    for (std::size_t c = 0; c < keys.size(); ++c) {
        std::uint64_t key = keys[c];
        while (CellGrid::level_of(key) + 1 < CellGrid::kLevels) {
            key = CellGrid::parent(key);
            std::uint32_t parent = cache_->table.find(key);
            if (parent == CellTable::kNone) {
                parent = static_cast<std::uint32_t>(count++);
                cache_->table.insert(key, parent);
            }
            if (parent >= keys.size())  // else a cell with rays of its own
                system_.parents.push_back({static_cast<std::uint32_t>(c), parent});
        }
        system_.parents.push_back({static_cast<std::uint32_t>(c), BounceSystem::kTop});
    }
    system_.cells = count + 1;
    cache_->irradiance.assign(system_.cells, glm::vec3(0.0f));
}

/// Gives every ray's end the number of a cell: known only when all cells are.
void Builder::connect()
{
    pool_.parallel_for(cells(), 64, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t c = begin; c < end; ++c) {
            for (std::size_t i = c * kRays; i < (c + 1) * kRays; ++i)
                if (system_.links[i].cell != CellTable::kNone) system_.links[i].cell = cache_->find(ends_[i]);
        }
    });
}

std::unique_ptr<LightCache::Impl> Builder::finish(LightCacheStats& stats)
{
    cache_->bounces = options_.bounces;
    cache_->fewer.resize(static_cast<std::size_t>(options_.kept_fewer));
    iterate_bounces(system_, options_.bounces, pool_, cache_->irradiance, cache_->fewer);
    stats.cells = cells();
    for (const CellRays& worker : workers_) {
        stats.rays += worker.ray_count;
        stats.shadow_rays += worker.shadow_ray_count;
    }
    for (const Link& link : system_.links) stats.links += link.cell != CellTable::kNone;
    stats.bytes = cache_->table.bytes() + cache_->irradiance.size() * sizeof(glm::vec3);
    for (const std::vector<glm::vec3>& irradiance : cache_->fewer) stats.bytes += irradiance.size() * sizeof(glm::vec3);
    return std::move(cache_);
}

}  // namespace

void validate(const LightCacheSettings& o)
{
    if (o.bounces < 1 || o.bounces > 64)
        throw Error(ErrorCode::bad_argument,
                    "light_cache.bounces is " + std::to_string(o.bounces) + ", expected a value in [1, 64]");
    if (o.kept_fewer < 0 || o.kept_fewer > 63)
        throw Error(ErrorCode::bad_argument,
                    "light_cache.kept_fewer is " + std::to_string(o.kept_fewer) + ", expected a value in [0, 63]");
    if (o.max_cells < 1 || o.max_cells > 1 << 24)
        throw Error(ErrorCode::bad_argument,
                    "light_cache.max_cells is " + std::to_string(o.max_cells) + ", expected a value in [1, 16777216]");
}

LightCache build_light_cache(const RayScene& rays, const GBuffer& gbuffer, const View& view,
                             const LightCacheSettings& options, ThreadPool& pool, LightCacheStats& stats,
                             const ProgressFunction& progress)
{
    validate(options);
    Bounds bounds = bounds_of(rays.scene());
    if (!(bounds.min.x <= bounds.max.x)) bounds = {glm::dvec3(0.0), glm::dvec3(0.0)};
    Builder builder(rays, make_cell_grid(bounds, view), options, pool);
    const auto report = [&](float done) {
        if (progress && !progress("bounces", done))
            throw Error(ErrorCode::cancelled, "cancelled while filling the light cache");
    };
    report(0.0f);
    builder.look_around(gbuffer);
    const std::size_t first = builder.cells();
    std::vector<CellFind> finds = builder.link_new_cells(0);
    report(0.5f);
    builder.add(std::move(finds));
    builder.link_new_cells(first);
    builder.add_parents();
    builder.connect();
    return LightCache(builder.finish(stats));
}

LightCache::LightCache(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
LightCache::~LightCache() = default;
LightCache::LightCache(LightCache&&) noexcept = default;
LightCache& LightCache::operator=(LightCache&&) noexcept = default;

}  // namespace rcs
