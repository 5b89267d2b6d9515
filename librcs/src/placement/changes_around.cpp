#include "placement/changes_around.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "placement/refine.h"
#include "splat/blocked_records.h"
#include "util/color.h"

namespace rcs {
namespace {

// A change beyond this part of the light is no mere correction: spacing and gradients rest on the light as it was.
// With .5 a lamp that goes off left 3 % of the light behind (renewal_test).
constexpr double kMostChange = 0.3;
// A record's own word counts where what it saw is so many times its standard error: several rays saw it.
constexpr double kBeyondDoubt = 3.0;
// Where it is darker than this part of the mean, changes are judged as if it were as bright: they can hardly be seen.
constexpr double kDarkChange = 0.01;
// What is around, in spacing radii. demo:atrium's batch: MRE 3.65 % with 4, by 96 million rays; 3.68 % with 5, by 97.
constexpr float kAround = 4.0f;
// Those that judge are as far away at the most; with 3 changes nearby had 7 % more rays spent.
constexpr double kNearest = 2.0;
// Others that weigh less in all say nothing.
constexpr double kLeastOthers = 0.1;

/// What a record saw, and its light: on luminance, over the mean light of all records.
struct Saw {
    double change = 0.0, variance = 0.0;
    double light = 0.0, gathered = 0.0;  ///< as it was before, and when it was gathered
};

Saw saw(const Record& r, const Record& change, double mean)
{
    const double error = static_cast<double>(change.noise) / mean;
    return {static_cast<double>(luminance(change.irradiance)) / mean, error * error,
            static_cast<double>(luminance(r.irradiance)) / mean, static_cast<double>(r.watch.light) / mean};
}

bool is_beyond_doubt(const Saw& own)
{
    const double change = std::abs(own.change);
    return change > kMostChange * (own.light + kDarkChange) && change > kBeyondDoubt * std::sqrt(own.variance);
}

/// By what others saw. @param there  as judge() says
bool is_large(const ChangeAround& there) { return static_cast<double>(there.change) > kMostChange; }

/// Whether the light of a record is no longer what it was gathered as.
bool is_far(const Saw& own, double change)
{
    return std::abs(own.light + change - own.gathered) > kMostChange * (own.gathered + kDarkChange);
}

/// Weighted sums over the nearest others.
struct Judges {
    double weight = 0.0, squared = 0.0, variance = 0.0, light = 0.0;

    void add(double w, const Saw& s)
    {
        weight += w;
        squared += w * s.change * s.change;
        variance += w * s.variance;
        light += w * s.light;
    }
};

ChangeAround judge(const Saw& own, Judges by)
{
    if (!(by.weight > kLeastOthers)) by = {}, by.add(1.0, own);
    // Not its own light: those that hold less than there is would be judged harder, and all would become too bright.
    const double light = by.light / by.weight + kDarkChange;
    ChangeAround there;
    there.change = static_cast<float>(std::sqrt(by.squared / by.weight) / light);
    there.error = static_cast<float>(std::sqrt(by.variance / by.weight) / light);
    there.large = is_large(there) || is_beyond_doubt(own);
    return there;
}

/// Of a change, side by side in the cache for those around that ask.
struct Given {
    glm::vec3 irradiance;
    float noise;
    bool is_large;
};

/// Weighted sums over all around that a record takes the mean of.
struct Givers {
    glm::dvec3 change{0.0};
    double weight = 0.0, variance = 0.0;
    std::vector<float> radiance{};  ///< of as many coefficients as the record has

