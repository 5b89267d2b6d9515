#include "rcs/light_cache.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "cells/light_cache_impl.h"
#include "facts/scene_effects.h"
#include "light_cache/bounces.h"
#include "light_cache/cell_rays.h"
#include "rcs/error.h"
#include "util/random.h"

namespace rcs {
namespace {

constexpr int kPlaces = CellRays::kPackets;  // of a cell, from which its rays start
constexpr int kRays = CellRays::kRays;

// Visible points of the first look around: one in each cell of a grid of so many rows and columns.
constexpr int kLooks = 64;

// Cells found by the visible points' rays, and by the rays of those cells. What the latter see is two reflections
// before the camera at least: cells so many levels coarser will do, and only where no cell is near.
constexpr int kRounds = 2;
constexpr int kCoarser = 2;

/// A surface for which a cell may be needed.
struct Find {
    std::uint64_t cell;  // key
    std::uint64_t rank;  // of all finds of a cell, those of least rank become its places
    SurfaceSample surface;
};

std::vector<SurfaceSample> visible_points(const GBuffer& g, std::uint64_t seed)
{
    std::vector<SurfaceSample> points;
    const int columns = std::min(kLooks, g.width), rows = std::min(kLooks, g.height);
    for (int cy = 0; cy < rows; ++cy) {
        for (int cx = 0; cx < columns; ++cx) {
            RandomStream random(stream_key(seed, Stream::light_cache, static_cast<std::uint64_t>(cy * kLooks + cx)));
            const auto within = [&](int cell, int cells, int pixels) {
                const float at = (static_cast<float>(cell) + random.next()) / static_cast<float>(cells);
                return std::min(static_cast<int>(at * static_cast<float>(pixels)), pixels - 1);
            };
            const int x = within(cx, columns, g.width), y = within(cy, rows, g.height);
            const std::size_t i =
                static_cast<std::size_t>(y) * static_cast<std::size_t>(g.width) + static_cast<std::size_t>(x);
            if (g.covered(i))
                points.push_back({g.scene_position(i), g.position_error[i], g.geometric_normal[i], g.normal(i)});
        }
    }
    return points;
}

class Builder {
public:
    Builder(const RayScene& rays, const CellGrid& grid, const LightCacheSettings& options, ThreadPool& pool)
        : rays_(rays), radiance_(rays, nullptr, effects_or_scene(options.effects, rays)), options_(options), pool_(pool)
    {
        cache_->grid = grid;
        for (int i = 0; i < pool.size(); ++i) workers_.push_back({CellRays(rays_, radiance_), {}});
    }

    void look_around(const GBuffer& gbuffer);
    void link_new_cells(std::size_t first);
    void find_cells();
    void add_parents();
    void connect();

    std::size_t cells() const { return places_.size(); }
    std::unique_ptr<LightCache::Impl> finish(LightCacheStats& stats);

private:
    struct Worker {
        CellRays rays;
        std::vector<Find> finds;
    };

    std::uint64_t leaf(const SurfaceSample& s) const
    {
        return cache_->grid.leaf(s.position, s.normal, cache_->grid.level(s.position));
    }
    void note_finds(Worker& worker, std::uint64_t key) const;
    std::vector<Find> take_finds();
    void add_cell(std::uint64_t cell, const std::array<SurfaceSample, kPlaces>& places);

