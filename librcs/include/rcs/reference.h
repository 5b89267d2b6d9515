#pragma once

#include <cstdint>
#include <optional>

#include "rcs/api.h"
#include "rcs/camera.h"
#include "rcs/image.h"
#include "rcs/log.h"
#include "rcs/ray_scene.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// Rises with each change of what render_reference() computes, so that saved references are known to be old.
inline constexpr int kTransportVersion = 2;

/// How the path tracer that judges the renderer works.
struct ReferenceOptions {
    int samples = 1024;             ///< paths per pixel, in [16, 2^20]; rounded up to a multiple of 16
    int first_sample = 0;           ///< where in the pixel's sequence of paths to begin, in [0, 2^20 - samples];
                                    ///< see merge_references()
    int bounces = 1;                ///< bounces of indirect light, in [0, 64]; 1 is the paper's first bounce
    int aa = 1;                     ///< 1: every path starts at the pixel's centre; more: spread over the pixel,
                                    ///< textures filtered over 1/sqrt(aa) pixels, as in render
    int stride = 1;                 ///< >= 1; trace every stride-th pixel of every stride-th row only, see below
    std::uint64_t seed = 1;         ///< of its paths
    std::optional<Lens> lens = {};  ///< with aa > 1: each path looks through another point of it; none: a pinhole
};

/// Path traces emission, direct light and `bounces` bounces of indirect light (next-event estimation, with glossy
/// surfaces and environment images also multiple importance sampling; Owen-scrambled Sobol' points) at the view's
/// pixels. Independent of the record code. Layers of surfaces that let light through are composited; albedo, normal
/// and depth are those of the nearest.
///
/// With stride s > 1 the result has one pixel for each of (s/2 + i s, s/2 + j s) of the view, and
/// metadata "rcs:stride" = s; compare_images() then takes the same pixels of the full image.
///
/// Layers: beauty, emission, direct, indirect, albedo, normal, depth, standard_error (of beauty),
/// indirect_standard_error. Standard errors come from blocks of the Sobol' sequence taken as
/// independent; the sequence is better than that, so they are upper estimates.
RCS_API LayeredImage render_reference(const RayScene& rays, const View& view, const ReferenceOptions& options,
                                      ThreadPool& pool, const ProgressFunction& progress = {});

/// Adds `more` to `sum`, both of the same view and transport: layers are averaged by samples (depth and normal also by
/// cover), standard errors taken as independent. If `more` has the same seed it must begin at the sample where `sum`
/// ends: the result is then, to rounding, what tracing both in one go gives. So a reference can be saved and continued.
/// With another seed, `more` is an independent image, and the result cannot be continued any more.
/// @param sum  may be empty, of no layers; it becomes `more` then
/// @throws Error bad_argument: sizes, layers or settings that do not match, or a gap between the samples
RCS_API void merge_references(LayeredImage& sum, const LayeredImage& more);

}  // namespace rcs
