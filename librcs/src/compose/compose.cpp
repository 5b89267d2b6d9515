#include "compose/compose.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>
#include <numeric>

#include "compose/sampled_light.h"
#include "radiance/lobes.h"
#include "util/color.h"

namespace rcs {
namespace {

constexpr float kInversePi = std::numbers::inv_pi_v<float>;
// Samples that are looked at before each layer takes its part of them: what they say stays in the nearest cache.
constexpr std::size_t kSamplesAtATime = 128;

/// What the records' radiance becomes on a wide specular lobe.
glm::vec3 glossy_radiance(const GBuffer& g, const Shading& shading, const SplatBuffer& sums, std::size_t i,
                          glm::vec3 outgoing)
{
    if (sums.glossy_r.empty() || !shading.recorded(i)) return glm::vec3(0.0f);
    const Bsdf bsdf = shading.bsdf(g, i);
    return albedo(bsdf, outgoing, bsdf.those(lit_by_records)) *
           (glm::vec3(sums.glossy_r[i], sums.glossy_g[i], sums.glossy_b[i]) / sums.weight[i]);
}

glm::vec3 mean_irradiance(const SplatBuffer& sums, std::size_t i)
{
    return glm::vec3(sums.weighted_r[i], sums.weighted_g[i], sums.weighted_b[i]) / sums.weight[i];
}

/// What records say at a visible point.
void add_recorded(const SamplePass& pass, const Shading& shading, const ShownLight& light, glm::vec3 reflectance,
                  Sample& s)
{
    const std::size_t i = s.pixel;
    const SplatBuffer& sums = light.indirect;
    s.served = sums.weight[i] > 0.0f;
    if (!s.served) return;
    s.irradiance = mean_irradiance(sums, i);
    if (light.of_lamps.width != 0) {
        const glm::vec3 of_lamps = glm::min(mean_irradiance(light.of_lamps, i), s.irradiance);
        s.irradiance -= of_lamps;
        glm::vec3 reflected = reflectance * of_lamps;
        if (shading.has_lobes())
            reflected += s.share * glossy_radiance(pass.gbuffer, shading, light.of_lamps, i,
                                                   outgoing_at(pass.gbuffer, pass.view.camera, i));
        s.direct += reflected;
        if (!light.indirect_error.noise.empty())
            s.direct_error =
                std::hypot(s.direct_error, light.indirect_error.total(i, light.left.records) * luminance(reflected));
    }
    s.recorded = reflectance * s.irradiance;
    if (shading.has_lobes())
        s.recorded +=
            s.share * glossy_radiance(pass.gbuffer, shading, sums, i, outgoing_at(pass.gbuffer, pass.view.camera, i));
    if (!light.indirect_error.noise.empty())
        s.recorded_error = light.indirect_error.total(i, light.left.records) * luminance(s.recorded);
    s.records = sums.count[i];
}

/// @param passes  part of the light that passes what lies in front   @param s  of its pixel, else empty
void look_at(const SamplePass& pass, const Shading& shading, const ShownLight& light, glm::vec3 passes, Sample& s)
{
    const std::size_t i = s.pixel;
    s.covered = pass.gbuffer.covered(i);
    s.share = passes;
    if (!s.covered) return;
    if (!shading.coverage.empty()) s.share *= shading.coverage[i];
    const glm::vec3 reflectance = s.share * pass.gbuffer.albedo[i] * kInversePi;
    if (!light.direct.irradiance.empty()) {
        s.direct = reflectance * light.direct.irradiance[i];
        if (!light.direct.glossy.empty()) s.direct += s.share * light.direct.glossy[i];
        // The same shadow rays bring both.
        if (!light.direct.irradiance_error.empty())
            s.direct_error += luminance(reflectance) * (light.left.direct * light.direct.irradiance_error[i]);
        if (!light.direct.glossy_error.empty())
            s.direct_error += luminance(s.share) * (light.left.direct * light.direct.glossy_error[i]);
    }
    if (!light.traced.radiance.empty()) {
        s.traced = s.share * light.traced.radiance[i];
        s.traced_error = luminance(s.share) * (light.left.lobes * light.traced.error[i]);
        if (!light.traced.of_lamps.empty()) {
            s.direct += s.share * light.traced.of_lamps[i];
            s.direct_error =
                std::hypot(s.direct_error, luminance(s.share) * (light.left.lobes * light.traced.of_lamps_error[i]));
        }
    }
    if (light.indirect.width != 0) add_recorded(pass, shading, light, reflectance, s);
}

/// Of a thread.
struct Workspace {
    std::vector<Sample> samples;
    std::vector<SampledLight> sampled;
    std::size_t unserved = 0;

