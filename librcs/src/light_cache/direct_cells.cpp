#include "light_cache/direct_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>
#include <vector>

#include "light_cache/cell_finder.h"
#include "rays/shadow_batch.h"
#include "util/color.h"

namespace rcs {
namespace {

constexpr int kMostCells = 80'000;
// Samples of a cell that are taken together: once to tell how many it takes, at most so many times.
constexpr int kSamples = 16, kMostTimes = 256;
// Of all samples, this part is for all cells alike, at most so many times: where the first ones of the cells around
// found nothing, one that finds what is rare would make a cell as bright as a dozen of them.
constexpr double kAlike = 0.5;
constexpr int kMostAlike = 8;
// A cell of which fewer places are seen is not known: one of them does not tell what the others receive, and few rays
// end in it.
constexpr std::size_t kLeastPlaces = 2;
// The other cells around tell of that, so many levels up: were it a cell's own samples, those that by chance found much
// would be outvoted by others, and those that found little would not.
constexpr int kAround = 2;

/// Lights drawn from one half of a cell's samples, each in proportion to its luminance (reservoirs of one).
struct KeptLights {
    double arrived = 0.0;  // luminance, of all
    int samples = 0;
    std::array<DirectCells::Light, DirectCells::kLights / 2> lights{};  // irradiance over its luminance

    void add(glm::vec3 light, glm::vec3 to_light, RandomStream& random)
    {
        const float l = luminance(light);
        if (!(l > 0.0f)) return;
        arrived += static_cast<double>(l);
        for (DirectCells::Light& one : lights)
            if (static_cast<double>(random.next()) * arrived < static_cast<double>(l)) one = {light / l, to_light};
    }
};

/// Sums over a cell's samples.
struct CellSum {
    glm::dvec3 irradiance{0.0};
    double squares = 0.0;  // of luminance
    int samples = 0;
    std::array<KeptLights, 2> kept{};

    double mean() const { return static_cast<double>(luminance(glm::vec3(irradiance))) / std::max(samples, 1); }
    /// Of one sample.
    double variance() const { return std::max(0.0, squares / std::max(samples, 1) - mean() * mean()); }

