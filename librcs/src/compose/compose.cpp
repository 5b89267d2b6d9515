#include "compose/compose.h"

#include <cmath>
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
    if (result.pixels.empty())
        result = Image(g.width, g.height, channels);
    return result;
}

void add(Image& image, std::size_t pixel, glm::vec3 value)
{
    float* p = image.pixels.data() + 3 * pixel;
    p[0] += value.r;
    p[1] += value.g;
    p[2] += value.b;
}

/// What the records' radiance becomes on a wide specular lobe.
glm::vec3 glossy_radiance(const Shading& shading, const SplatBuffer& sums, std::size_t i, float cosine)
{
    if (sums.glossy_r.empty() || !lit_by_records(shading.bsdf[i]))
        return glm::vec3(0.0f);
    return recorded_albedo(shading.bsdf[i], cosine) *
           (glm::vec3(sums.glossy_r[i], sums.glossy_g[i], sums.glossy_b[i]) / sums.weight[i]);
}

// While passes are summed up, the error has two parts: that of records, which all passes share, adds up; that of traced
// lobes, each pass by itself, adds up squared.
constexpr const char* kErrorLayer = "indirect_error";
constexpr int kErrorParts = 2;
constexpr std::size_t kOfRecords = 0, kOfTraced = 1;

/// One standard error from the two parts. @param image  sums of `passes`; becomes their mean
void finish_error(int passes, Image& image)
{
    Image error(image.width, image.height, 1);
    for (std::size_t i = 0; i < error.pixels.size(); ++i) {
        const float records = image.pixels[kErrorParts * i + kOfRecords], traced = image.pixels[kErrorParts * i + kOfTraced];
        error.pixels[i] = std::sqrt(records * records + traced) / static_cast<float>(passes);
    }
    image = std::move(error);
}

}  // namespace

std::size_t accumulate_pass(const GBuffer& g, const View& view, const Shading& shading, const PassLight& light,
                            const std::vector<glm::vec3>& weight, LayeredImage& sums)
{
    const SplatBuffer& indirect = light.indirect;
    Image& beauty = layer(sums, "beauty", g, 4);
    Image& emission = layer(sums, "emission", g, 3);
    Image& direct_layer = layer(sums, "direct", g, 3);
    Image& indirect_layer = layer(sums, "indirect", g, 3);
    Image& error_layer = layer(sums, kErrorLayer, g, kErrorParts);
    Image& irradiance_layer = layer(sums, "irradiance", g, 3);
    Image& albedo = layer(sums, "albedo", g, 3);
    Image& normal = layer(sums, "normal", g, 3);
    Image& depth = layer(sums, "depth", g, 1);
    Image& records = layer(sums, "records", g, 1);
    const bool first = weight.empty();
    const bool orthographic = view.camera.projection == Projection::orthographic;
    const glm::dvec3 forward = -glm::dvec3(view.camera.world_from_view[2]);
    std::size_t unserved = 0;
    for (std::size_t i = 0; i < g.size(); ++i) {
        const glm::vec3 passes = first ? glm::vec3(1.0f) : weight[i];
        if (!g.covered(i)) {
            add(emission, i, passes * g.emission[i]);
            if (first)
                depth.pixels[i] = std::numeric_limits<float>::infinity();
            continue;
        }
        const glm::vec3 share = shading.coverage.empty() ? passes : passes * shading.coverage[i];
        add(emission, i, share * g.emission[i]);
        const glm::vec3 reflectance = share * g.albedo[i] * kInversePi;
        glm::vec3 direct = reflectance * light.direct.irradiance[i];
        if (!light.direct.glossy.empty())
            direct += share * light.direct.glossy[i];
        add(direct_layer, i, direct);
        if (!light.traced.radiance.empty()) {
            add(indirect_layer, i, share * light.traced.radiance[i]);
            const float error = luminance(share) * light.traced.error[i];
            error_layer.pixels[kErrorParts * i + kOfTraced] += error * error;
        }
        beauty.pixels[4 * i + 3] += luminance(share);
        if (first) {
            const glm::vec3 p = g.position(i);
            add(albedo, i, g.albedo[i]);
            add(normal, i, g.normal(i));
            depth.pixels[i] += orthographic ? static_cast<float>(glm::dot(glm::dvec3(p), forward)) : glm::length(p);
        }
        if (indirect.width == 0)
            continue;
        const float sum = indirect.weight[i];
        if (!(sum > 0.0f)) {
            ++unserved;
            continue;
        }
        const glm::vec3 e = glm::vec3(indirect.weighted_r[i], indirect.weighted_g[i], indirect.weighted_b[i]) / sum;
        glm::vec3 radiance = reflectance * e;
        if (!shading.bsdf.empty())
            radiance += share * glossy_radiance(shading, indirect, i, glm::dot(g.normal(i), outgoing_at(g, view.camera, i)));
        add(indirect_layer, i, radiance);
        error_layer.pixels[kErrorParts * i + kOfRecords] += light.indirect_error.total(i) * luminance(radiance);
        if (first) {
            add(irradiance_layer, i, e);
            records.pixels[i] += indirect.count[i];
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
        for (float& value : image.pixels)
            value *= scale;
    }
    Image& beauty = sums.layers["beauty"];
    const Image& emission = sums.layers["emission"];
    const Image& direct = sums.layers["direct"];
    const Image& indirect = sums.layers["indirect"];
    const std::size_t pixels = beauty.pixels.size() / 4;
    for (std::size_t i = 0; i < pixels; ++i)
        for (std::size_t c = 0; c < 3; ++c)
            beauty.pixels[4 * i + c] = emission.pixels[3 * i + c] + direct.pixels[3 * i + c] + indirect.pixels[3 * i + c];
}

}  // namespace rcs