    void add(double w, const Given& given, const Record& seen)
    {
        change += w * glm::dvec3(given.irradiance);
        weight += w;
        variance += w * w * static_cast<double>(given.noise) * static_cast<double>(given.noise);
        if (radiance.empty()) return;
        const std::size_t known = std::min(radiance.size(), seen.radiance.size());
        for (std::size_t i = 0; i < known; ++i) radiance[i] += static_cast<float>(w) * seen.radiance[i];
    }
};

void take_on(Givers&& of, ChangeAround& there)
{
    there.mean = glm::vec3(of.change / of.weight);
    there.noise = static_cast<float>(std::sqrt(of.variance) / of.weight);
    for (float& coefficient : of.radiance) coefficient /= static_cast<float>(of.weight);
    there.radiance = std::move(of.radiance);
}

/// Whether a record of the block saw something change.
std::vector<char> blocks_that_changed(const BlockedRecords& blocks, std::span<const Record> changes)
{
    std::vector<char> changed;
    for (const RecordBlock& block : blocks.list())
        changed.push_back(std::any_of(block.number.begin(), block.number.begin() + block.count, [&](std::uint32_t k) {
            return changes[k].irradiance != glm::vec3(0.0f) || changes[k].noise > 0.0f;
        }));
    return changed;
}

/// Another record, and what it weighs.
struct Heard {
    std::uint32_t number;
    float weight;
};

std::vector<Heard> others_around(const BlockedRecords& blocks, std::span<const std::uint32_t> near,
                                 const WeighedAt& here, std::uint32_t self)
{
    std::vector<Heard> others;
    others.reserve(RecordBlock::kLanes);
    blocks.for_each_around(near, here, [&](std::uint32_t n, const RecordBlock::Lanes& weight) {
        const RecordBlock& block = blocks.list()[n];
        for (std::size_t l = 0; l < block.count; ++l)
            if (weight[l] > 0.0f && block.number[l] != self) others.push_back({block.number[l], weight[l]});
    });
    return others;
}

}  // namespace

std::vector<ChangeAround> changes_around(std::span<const Record> records, std::span<const std::uint32_t> which,
                                         std::span<const Record> changes, float error_tolerance, ThreadPool& pool)
{
    const double mean = std::max(mean_irradiance(records), 1e-30);
    std::vector<Voice> voices;
    std::vector<Saw> seen(which.size());
    std::vector<ChangeAround> around(which.size());
    for (std::uint32_t k = 0; k < which.size(); ++k) {
        const Record& r = records[which[k]];
        seen[k] = saw(r, changes[k], mean);
        around[k] = judge(seen[k], {});
        if (r.spacing_radius > 0.0f) voices.push_back({r.position, r.normal, kAround * r.spacing_radius, k});
    }
    const BlockedRecords blocks(std::move(voices));
    const float tolerance = std::min(1.0f, kAround * error_tolerance);  // no more: never across a right angle
    const std::vector<char> changed = blocks_that_changed(blocks, changes);
    std::vector<std::vector<Heard>> heard(which.size());  // by each record around which something changed
    blocks.for_each(tolerance, pool,
                    [&](std::size_t b, std::size_t lane, std::span<const std::uint32_t> near, const WeighedAt& here) {
                        if (std::none_of(near.begin(), near.end(), [&](std::uint32_t n) { return changed[n] != 0; }))
                            return;
                        const std::uint32_t self = blocks.list()[b].number[lane];
                        heard[self] = others_around(blocks, near, here, self);
                        Judges by;
                        for (const Heard& other : heard[self]) {
                            const double weight = 1.0 - (1.0 - static_cast<double>(other.weight)) *
                                                            static_cast<double>(kAround) / kNearest;
                            if (weight > 0.0) by.add(weight, seen[other.number]);
                        }
                        around[self] = judge(seen[self], by);
                    });
    std::vector<Given> given;
    for (std::size_t k = 0; k < which.size(); ++k)
        given.push_back({changes[k].irradiance, changes[k].noise, is_large(around[k])});
    pool.parallel_for(which.size(), 64, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t k = begin; k < end; ++k) {
            if (around[k].large) continue;  // what it takes on is a gather
            Givers of;
            of.radiance.resize(records[which[k]].radiance.size());
            of.add(1.0, given[k], changes[k]);
            for (const auto& [n, weight] : heard[k])
                if (!given[n].is_large) of.add(static_cast<double>(weight), given[n], changes[n]);
            take_on(std::move(of), around[k]);
        }
    });
    for (std::size_t k = 0; k < around.size(); ++k)
        around[k].large |= is_far(seen[k], static_cast<double>(luminance(around[k].mean)) / mean);
    return around;
}

}  // namespace rcs
