#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "rcs/api.h"
#include "rcs/gbuffer.h"
#include "rcs/gl_context.h"
#include "rcs/records.h"
#include "rcs/thread_pool.h"

namespace rcs {

struct SplatSettings {
    float error_tolerance = 0.2f;  ///< a; scales the tolerance to a change of normal
    float overlap = 1.0f;          ///< influence radius of a record of full breadth, in spacing radii, >= 1
    bool error_sums = true;        ///< also sum up what the error estimate takes
};

/// Sums over the records at each pixel, row by row from the top left.
struct SplatBuffer {
    int width = 0;
    int height = 0;
    std::vector<float> weighted_r, weighted_g, weighted_b;  ///< sum w_k E_k(p, n) [W m^-2]
    std::vector<float> weight;                              ///< sum w_k
    std::vector<float> count;                               ///< records with w_k > 0
    /// What the error estimate takes (sum w_k l_k(p)^2, sum w_k v_k, sum w_k^2 v_k), of each record's luminance l_k as
    /// it is extrapolated and its variance v_k, in units of `luminance_unit` [W m^-2] and its square. Empty without
    /// SplatSettings::error_sums.
    std::vector<float> squares, variance, variance_of_sum;
    float luminance_unit = 1.0f;
    /// sum w_k L_k(p, lobe): radiance that the pixel's specular lobe reflects, over the lobe's directional albedo
    /// [W m^-2 sr^-1]. Empty unless lobes were asked for; 0 where the pixel has none.
    std::vector<float> glossy_r, glossy_g, glossy_b;
};

struct SplatStats {
    std::uint64_t splats = 0;   ///< records that reach the image
    std::uint64_t samples = 0;  ///< record x pixel pairs evaluated
};

/// How the visible points reflect: librcs/src/gbuffer/shading.h.
struct Shading;

/// Sums all records over the image. Both methods compute the same sums (shaders/shared/weight.h).
/// @param view  the view that `gbuffer` was made for
/// @param glossy  if given, wide specular lobes are lit as well; the records keep radiance then
RCS_API SplatBuffer splat_tiles(const std::vector<Record>& records, const GBuffer& gbuffer, const View& view,
                                const SplatSettings& options, ThreadPool& pool, SplatStats& stats,
                                const Shading* glossy = nullptr);
RCS_API SplatBuffer splat_quads(GlContext& gl, const std::vector<Record>& records, const GBuffer& gbuffer,
                                const View& view, const SplatSettings& options, SplatStats& stats,
                                const Shading* glossy = nullptr);

/// The pixel rectangle that a sphere can touch: never too small, also when the sphere surrounds the
/// camera or reaches behind it (then the whole image).
struct PixelBounds {
    int x0 = 0, y0 = 0, x1 = 0, y1 = 0;  ///< [x0, x1) x [y0, y1); empty if x0 >= x1 or y0 >= y1
    bool empty() const { return x0 >= x1 || y0 >= y1; }
};
/// @param centre  relative to the camera, axes of scene space [m]   @param radius  [m], >= 0
RCS_API PixelBounds sphere_bounds(const View& view, glm::dvec3 centre, double radius);

}  // namespace rcs