    Workspace() { samples.reserve(kSamplesAtATime); }
};

/// Where a layer is summed up.
Image& sums_of(const LayerSum& layer, const GBuffer& g, LayeredImage& sums)
{
    Image& result = sums.layers[std::string(layer.name)];
    if (result.pixels.empty()) result = Image(g.width, g.height, layer.channels);
    return result;
}

}  // namespace

float recorded_luminance(const GBuffer& gbuffer, const View& view, const Shading& shading, const SplatBuffer& sums,
                         std::size_t pixel)
{
    if (sums.width == 0 || !gbuffer.covered(pixel) || !(sums.weight[pixel] > 0.0f)) return 0.0f;
    glm::vec3 light = gbuffer.albedo[pixel] * kInversePi * mean_irradiance(sums, pixel);
    if (shading.has_lobes())
        light += glossy_radiance(gbuffer, shading, sums, pixel, outgoing_at(gbuffer, view.camera, pixel));
    return luminance(light);
}

std::size_t accumulate_pass(const GBuffer& g, const View& view, const Shading& shading, const ShownLight& light,
                            const std::vector<glm::vec3>& weight, const KnownSamples* known, LayeredImage& sums,
                            ThreadPool& pool)
{
    const SamplePass pass{light.layers, g, view, weight.empty(),
                          light.layers.motion ? std::optional(light.layers.motion->images_of(view)) : std::nullopt};
    std::vector<std::pair<const LayerSum*, Image*>> layers;
    for (const PictureLayers::Made& layer : light.layers.made) {
        Image& image = sums_of(*layer.sum, g, sums);
        if (layer.filled) layers.emplace_back(layer.sum, &image);
    }
    std::mutex growing;
    std::vector<Workspace> workers(static_cast<std::size_t>(pool.size()));
    pool.parallel_for(g.size(), kSamplesAtATime, [&](std::size_t begin, std::size_t end, int thread) {
        Workspace& w = workers[static_cast<std::size_t>(thread)];
        w.samples.clear();
        w.sampled.resize(light.layers.for_filter ? kSamplesAtATime : 0);
        for (std::size_t i = begin; i < end; ++i) {
            if (known && known->met[i] != 0) continue;
            Sample& s = w.samples.emplace_back();
            s.pixel = i;
            look_at(pass, shading, light, pass.first ? glm::vec3(1.0f) : weight[i], s);
            if (!w.sampled.empty()) {
                w.sampled[i - begin] = look_at_sampled(pass, shading, light, s);
                s.sampled = &w.sampled[i - begin];
            }
            if (s.covered && light.indirect.width != 0 && !s.served) ++w.unserved;
        }
        for (const auto& [layer, image] : layers) {
            std::unique_lock<std::mutex> alone(growing, std::defer_lock);
            if (layer->grows) alone.lock();
            layer->add(pass, w.samples, *image);
        }
    });
    return std::accumulate(workers.begin(), workers.end(), std::size_t{0},
                           [](std::size_t sum, const Workspace& w) { return sum + w.unserved; });
}

void finish_passes(int passes, LayeredImage& sums)
{
    for (auto& [name, image] : sums.layers) layer_sum(name).finish(passes, image);
    add_up_beauty(sums);
}

void add_up_beauty(LayeredImage& image)
{
    Image& beauty = image.layers["beauty"];
    const std::size_t pixels = beauty.pixels.size() / 4;
    for (std::size_t i = 0; i < pixels; ++i) std::fill_n(beauty.pixels.data() + 4 * i, 3, 0.0f);
    for (const char* part : kBeautyParts) {
        const auto found = image.layers.find(part);
        if (found == image.layers.end()) continue;
        for (std::size_t i = 0; i < pixels; ++i)
            for (std::size_t c = 0; c < 3; ++c) beauty.pixels[4 * i + c] += found->second.pixels[3 * i + c];
    }
}

void keep_layers(const PictureLayers& layers, LayeredImage& image)
{
    for (const PictureLayers::Made& layer : layers.made)
        if (!layer.kept) image.layers.erase(std::string(layer.sum->name));
    if (image.layers.contains(kObjectLayer)) describe_cryptomatte(kObjectLayer, layers.objects, image);
    if (image.layers.contains(kMaterialLayer)) describe_cryptomatte(kMaterialLayer, layers.materials, image);
}

}  // namespace rcs
