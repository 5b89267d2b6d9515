#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "material/bsdf.h"
#include "rcs/camera.h"
#include "rcs/effect_plan.h"
#include "rcs/gbuffer.h"

namespace rcs {

/// How the visible points of a G-buffer reflect, where that takes more than their albedo, and what shows behind them.
struct Shading {
    int most_lobes = 0;           ///< of a pixel
    std::vector<Lobe> lobes;      ///< per pixel so many, unused ones without kind; empty if no lobe is simulated
    std::vector<float> traced;    ///< GGX width of the narrowest of these that is lit by rays; < 0: there is none
    std::vector<float> coverage;  ///< part of the pixel that the surface fills; empty if none is looked behind, as is
    std::vector<glm::vec3> through;  ///< the colour that comes straight through the surface

    bool has_lobes() const { return !lobes.empty(); }
    std::span<const Lobe> lobes_of(std::size_t pixel) const
    {
        const Lobe* first = lobes.data() + pixel * static_cast<std::size_t>(most_lobes);
        const Lobe* last = first + most_lobes;
        while (last != first && last[-1].kind == Lobe::kNone) --last;
        return {first, last};
    }
    void set_lobes(std::size_t pixel, const Bsdf& bsdf)
    {
        Lobe* const first = lobes.data() + pixel * static_cast<std::size_t>(most_lobes);
        std::fill(std::copy(bsdf.begin(), bsdf.end(), first), first + most_lobes, Lobe{});
        const LobeSet by_rays = bsdf.those(lit_by_rays);
        traced[pixel] = by_rays != 0u ? narrowest(bsdf, by_rays) : kNotTraced;
    }
    /// Of so many pixels, none of which reflects by a lobe.
    void clear_lobes(std::size_t pixels)
    {
        lobes.assign(pixels * static_cast<std::size_t>(most_lobes), Lobe{});
        traced.assign(pixels, kNotTraced);
    }
    /// @param g  the G-buffer that this belongs to
    Bsdf bsdf(const GBuffer& g, std::size_t pixel) const
    {
        Bsdf result;
        result.normal = g.normal(pixel);
        result.geometric_normal = g.geometric_normal[pixel];
        for (const Lobe& lobe : lobes_of(pixel)) result.add(lobe);
        return result;
    }
    /// The lobe of the pixel that radiance records light; null if it has none.
    const Lobe* recorded(std::size_t pixel) const
    {
        const std::span<const Lobe> here = lobes_of(pixel);
        const auto found = std::find_if(here.begin(), here.end(), lit_by_records);
        return found != here.end() ? &*found : nullptr;
    }
    /// Whether it has lobes that are lit by rays along them.
    bool is_traced(std::size_t pixel) const { return has_lobes() && traced[pixel] >= 0.0f; }

private:
    static constexpr float kNotTraced = -1.0f;
};

/// Triangles that need no shading where a pixel sees them: their light is known.
struct KnownSamples {
    std::vector<std::uint32_t> instance, primitive;  ///< per pixel; kNone: nothing is known
    std::vector<std::uint8_t> met;  ///< 1 where the last G-buffer saw what was known, and left the pixel empty
};

/// render_gbuffer() of gbuffer.h, and how its points reflect as far as the effects ask for it: highlights, glossy
/// records and traced lobes for BSDFs, peeling for what shows behind.
/// @param known  may be null
GBuffer render_gbuffer(GlContext& gl, const RayScene& rays, const View& view, float texture_scale, ThreadPool& pool,
                       const EffectSet& effects, Shading& shading, KnownSamples* known = nullptr);

/// The next surfaces behind those of `gbuffer`, where `weight` says that they matter: replaces both buffers.
/// @param weight  per pixel: how much of the light from there reaches the camera; 0: the pixel becomes empty and black
void peel_gbuffer(const RayScene& rays, const View& view, float texture_scale, ThreadPool& pool,
                  const std::vector<glm::vec3>& weight, GBuffer& gbuffer, Shading& shading);

/// Unit direction from any point to the viewer of an orthographic camera.
inline glm::vec3 parallel_outgoing(const Camera& camera)
{
    return glm::vec3(glm::normalize(glm::dvec3(camera.world_from_view[2])));
}

/// Unit direction from a point to the viewer. @param point  relative to the camera
inline glm::vec3 outgoing_from(const Camera& camera, glm::vec3 point)
{
    return camera.projection == Projection::orthographic ? parallel_outgoing(camera) : -glm::normalize(point);
}

/// The same of a covered pixel's point.
inline glm::vec3 outgoing_at(const GBuffer& g, const Camera& camera, std::size_t pixel)
{
    return outgoing_from(camera, g.position(pixel));
}

}  // namespace rcs