    void add(const CellSum& other, int sign = 1)
    {
        irradiance += static_cast<double>(sign) * other.irradiance;
        squares += static_cast<double>(sign) * other.squares;
        samples += sign * other.samples;
    }
};

struct CellWorker {
    ShadowBatch shadow;
    struct Wanted {
        int sample;
        glm::vec3 irradiance, to_light;
    };
    std::vector<Wanted> wanted;
};

/// Of a sample: the halves have other places as well, where there are several.
std::size_t half_of(int sample) { return static_cast<std::size_t>(sample % 2); }

void sample_cell(const RayScene& rays, const HitRadiance& radiance, std::span<const SurfaceSample> places,
                 std::uint64_t key, CellWorker& w, CellSum& sum)
{
    w.shadow.clear();
    w.wanted.clear();
    for (int k = 0; k < kSamples; ++k) {
        RandomStream random(mix64(key + static_cast<std::uint64_t>(k)));
        radiance.direct(point_of(places[static_cast<std::size_t>(k) % places.size()]), random,
                        [&](const Ray& ray, glm::vec3 white) {
                            w.shadow.add(ray);
                            w.wanted.push_back({k, std::numbers::pi_v<float> * white, ray.direction});
                        });
    }
    w.shadow.trace(rays);
    std::array<glm::dvec3, kSamples> arrived{};
    RandomStream random(mix64(~key));
    for (std::size_t i = 0; i < w.wanted.size(); ++i) {
        if (!w.shadow.is_free(i)) continue;
        const glm::vec3 light = w.shadow.transmittance(i) * w.wanted[i].irradiance;
        arrived[static_cast<std::size_t>(w.wanted[i].sample)] += glm::dvec3(light);
        sum.kept[half_of(w.wanted[i].sample)].add(light, w.wanted[i].to_light, random);
    }
    for (const glm::dvec3& a : arrived) {
        const auto l = static_cast<double>(luminance(glm::vec3(a)));
        sum.irradiance += a;
        sum.squares += l * l;
    }
    sum.samples += kSamples;
    for (KeptLights& half : sum.kept) half.samples += kSamples / 2;
}

std::array<DirectCells::Light, DirectCells::kLights> lights_of(const CellSum& sum)
{
    std::array<DirectCells::Light, DirectCells::kLights> lights;
    auto next = lights.begin();
    for (const KeptLights& half : sum.kept)
        for (const DirectCells::Light& light : half.lights)
            *next++ = {static_cast<float>(half.arrived / half.samples) * light.irradiance, light.to_light};
    return lights;
}

std::uint64_t around(std::uint64_t cell)
{
    for (int up = 0; up < kAround && CellGrid::level_of(cell) + 1 < CellGrid::kLevels; ++up)
        cell = CellGrid::parent(cell);
    return cell;
}

/// How many times kSamples each cell is to have in all: for the least noise of what all hits together find, as many as
/// hits and the deviation of a sample ask for. @param budget  samples for all
std::vector<int> times_wanted(const CellFinder& finder, std::span<const CellSum> sums, double budget)
{
    const std::span<const std::uint64_t> keys = finder.keys();
    CellTable table;
    std::vector<CellSum> neighbourhoods;
    for (std::size_t c = 0; c < keys.size(); ++c) {
        const std::uint64_t key = around(keys[c]);
        const std::uint32_t number = table.find_or_insert(key, static_cast<std::uint32_t>(neighbourhoods.size()));
        if (number == neighbourhoods.size()) neighbourhoods.emplace_back();
        neighbourhoods[number].add(sums[c]);
    }
    std::vector<double> wanted;
    double sum = 0.0;
    for (std::size_t c = 0; c < keys.size(); ++c) {
        CellSum others = neighbourhoods[table.find(around(keys[c]))];
        others.add(sums[c], -1);
        wanted.push_back(static_cast<double>(finder.counts()[c]) * std::sqrt(others.variance()));
        sum += wanted.back();
    }
    const double all = budget / kSamples;
    const double least =
        std::clamp(std::floor(kAlike * all / static_cast<double>(keys.size())), 1.0, double{kMostAlike});
    const double rest = least > 1.0 ? all - least * static_cast<double>(keys.size()) : all;
    const double scale = sum > 0.0 ? rest / sum : 0.0;
    std::vector<int> times;
    for (const double more : wanted)
        times.push_back(static_cast<int>(std::clamp(std::ceil(scale * more), least, double{kMostTimes})));
    return times;
}

}  // namespace

DirectCells light_cells(const RayScene& rays, const HitRadiance& radiance, const GBuffer& gbuffer, const View& view,
                        double samples, std::uint64_t seed, ThreadPool& pool)
{
    DirectCells cells;
    cells.grid = make_cell_grid(bounds_of(rays.scene()), view);
    CellFinder finder(cells.grid, kMostCells, kSamples);
    std::vector<CellRays> lookers(static_cast<std::size_t>(pool.size()), CellRays(rays, radiance));
    look_around(gbuffer, stream_key(seed, Stream::light_cache, 1), pool, lookers, finder);
    if (samples < kSamples * static_cast<double>(finder.size())) return cells;
    std::vector<CellSum> sums(finder.size());
    std::vector<CellWorker> workers(static_cast<std::size_t>(pool.size()));
    const auto sample = [&](std::size_t c, int time, int thread) {
        const std::uint64_t key = stream_key(seed + 3, Stream::light_cache, finder.keys()[c]);
        sample_cell(rays, radiance, finder.places(c), mix64(key + static_cast<std::uint64_t>(time)),
                    workers[static_cast<std::size_t>(thread)], sums[c]);
    };
    const auto is_known = [&](std::size_t c) { return finder.places(c).size() >= kLeastPlaces; };
    pool.parallel_for(sums.size(), 16, [&](std::size_t begin, std::size_t end, int thread) {
        for (std::size_t c = begin; c < end; ++c)
            if (is_known(c)) sample(c, 0, thread);
    });
    const std::vector<int> times = times_wanted(finder, sums, samples);
    pool.parallel_for(sums.size(), 16, [&](std::size_t begin, std::size_t end, int thread) {
        for (std::size_t c = begin; c < end; ++c)
            for (int time = 1; is_known(c) && time < times[c]; ++time) sample(c, time, thread);
    });
    cells.table.reserve(finder.size());
    for (std::size_t c = 0; c < finder.size(); ++c) {
        if (!is_known(c)) continue;
        cells.table.insert(finder.keys()[c], static_cast<std::uint32_t>(cells.lights.size()));
        cells.lights.push_back(lights_of(sums[c]));
    }
    return cells;
}

}  // namespace rcs
