#include "render/effect_counts.h"

#include "gl/gl_context_impl.h"

namespace rcs {

EffectTally::EffectTally(GlContext& gl, ThreadPool& pool) : before_(total_counts(pool)) { gl.impl().used.clear(); }

void EffectTally::finish(GlContext& gl, ThreadPool& pool, const std::vector<Record>& records, const LayeredImage& image,
                         EffectCounts& counts) const
{
    const std::array<std::uint64_t, kCounts> now = total_counts(pool);
    const auto since = [&](Count what) {
        return now[static_cast<std::size_t>(what)] - before_[static_cast<std::size_t>(what)];
    };
    counts.camera_rays = since(Count::camera_rays);
    counts.punctual_rays = since(Count::punctual_rays);
    counts.area_rays = since(Count::area_rays);
    counts.peak_rays = since(Count::peak_rays);
    counts.highlight_rays = since(Count::highlight_rays);
    counts.hit_lamp_rays = since(Count::hit_lamp_rays);
    counts.hit_sky_rays = since(Count::hit_sky_rays);
    counts.alpha_tests = since(Count::alpha_tests);
    counts.hit_textures = since(Count::hit_textures);
    counts.normal_maps = since(Count::normal_maps);
    counts.gl_bytes = since(Count::gl_bytes);
    for (const Record& record : records) {
        counts.record_bytes += sizeof(Record) + record.radiance.size() * sizeof(float);
        counts.radiance_bytes += record.radiance.size() * sizeof(float);
    }
    for (const auto& [name, layer] : image.layers) counts.layer_bytes += layer.pixels.size() * sizeof(float);
    counts.shaders.assign(gl.impl().used.begin(), gl.impl().used.end());
}

}  // namespace rcs
