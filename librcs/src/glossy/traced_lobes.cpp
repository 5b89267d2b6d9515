#include "glossy/traced_lobes.h"

#include <algorithm>
#include <optional>

#include "gbuffer/checked_pixels.h"
#include "glossy/lobe_paths.h"
#include "glossy/lobe_rays.h"
#include "glossy/lobe_sharing.h"
#include "glossy/past_lobes.h"
#include "util/random.h"

namespace rcs {
namespace {

/// Lobes of the checked pixels, by two sets of rays of their own.
class CheckedLobes {
public:
    CheckedLobes(const RayScene& rays, const HitRadiance& light, const GBuffer& g, const View& view,
                 const Shading& shading, const LobeSettings& options, const LobeLooks* looks)
        : g_(g),
          shading_(shading),
          squares_(g.width, g.height, *options.checked),
          settings_{options, options},
          sharing_(g, view, shading, options),
          paths_{LobePaths(rays, light, g, view, shading, settings_[0], looks),
                 LobePaths(rays, light, g, view, shading, settings_[1], looks)}
    {
        for (std::uint64_t k = 0; k < 2; ++k) settings_[k].seed = stream_key(options.seed, Stream::direct_again, k);
    }
    /// One pixel after the other: each takes the place of the last one in the ring of its thread.
    std::vector<TracedAgain> trace(bool of_lamps, ThreadPool& pool, std::vector<LobePaths::Workspace>& workspaces) const
    {
        std::vector<TracedAgain> again(squares_.squares());
        pool.parallel_for(again.size(), 64, [&](std::size_t begin, std::size_t end, int thread) {
            RayRing ring({g_.width, 1, settings_[0].rays_per_pixel, settings_[0].looks_per_pixel, of_lamps});
            for (std::size_t k = begin; k < end; ++k) {
                const std::uint32_t pixel = squares_.pixel(k);
                if (pixel == CheckedPixels::kNone || !g_.covered(pixel) || !shading_.is_traced(pixel) ||
                    !settings_[0].takes(pixel))
                    continue;
                again[k].pixel = pixel;
                for (std::size_t set = 0; set < 2; ++set) {
                    paths_[set].trace(pixel, pixel + 1u, ring, workspaces[static_cast<std::size_t>(thread)]);
                    const LobeLights found = sharing_.by_own(pixel, ring);
                    again[k].radiance[set] = found.reflected.radiance;
                    again[k].of_lamps[set] = found.of_lamps.radiance;
                }
            }
        });
        return again;
    }

private:
    const GBuffer& g_;
    const Shading& shading_;
    CheckedPixels squares_;
    LobeSettings settings_[2];
    LobeSharing sharing_;
    LobePaths paths_[2];
};

TracedLight dark(std::size_t pixels, bool of_lamps)
{
    const std::vector<glm::vec3> black(pixels, glm::vec3(0.0f));
    const std::vector<float> none(pixels, 0.0f);
    TracedLight light{.radiance = black, .error = none, .distance = none, .reflectance = black, .width = none};
    if (of_lamps) light.of_lamps = black, light.of_lamps_error = none;
    return light;
}

}  // namespace

TracedLight trace_lobes(const RayScene& rays, const HitRadiance& light, const GBuffer& gbuffer, const View& view,
                        const Shading& shading, const LobeSettings& options, ThreadPool& pool, GlossyStats& stats)
{
    const auto is_traced = [&](std::size_t i) {
        return gbuffer.covered(i) && shading.is_traced(i) && options.takes(i);
    };
    std::optional<LobeLooks> looks;
    if (options.looks_per_pixel > 0) looks.emplace(light, *options.guide, gbuffer, view, shading);
    const PastLobes past(options, gbuffer, view, shading, pool);
    const LobePaths paths(rays, light, gbuffer, view, shading, options, looks ? &*looks : nullptr, &past);
    const LobeSharing sharing(gbuffer, view, shading, options, &past);
    const bool of_lamps = options.gathered && options.gathered->any() && options.gathered->along_lobes;
    RayRing ring(
        {gbuffer.width, gbuffer.width, options.rays_per_pixel, options.looks_per_pixel, of_lamps, light.has_soft()});
    std::vector<LobePaths::Workspace> workspaces(static_cast<std::size_t>(pool.size()));
    TracedLight traced = dark(gbuffer.size(), of_lamps);
    const auto first_pixel = [&](int row) {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(gbuffer.width);
    };
    int rows_done = 0;
    for (int row = 0; row < gbuffer.height; row += RayRing::kBand) {
        const int last = std::min(row + RayRing::kBand, gbuffer.height);
        const int needed = std::min(last + RayRing::kMostReach, gbuffer.height);
        const std::size_t from = first_pixel(rows_done);
        pool.parallel_for(first_pixel(needed) - from, 64, [&](std::size_t begin, std::size_t end, int thread) {
            paths.trace(from + begin, from + end, ring, workspaces[static_cast<std::size_t>(thread)]);
        });
        rows_done = needed;
        const std::size_t start = first_pixel(row);
        pool.parallel_for(first_pixel(last) - start, 256, [&](std::size_t begin, std::size_t end, int) {
            for (std::size_t i = start + begin; i < start + end; ++i) {
                if (!is_traced(i)) continue;
                const LobeLights light_here = sharing.share(i, ring);
                traced.radiance[i] = light_here.reflected.radiance;
                traced.error[i] = light_here.reflected.error;
                traced.distance[i] = light_here.distance;
                traced.reflectance[i] = light_here.reflectance;
                traced.width[i] = light_here.width;
                if (!of_lamps) continue;
                traced.of_lamps[i] = light_here.of_lamps.radiance;
                traced.of_lamps_error[i] = light_here.of_lamps.error;
            }
        });
    }
    past.add_to(traced);
    if (options.checked)
        traced.again = CheckedLobes(rays, light, gbuffer, view, shading, options, looks ? &*looks : nullptr)
                           .trace(of_lamps, pool, workspaces);
    for (const LobePaths::Workspace& w : workspaces) {
        stats.rays += w.rays;
        stats.shadow_rays += w.shadow_rays;
        stats.looks += w.looks;
    }
    return traced;
}

}  // namespace rcs
