#include "glossy/lobe_trial.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "gbuffer/visible_points.h"
#include "glossy/lobe_looks.h"
#include "glossy/lobe_paths.h"
#include "glossy/lobe_sharing.h"
#include "util/color.h"

namespace rcs {
namespace {

constexpr int kLooks = 4;
constexpr int kLooksToLearn = 16;
constexpr std::size_t kPixelsOfCandidate = 64, kMostCandidates = 8192, kTrials = 64;
// Time of rays with looks beside them over that of rays alone (measured in veach-ajar).
constexpr double kCost = 1.5;
// Errors are relative to the light and so much of its mean, as `compare` has it.
constexpr double kDark = 0.01;
// A smaller gain is not worth it.
constexpr double kLeastGain = 1.25;

/// What lobes show at a pixel, twice of each.
struct Findings {
    double rays[2] = {}, both[2] = {};
};

/// Squared error that looks save over that which they leave, in the same time. Errors are relative, each at most 1:
/// rays that mostly find nothing are all wrong.
double gain_of(const std::vector<Findings>& findings)
{
    double mean = 0.0, rays = 0.0, both = 0.0;
    for (const Findings& f : findings) mean += 0.5 * (f.both[0] + f.both[1]) / static_cast<double>(findings.size());
    const auto square = [&](double found, double truth) {
        const double off = (found - truth) / (truth + kDark * mean);
        return std::min(1.0, off * off);
    };
    for (const Findings& f : findings) {
        for (const double found : f.rays) rays += 0.25 * (square(found, f.both[0]) + square(found, f.both[1]));
        both += 0.5 * (square(f.both[0], f.both[1]) + square(f.both[1], f.both[0]));
    }
    // Half of what two differ by is one's own error, and that much is in the difference to rays too.
    both = std::max(0.5 * both, 1e-30);
    return std::max(0.0, rays - both) / (kCost * both);
}

/// Pixels over the picture whose lobes look.
std::vector<std::uint32_t> looking_pixels(const GBuffer& gbuffer, const Shading& shading, std::uint64_t seed)
{
    const std::size_t candidates = std::min(kMostCandidates, gbuffer.size() / kPixelsOfCandidate + 1);
    std::vector<std::uint32_t> pixels = spread_pixels(gbuffer, candidates, ~seed);
    std::erase_if(pixels, [&](std::uint32_t i) {
        const Bsdf bsdf = shading.bsdf(gbuffer, i);
        const LobeSet traced = bsdf.those(lit_by_rays);
        return traced == 0u || !LobeLooks::looks(bsdf, traced);
    });
    return pixels;
}

}  // namespace

void learn_along_lobes(const RayScene& rays, const HitRadiance& light, const GBuffer& gbuffer, const View& view,
                       const Shading& shading, std::uint64_t seed, ThreadPool& pool, GatherGuide& guide)
{
    const std::vector<std::uint32_t> pixels = looking_pixels(gbuffer, shading, seed);
    const LobeLooks looks(light, guide, gbuffer, view, shading);
    std::vector<LobeLooks::Workspace> workers(static_cast<std::size_t>(pool.size()));
    pool.parallel_for(pixels.size(), 64, [&](std::size_t begin, std::size_t end, int thread) {
        LobeLooks::Workspace& w = workers[static_cast<std::size_t>(thread)];
        RayRing ring({1, 1, 0, kLooksToLearn});
        ShadowBatch shadow;
        std::vector<PendingLight> lights;
        const std::size_t before = w.looks.size();
        for (std::size_t k = begin; k < end; ++k)
            looks.look(pixels[k], stream_key(seed, Stream::lit_points, ~std::uint64_t{pixels[k]}), ring, w, shadow,
                       lights);
        shadow.trace(rays);
        for (std::size_t i = 0; i < shadow.size(); ++i) w.looks[before + i].free = shadow.is_free(i);
    });
    for (const LobeLooks::Workspace& w : workers) guide.learn(w.looks);
}

WorthwhileLooks worthwhile_looks(const RayScene& rays, const HitRadiance& light, const GBuffer& gbuffer,
                                 const View& view, const Shading& shading, const LobeSettings& options,
                                 ThreadPool& pool)
{
    const std::vector<std::uint32_t> pixels = looking_pixels(gbuffer, shading, options.seed);
    const std::size_t count = std::min(kTrials, pixels.size());
    const LobeLooks looks(light, *options.guide, gbuffer, view, shading);
    std::vector<Findings> findings(count);
    pool.parallel_for(count, count / 4 + 1, [&](std::size_t begin, std::size_t end, int) {
        LobePaths::Workspace w;
        std::vector<std::size_t> neighbours;
        RayRing alone({gbuffer.width, RayRing::kColumnsOfOne, options.rays_per_pixel, 0});
        RayRing beside({gbuffer.width, RayRing::kColumnsOfOne, options.rays_per_pixel, kLooks});
        const auto gather = [&](std::size_t pixel, std::uint64_t sample, RayRing& ring) {
            LobeSettings own = options;
            own.seed = stream_key(options.seed, Stream::glossy, ~sample);
            own.gathered = nullptr;
            const LobePaths paths(rays, light, gbuffer, view, shading, own, ring.has_looks() ? &looks : nullptr);
            const LobeSharing sharing(gbuffer, view, shading, own);
            paths.trace(pixel, pixel + 1, ring, w);
            sharing.find_neighbours(pixel, ring, neighbours);
            for (const std::size_t i : neighbours) paths.trace(i, i + 1, ring, w);
            return static_cast<double>(luminance(sharing.share(pixel, ring).reflected.radiance));
        };
        for (std::size_t k = begin; k < end; ++k) {
            const std::size_t pixel = pixels[k * pixels.size() / count];
            findings[k] = {{gather(pixel, 0, alone), gather(pixel, 1, alone)},
                           {gather(pixel, 2, beside), gather(pixel, 3, beside)}};
        }
    });
    return {gain_of(findings) > kLeastGain * kLeastGain ? kLooks : 0, count == kTrials};
}

}  // namespace rcs
