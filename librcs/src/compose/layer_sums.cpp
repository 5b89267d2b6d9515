#include "compose/layer_sums.h"

#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "compose/sampled_light.h"
#include "rcs/error.h"
#include "util/color.h"

namespace rcs {
namespace {

// While passes are summed up, the error has two parts: that of records, which all passes share, adds up; that of traced
// lobes, each pass by itself, adds up squared.
constexpr int kErrorParts = 2;
constexpr std::size_t kOfRecords = 0, kOfTraced = 1;

void plus(float* to, glm::vec3 value)
{
    to[0] += value.r;
    to[1] += value.g;
    to[2] += value.b;
}

void add_cover(const SamplePass&, const Sample& s, float* to)
{
    if (s.covered) to[3] += luminance(s.share);
}

void add_emission(const SamplePass& pass, const Sample& s, float* to)
{
    plus(to, s.share * pass.gbuffer.emission[s.pixel]);
}

void add_direct(const SamplePass&, const Sample& s, float* to) { plus(to, s.direct); }

void add_indirect(const SamplePass&, const Sample& s, float* to)
{
    plus(to, s.traced);
    plus(to, s.recorded);
}

void add_error(const SamplePass&, const Sample& s, float* to)
{
    to[kOfTraced] += s.traced_error * s.traced_error;
    to[kOfRecords] += s.recorded_error;
}

/// Each pass by itself.
void add_direct_error(const SamplePass&, const Sample& s, float* to) { *to += s.direct_error * s.direct_error; }

void add_irradiance(const SamplePass& pass, const Sample& s, float* to)
{
    if (pass.first) plus(to, s.irradiance);
}

void add_albedo(const SamplePass& pass, const Sample& s, float* to)
{
    if (pass.first && s.covered) plus(to, pass.gbuffer.albedo[s.pixel]);
}

void add_normal(const SamplePass& pass, const Sample& s, float* to)
{
    if (pass.first && s.covered) plus(to, pass.gbuffer.normal(s.pixel));
}

void add_depth(const SamplePass& pass, const Sample& s, float* to)
{
    if (!pass.first) return;
    const glm::vec3 p = pass.gbuffer.position(s.pixel);
    const Camera& camera = pass.view.camera;
    if (!s.covered)
        *to = std::numeric_limits<float>::infinity();
    else if (camera.projection == Projection::orthographic)
        *to += static_cast<float>(glm::dot(glm::dvec3(p), -glm::dvec3(camera.world_from_view[2])));
    else
        *to += glm::length(p);
}

/// Sums and, in the last channel, the number of samples that see a surface.
void add_position(const SamplePass& pass, const Sample& s, float* to)
{
    if (!pass.first || !s.covered) return;
    const GBuffer& g = pass.gbuffer;
    plus(to, glm::vec3(pass.picture.scene.origin + g.camera_position + glm::dvec3(g.position(s.pixel))));
    to[3] += 1.0f;
}

// Motion of surfaces and of the sky are summed up side by side, each with the number of its samples.
constexpr int kMotionParts = 6;
constexpr std::size_t kOfSurface = 0, kOfSky = 3;

void add_motion(const SamplePass& pass, const Sample& s, float* to)
{
    if (!pass.first) return;
    const std::size_t width = static_cast<std::size_t>(pass.view.width);
    const glm::dvec2 corner(static_cast<double>(s.pixel % width), static_cast<double>(s.pixel / width));
    const Motion& motion = *pass.picture.motion;
    const auto moved = s.covered ? motion.of_surface(pass.gbuffer, *pass.images, s.pixel)
                                 : Motion::of_sky(*pass.images, corner + pass.view.pixel_offset);
    if (moved) plus(to + (s.covered ? kOfSurface : kOfSky), glm::vec3(*moved, 1.0f));
}

void add_object(const SamplePass& pass, std::span<const Sample> samples, Image& sums)
{
    for (const Sample& s : samples)
        if (s.covered)
            add_coverage(sums, s.pixel, pass.picture.objects.of_instance[pass.gbuffer.instance[s.pixel]],
                         luminance(s.share));
}

void add_material(const SamplePass& pass, std::span<const Sample> samples, Image& sums)
{
    for (const Sample& s : samples)
        if (s.covered)
            add_coverage(sums, s.pixel, pass.picture.materials.of_instance[pass.gbuffer.instance[s.pixel]],
                         luminance(s.share));
}

void add_records(const SamplePass& pass, const Sample& s, float* to)
{
    if (pass.first) *to += s.records;
}

void add_sampled(const SamplePass&, const Sample& s, float* to)
{
    using At = SampledChannels;
    const SampledLight& sampled = *s.sampled;
    for (std::size_t k = 0; k < SampledLight::kKinds; ++k) {
        float* const kind = to + k * At::kOfKind;
        const SampledLight::OfKind& of = sampled.kinds[k];
        plus(kind + At::kLight, of.light);
        kind[At::kSquaredError] += of.error * of.error;
        kind[At::kNoisy] += of.noisy;
        for (std::size_t n = 0; n < of.again.size(); ++n) kind[At::kAgain + n] += of.again[n];
    }
    plus(to + At::kDiffuseReflectance, sampled.diffuse_reflectance);
    plus(to + At::kLobeReflectance, sampled.lobe_reflectance);
    plus(to + At::kNormal, sampled.normal);
}

/// A layer to which each sample adds by itself.
template <void (*add_one)(const SamplePass&, const Sample&, float*)>
void each(const SamplePass& pass, std::span<const Sample> samples, Image& sums)
{
    for (const Sample& s : samples)
        add_one(pass, s, sums.pixels.data() + static_cast<std::size_t>(sums.channels) * s.pixel);
}

/// Every pass counts the same.
void finish_mean(int passes, Image& sums)
{
    const float scale = 1.0f / static_cast<float>(passes);
    for (float& value : sums.pixels) value *= scale;
}

/// The mean of those samples that the last channel counts.
void finish_mean_of_counted(int, Image& sums)
{
    Image mean(sums.width, sums.height, sums.channels - 1);
    const auto channels = static_cast<std::size_t>(mean.channels);
    for (std::size_t i = 0; i < mean.pixels.size() / channels; ++i) {
        const float* const sum = sums.pixels.data() + (channels + 1) * i;
        for (std::size_t c = 0; c < channels && sum[channels] > 0.0f; ++c)
            mean.pixels[channels * i + c] = sum[c] / sum[channels];
    }
    sums = std::move(mean);
}

/// Of surfaces where a sample sees one, else of the sky.
void finish_motion(int, Image& sums)
{
    Image motion(sums.width, sums.height, 2);
    for (std::size_t i = 0; i < motion.pixels.size() / 2; ++i) {
        const float* const parts = sums.pixels.data() + kMotionParts * i;
        const float* const part = parts + (parts[kOfSurface + 2] > 0.0f ? kOfSurface : kOfSky);
        for (std::size_t c = 0; c < 2 && part[2] > 0.0f; ++c) motion.pixels[2 * i + c] = part[c] / part[2];
    }
    sums = std::move(motion);
}

/// One standard error from the two parts.
void finish_error(int passes, Image& sums)
{
    Image error(sums.width, sums.height, 1);
    for (std::size_t i = 0; i < error.pixels.size(); ++i) {
        const float records = sums.pixels[kErrorParts * i + kOfRecords],
                    traced = sums.pixels[kErrorParts * i + kOfTraced];
        error.pixels[i] = std::sqrt(records * records + traced) / static_cast<float>(passes);
    }
    sums = std::move(error);
}

void finish_direct_error(int passes, Image& sums)
{
    for (float& value : sums.pixels) value = std::sqrt(value) / static_cast<float>(passes);
}

/// Means, and of independent passes their squared errors.
void finish_sampled(int passes, Image& sums)
{
    using At = SampledChannels;
    finish_mean(passes, sums);
    const float scale = 1.0f / static_cast<float>(passes);
    for (std::size_t i = 0; i < sums.pixels.size(); i += At::kAll)
        for (std::size_t k = 0; k < SampledLight::kKinds; ++k)
            sums.pixels[i + k * At::kOfKind + At::kSquaredError] *= scale;
}

void repeat_values(const Image& first, const std::vector<std::uint8_t>& met, Image& sums)
{
    const auto channels = static_cast<std::size_t>(sums.channels);
    const float* from = first.pixels.data();
    float* to = sums.pixels.data();
    for (std::size_t i = 0; i < met.size(); ++i, from += channels, to += channels)
        if (met[i] != 0)
            for (std::size_t c = 0; c < channels; ++c) to[c] += from[c];
}

constexpr LayerSum kSums[] = {
    {"beauty", 4, each<add_cover>, finish_mean, repeat_values},  // its colours come last, from its parts
    {"emission", 3, each<add_emission>, finish_mean, repeat_values},
    {"direct", 3, each<add_direct>, finish_mean, repeat_values},
    {"direct_error", 1, each<add_direct_error>, finish_direct_error, repeat_values},
    {"indirect", 3, each<add_indirect>, finish_mean, repeat_values},
    {"indirect_error", kErrorParts, each<add_error>, finish_error, repeat_values},
    {"irradiance", 3, each<add_irradiance>, finish_mean, repeat_values},
    {"albedo", 3, each<add_albedo>, finish_mean, repeat_values},
    {"normal", 3, each<add_normal>, finish_mean, repeat_values},
    {"depth", 1, each<add_depth>, finish_mean, repeat_values},
    {"records", 1, each<add_records>, finish_mean, repeat_values},
    {"position", 4, each<add_position>, finish_mean_of_counted, repeat_values},
    {"motion", kMotionParts, each<add_motion>, finish_motion, repeat_values},
    {kSampledLayer, static_cast<int>(SampledChannels::kAll), each<add_sampled>, finish_sampled, repeat_values},
    {kObjectLayer, 2, add_object, rank_coverage, repeat_coverage, true},
    {kMaterialLayer, 2, add_material, rank_coverage, repeat_coverage, true},
};

}  // namespace

const LayerSum& layer_sum(std::string_view name)
{
    for (const LayerSum& sum : kSums)
        if (sum.name == name) return sum;
    throw Error(ErrorCode::internal, "layer " + std::string(name) + " has no sum");
}

PictureLayers picture_layers(const EffectPlan& plan, const Scene& scene, const std::optional<MotionFrom>& motion,
                             bool for_filter)
{
    PictureLayers layers{scene};
    layers.for_filter = for_filter;
    if (for_filter) layers.made.push_back({&layer_sum(kSampledLayer), true, false});
    const EffectSet effects = plan.set();
    for (const PlannedLayer& planned : plan.layers) {
        if (!planned.made) continue;
        const std::string_view name = planned.layer->name;
        const EffectSet& by = planned.layer->made_by;
        layers.made.push_back({&layer_sum(name), by.empty() || by.has_any(effects), planned.kept});
        if (name == "motion") {
            if (!motion) throw Error(ErrorCode::bad_argument, "layer motion has no other time or camera to be told by");
            layers.motion.emplace(scene, *motion);
        }
        if (name == kObjectLayer) layers.objects = object_ids(scene);
        if (name == kMaterialLayer) layers.materials = material_ids(scene);
    }
    return layers;
}

PictureLayers error_layers(const PictureLayers& all)
{
    constexpr std::string_view kJudged[] = {"beauty",       "emission", "direct",
                                            "direct_error", "indirect", "indirect_error"};
    PictureLayers few{all.scene};
    for (const PictureLayers::Made& layer : all.made)
        if (std::find(std::begin(kJudged), std::end(kJudged), layer.sum->name) != std::end(kJudged))
            few.made.push_back(layer);
    return few;
}

}  // namespace rcs
