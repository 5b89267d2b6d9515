#include "compose/compose.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <numbers>

#include "radiance/lobes.h"
#include "util/color.h"

namespace rcs {
namespace {

constexpr float kInversePi = std::numbers::inv_pi_v<float>;

Image& layer(LayeredImage& image, const char* name, const GBuffer& g, int channels)
{
    Image& result = image.layers[name];
    if (result.pixels.empty()) result = Image(g.width, g.height, channels);
    return result;
}

/// Where a layer is summed up; null if nobody asks for it.
struct Sums {
    Image *emission, *direct, *indirect, *error, *irradiance, *albedo, *normal, *depth, *records;
};

void add(Image* image, std::size_t pixel, glm::vec3 value)
{
    if (!image) return;
    float* p = image->pixels.data() + 3 * pixel;
    p[0] += value.r;
    p[1] += value.g;
    p[2] += value.b;
}

/// What the records' radiance becomes on a wide specular lobe.
glm::vec3 glossy_radiance(const GBuffer& g, const Shading& shading, const SplatBuffer& sums, std::size_t i,
                          glm::vec3 outgoing)
{
    if (sums.glossy_r.empty() || !shading.recorded(i)) return glm::vec3(0.0f);
    const Bsdf bsdf = shading.bsdf(g, i);
    return albedo(bsdf, glm::dot(bsdf.normal, outgoing), bsdf.those(lit_by_records)) *
           (glm::vec3(sums.glossy_r[i], sums.glossy_g[i], sums.glossy_b[i]) / sums.weight[i]);
}

// While passes are summed up, the error has two parts: that of records, which all passes share, adds up; that of traced
// lobes, each pass by itself, adds up squared.
constexpr const char* kErrorLayer = "indirect_error";
constexpr int kErrorParts = 2;
constexpr std::size_t kOfRecords = 0, kOfTraced = 1;

Sums find_sums(const EffectSet& effects, const GBuffer& g, LayeredImage& sums)
{
    const auto find = [&](const char* name, int channels, std::initializer_list<Effect> wanted_by) {
        const bool wanted = std::any_of(wanted_by.begin(), wanted_by.end(), [&](Effect e) { return effects.has(e); });
        return wanted ? &layer(sums, name, g, channels) : nullptr;
    };
    using enum Effect;
    return {find("emission", 3, {layer_emission, emission}),
            find("direct", 3, {layer_direct, punctual_light, area_light, environment_peaks}),
            find("indirect", 3, {layer_indirect, indirect_diffuse, traced_lobes}),
            find(kErrorLayer, kErrorParts, {layer_indirect_error, error_estimate}),
            find("irradiance", 3, {layer_irradiance}),
            find("albedo", 3, {layer_albedo}),
            find("normal", 3, {layer_normal}),
            find("depth", 1, {layer_depth}),
            find("records", 1, {layer_records})};
}

/// One standard error from the two parts. @param image  sums of `passes`; becomes their mean
void finish_error(int passes, Image& image)
{
    Image error(image.width, image.height, 1);
    for (std::size_t i = 0; i < error.pixels.size(); ++i) {
        const float records = image.pixels[kErrorParts * i + kOfRecords],
                    traced = image.pixels[kErrorParts * i + kOfTraced];
        error.pixels[i] = std::sqrt(records * records + traced) / static_cast<float>(passes);
    }
    image = std::move(error);
}

}  // namespace

std::size_t accumulate_pass(const GBuffer& g, const View& view, const Shading& shading, const PassLight& light,
                            const std::vector<glm::vec3>& weight, const KnownSamples* known, LayeredImage& sums)
{
    const SplatBuffer& indirect = light.indirect;
    Image& beauty = layer(sums, "beauty", g, 4);
    const Sums to = find_sums(light.effects, g, sums);
    const bool first = weight.empty();
    const bool orthographic = view.camera.projection == Projection::orthographic;
    const glm::dvec3 forward = -glm::dvec3(view.camera.world_from_view[2]);
    std::size_t unserved = 0;
    for (std::size_t i = 0; i < g.size(); ++i) {
        const glm::vec3 passes = first ? glm::vec3(1.0f) : weight[i];
        if (known && known->met[i] != 0) continue;
        if (!g.covered(i)) {
            add(to.emission, i, passes * g.emission[i]);
            if (first && to.depth) to.depth->pixels[i] = std::numeric_limits<float>::infinity();
            continue;
        }
        const glm::vec3 share = shading.coverage.empty() ? passes : passes * shading.coverage[i];
        add(to.emission, i, share * g.emission[i]);
        const glm::vec3 reflectance = share * g.albedo[i] * kInversePi;
        if (!light.direct.irradiance.empty()) {
            glm::vec3 direct = reflectance * light.direct.irradiance[i];
            if (!light.direct.glossy.empty()) direct += share * light.direct.glossy[i];
            add(to.direct, i, direct);
        }
        if (!light.traced.radiance.empty()) {
            add(to.indirect, i, share * light.traced.radiance[i]);
            if (to.error) {
                const float error = luminance(share) * light.traced.error[i];
                to.error->pixels[kErrorParts * i + kOfTraced] += error * error;
            }
        }
        beauty.pixels[4 * i + 3] += luminance(share);
        if (first) {
            const glm::vec3 p = g.position(i);
            add(to.albedo, i, g.albedo[i]);
            add(to.normal, i, g.normal(i));
            if (to.depth)
                to.depth->pixels[i] +=
                    orthographic ? static_cast<float>(glm::dot(glm::dvec3(p), forward)) : glm::length(p);
        }
        if (indirect.width == 0) continue;
        const float sum = indirect.weight[i];
        if (!(sum > 0.0f)) {
            ++unserved;
            continue;
        }
        const glm::vec3 e = glm::vec3(indirect.weighted_r[i], indirect.weighted_g[i], indirect.weighted_b[i]) / sum;
        glm::vec3 radiance = reflectance * e;
        if (shading.has_lobes())
            radiance += share * glossy_radiance(g, shading, indirect, i, outgoing_at(g, view.camera, i));
        add(to.indirect, i, radiance);
        if (to.error && !light.indirect_error.noise.empty())
            to.error->pixels[kErrorParts * i + kOfRecords] += light.indirect_error.total(i) * luminance(radiance);
        if (first) {
            add(to.irradiance, i, e);
            if (to.records) to.records->pixels[i] += indirect.count[i];
        }
    }
    return unserved;
}

void finish_passes(int passes, LayeredImage& sums)
{
    const float scale = 1.0f / static_cast<float>(passes);
    for (auto& [name, image] : sums.layers) {
        if (name == kErrorLayer) {
            finish_error(passes, image);
            continue;
        }
        for (float& value : image.pixels) value *= scale;
    }
    Image& beauty = sums.layers["beauty"];
    const std::size_t pixels = beauty.pixels.size() / 4;
    for (const char* part : {"emission", "direct", "indirect"}) {
        const auto found = sums.layers.find(part);
        if (found == sums.layers.end()) continue;
        for (std::size_t i = 0; i < pixels; ++i)
            for (std::size_t c = 0; c < 3; ++c) beauty.pixels[4 * i + c] += found->second.pixels[3 * i + c];
    }
}

void keep_layers(const EffectSet& effects, LayeredImage& image)
{
    std::erase_if(image.layers, [&](const auto& named) {
        return named.first != "beauty" && !effects.has(find_effect("layer-" + named.first));
    });
}

}  // namespace rcs
