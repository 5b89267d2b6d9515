#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "rcs/direct_light.h"
#include "rcs/image.h"
#include "rcs/light_cache.h"
#include "rcs/log.h"
#include "rcs/records.h"
#include "rcs/splat.h"

namespace rcs {

struct RenderOptions {
    int width = 1000;   ///< [px], in [1, 16384]
    int height = 1000;  ///< [px], in [1, 16384]
    int aa = 4;         ///< jittered passes that share the records, in [1, 64]; 1 samples pixel centres
    int bounces = 1;    ///< bounces of indirect light, in [0, 64]; 8 is full interreflection but for very light rooms
    RecordOptions records;
    DirectOptions direct;
    int lobe_rays = 16;    ///< rays a pixel along lobes too narrow for records, shared between neighbours, in [1, 1024]
    float overlap = 3.0f;  ///< influence radius of the last splat, in spacing radii, in [1, 16]
    SplatMethod splat = SplatMethod::automatic;
    std::uint64_t seed = 1;  ///< of every random stream
};

/// @throws Error bad_argument: the field, its value and its range
void validate(const RenderOptions& options);

/// Rays along lobes that are too narrow for records.
struct GlossyStats {
    std::uint64_t rays = 0, shadow_rays = 0;
};

struct RenderStats {
    std::vector<std::pair<std::string, double>> stage_seconds;  ///< in order of execution; wall time
    RecordStats records;
    SplatStats splats;
    LightCacheStats light_cache;  ///< of the bounces beyond the first
    std::uint64_t direct_shadow_rays = 0;
    GlossyStats traced;                 ///< narrow lobes, ray traced per pixel
    std::uint64_t unserved_pixels = 0;  ///< visible pixels that no record reaches: 0 unless something is wrong
    std::string splat_method;           ///< "quads" or "tiles"
    std::string gl_renderer, gl_version, gl_platform;
    int threads = 0;

    void add(const std::string& stage, double seconds);
};

struct RenderResult {
    LayeredImage image;
    std::vector<Record> records;
    RenderStats stats;
};

/// Renders one view of the scene: emission, direct light, and indirect light by radiance cache
/// splatting (Gautron et al. 2005).
/// @param cache  records of earlier frames of the same scene to start from; may be empty
RenderResult render(GlContext& gl, const RayScene& rays, const Camera& camera, const RenderOptions& options,
                    ThreadPool& pool, std::vector<Record> cache = {}, const LogFunction& log = {},
                    const ProgressFunction& progress = {});

}  // namespace rcs