    const RayScene& rays_;
    HitRadiance radiance_;
    LightCacheSettings options_;
    ThreadPool& pool_;
    std::unique_ptr<LightCache::Impl> cache_ = std::make_unique<LightCache::Impl>();
    std::vector<Worker> workers_;
    CellTable known_;                                         // all leaves so far and the coarser cells above them
    std::vector<std::uint64_t> keys_;                         // per leaf
    std::vector<std::array<SurfaceSample, kPlaces>> places_;  // per leaf
    int coarser_ = 0;                  // levels by which cells now found are coarser than their place asks for
    std::vector<std::uint64_t> ends_;  // per link: the leaf where it ends, which may not exist
    BounceSystem system_;
};

/// Keeps the rays' hits that lie in no cell yet.
void Builder::note_finds(Worker& worker, std::uint64_t key) const
{
    for (std::size_t i = 0; i < worker.rays.hits().size(); ++i) {
        const CellHit& hit = worker.rays.hits()[i];
        if (!hit.hit) continue;
        std::uint64_t cell = leaf(hit.surface);
        bool known = known_.find(cell) != CellTable::kNone;
        for (int up = 0; up < coarser_ && !known && CellGrid::level_of(cell) + 1 < CellGrid::kLevels; ++up) {
            cell = CellGrid::parent(cell);
            known = known_.find(cell) != CellTable::kNone;
        }
        if (!known) worker.finds.push_back({cell, mix64(key - 1 - i), hit.surface});
    }
}

void Builder::look_around(const GBuffer& gbuffer)
{
    const std::vector<SurfaceSample> points = visible_points(gbuffer, options_.seed);
    pool_.parallel_for(points.size(), 16, [&](std::size_t begin, std::size_t end, int thread) {
        Worker& worker = workers_[static_cast<std::size_t>(thread)];
        for (std::size_t i = begin; i < end; ++i) {
            const std::uint64_t key = stream_key(options_.seed + 1, Stream::light_cache, i);
            worker.rays.trace({points[i], points[i], points[i], points[i]}, key, false);
            note_finds(worker, key);
        }
    });
}

/// All finds of the workers, coarser where they would be too many.
std::vector<Find> Builder::take_finds()
{
    std::vector<Find> finds;
    for (Worker& worker : workers_) {
        finds.insert(finds.end(), worker.finds.begin(), worker.finds.end());
        worker.finds.clear();
    }
    std::vector<std::uint64_t> cells;
    for (;;) {
        cells.clear();
        for (const Find& find : finds) cells.push_back(find.cell);
        std::sort(cells.begin(), cells.end());
        const auto end = std::unique(cells.begin(), cells.end());
        if (end - cells.begin() <= options_.max_cells) return finds;
        bool coarser = false;
        for (Find& find : finds) {
            if (CellGrid::level_of(find.cell) + 1 == CellGrid::kLevels) continue;
            find.cell = CellGrid::parent(find.cell);
            coarser = true;
        }
        if (!coarser) return finds;
        ++coarser_;
    }
}

/// Makes the cells of all finds so far, in the order of their keys.
void Builder::find_cells()
{
    const std::vector<Find> finds = take_finds();
    std::vector<std::uint32_t> order(finds.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<std::uint32_t>(i);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return std::pair(finds[a].cell, finds[a].rank) < std::pair(finds[b].cell, finds[b].rank);
    });
    known_.reserve((keys_.size() + order.size()) * 2);
    for (std::size_t i = 0; i < order.size();) {
        const std::uint64_t cell = finds[order[i]].cell;
        std::array<SurfaceSample, kPlaces> places{};
        std::size_t count = 0;
        for (; i < order.size() && finds[order[i]].cell == cell; ++i)
            if (count < places.size()) places[count++] = finds[order[i]].surface;
        for (std::size_t k = count; k < places.size(); ++k) places[k] = places[k % count];
        add_cell(cell, places);
    }
    coarser_ += kCoarser;
}

void Builder::add_cell(std::uint64_t cell, const std::array<SurfaceSample, kPlaces>& places)
{
    keys_.push_back(cell);
    places_.push_back(places);
    for (;; cell = CellGrid::parent(cell)) {
        if (known_.find(cell) == CellTable::kNone) known_.insert(cell, 0);
        if (CellGrid::level_of(cell) + 1 == CellGrid::kLevels) return;
    }
}

/// Shoots the rays of the cells from `first` on.
void Builder::link_new_cells(std::size_t first)
{
    system_.resize_leaves(places_.size());
    ends_.resize(places_.size() * kRays);
    pool_.parallel_for(places_.size() - first, 16, [&](std::size_t begin, std::size_t end, int thread) {
        Worker& worker = workers_[static_cast<std::size_t>(thread)];
        for (std::size_t c = first + begin; c < first + end; ++c) {
            const std::uint64_t key = stream_key(options_.seed + 2, Stream::light_cache, keys_[c]);
            worker.rays.trace(places_[c], key, true);
            RandomStream random(mix64(key));
            system_.source[c] = worker.rays.direct_irradiance();
            for (std::size_t i = 0; i < kRays; ++i) {
                const CellHit& hit = worker.rays.hits()[i];
                system_.links[c * kRays + i] = make_link(hit.hit, hit.reflectance);
                if (hit.hit)
                    ends_[c * kRays + i] = leaf_near(cache_->grid, hit.surface.position, hit.surface.normal, random);
            }
            note_finds(worker, key);
        }
    });
}

/// The coarser cells above all leaves, and the one above everything.
void Builder::add_parents()
{
    std::size_t count = keys_.size();
    cache_->table.reserve(known_.size());
    for (std::size_t c = 0; c < keys_.size(); ++c) cache_->table.insert(keys_[c], static_cast<std::uint32_t>(c));
    for (std::size_t c = 0; c < keys_.size(); ++c) {
        std::uint64_t key = keys_[c];
        while (CellGrid::level_of(key) + 1 < CellGrid::kLevels) {
            key = CellGrid::parent(key);
            std::uint32_t parent = cache_->table.find(key);
            if (parent == CellTable::kNone) {
                parent = static_cast<std::uint32_t>(count++);
                cache_->table.insert(key, parent);
            }
            if (parent >= keys_.size())  // else a cell with rays of its own
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
    pool_.parallel_for(places_.size(), 64, [&](std::size_t begin, std::size_t end, int) {
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
    stats.cells = places_.size();
    for (const Worker& worker : workers_) {
        stats.rays += worker.rays.ray_count;
        stats.shadow_rays += worker.rays.shadow_ray_count;
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
    builder.look_around(gbuffer);
    std::size_t known = 0;
    for (int round = 0; round < kRounds; ++round) {
        if (progress && !progress("bounces", static_cast<float>(round) / kRounds))
            throw Error(ErrorCode::cancelled, "cancelled while filling the light cache");
        builder.find_cells();
        builder.link_new_cells(std::exchange(known, builder.cells()));
    }
    builder.add_parents();
    builder.connect();
    return LightCache(builder.finish(stats));
}

LightCache::LightCache(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
LightCache::~LightCache() = default;
LightCache::LightCache(LightCache&&) noexcept = default;
LightCache& LightCache::operator=(LightCache&&) noexcept = default;

}  // namespace rcs
