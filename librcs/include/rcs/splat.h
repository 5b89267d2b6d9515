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

/// How records are splatted.
struct SplatSettings {
    float error_tolerance = 0.2f;  ///< a; scales the tolerance to a change of normal
    float overlap = 1.0f;          ///< influence radius of a record of full breadth, in spacing radii, >= 1
    bool error_sums = true;        ///< also sum up what the error estimate takes
};

/// Sums over the records at each pixel, row by row from the top left.
struct SplatBuffer {
    int width = 0;                  ///< [px]; 0: there are none
    int height = 0;                 ///< [px]
    std::vector<float> weighted_r;  ///< sum w_k E_k(p, n), red [W m^-2]
    std::vector<float> weighted_g;  ///< the same, green
    std::vector<float> weighted_b;  ///< the same, blue
    std::vector<float> weight;      ///< sum w_k
    std::vector<float> count;       ///< records with w_k > 0
    /// What the error estimate takes: sum w_k l_k(p)^2 of each record's luminance l_k as it is extrapolated, in squares
    /// of `luminance_unit`. Empty without SplatSettings::error_sums, as are the two below.
    std::vector<float> squares;
    std::vector<float> variance;         ///< sum w_k v_k of their variances v_k, in the same unit
    std::vector<float> variance_of_sum;  ///< sum w_k^2 v_k
    float luminance_unit = 1.0f;         ///< [W m^-2]
    /// sum w_k L_k(p, lobe), red: radiance that the pixel's specular lobe reflects, over the lobe's directional albedo
    /// [W m^-2 sr^-1]. Empty unless lobes were asked for; 0 where the pixel has none.
    std::vector<float> glossy_r;
    std::vector<float> glossy_g;  ///< the same, green
    std::vector<float> glossy_b;  ///< the same, blue
};

/// What splats took.
struct SplatStats {
    std::uint64_t splats = 0;   ///< records that reach the image
    std::uint64_t samples = 0;  ///< record x pixel pairs evaluated
};

/// How the visible points reflect: librcs/src/gbuffer/shading.h.
struct Shading;

/// Sums all records over the image, by tiles of it on the CPU. All methods compute the same sums
/// (shaders/shared/weight.h).
/// @param view  the view that `gbuffer` was made for
/// @param glossy  if given, wide specular lobes are lit as well; the records keep radiance then
RCS_API SplatBuffer splat_tiles(const std::vector<Record>& records, const GBuffer& gbuffer, const View& view,
                                const SplatSettings& options, ThreadPool& pool, SplatStats& stats,
                                const Shading* glossy = nullptr);
/// The same sums by one bounding quad for each record, blended by OpenGL, as Gautron et al. 2005 do.
RCS_API SplatBuffer splat_quads(GlContext& gl, const std::vector<Record>& records, const GBuffer& gbuffer,
                                const View& view, const SplatSettings& options, ThreadPool& pool, SplatStats& stats,
                                const Shading* glossy = nullptr);
/// The same sums by tiles of the image in compute shaders of OpenGL: each pixel adds its tile's records in their order.
RCS_API SplatBuffer splat_gpu_tiles(GlContext& gl, const std::vector<Record>& records, const GBuffer& gbuffer,
                                    const View& view, const SplatSettings& options, ThreadPool& pool, SplatStats& stats,
                                    const Shading* glossy = nullptr);

/// The pixel rectangle that a sphere can touch: never too small, also when the sphere surrounds the
/// camera or reaches behind it (then the whole image).
struct PixelBounds {
    int x0 = 0;  ///< first column
    int y0 = 0;  ///< first row
    int x1 = 0;  ///< column after the last
    int y1 = 0;  ///< row after the last
    /// Whether it has no pixel.
    bool empty() const { return x0 >= x1 || y0 >= y1; }
};
/// @param centre  relative to the camera, axes of scene space [m]   @param radius  [m], >= 0
RCS_API PixelBounds sphere_bounds(const View& view, glm::dvec3 centre, double radius);

}  // namespace rcs
