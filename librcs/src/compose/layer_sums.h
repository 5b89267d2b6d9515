#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <glm/glm.hpp>

#include "compose/cryptomatte.h"
#include "compose/motion.h"
#include "rcs/effect_plan.h"
#include "rcs/gbuffer.h"
#include "rcs/image.h"

namespace rcs {

struct SampledLight;

/// What the sample of a pixel shows, from which each layer takes its part; 0 where there is nothing of the kind.
struct Sample {
    std::size_t pixel = 0;
    bool covered = false;        ///< by a surface
    bool served = false;         ///< by records
    glm::vec3 share{0.0f};       ///< of the surface's or the sky's light that reaches the eye
    glm::vec3 direct{0.0f};      ///< reflected light, `share` taken in [W m^-2 sr^-1]
    glm::vec3 traced{0.0f};      ///< indirect light by rays, likewise
    glm::vec3 recorded{0.0f};    ///< ... and by records
    glm::vec3 irradiance{0.0f};  ///< that records tell [W m^-2]
    float direct_error = 0.0f, traced_error = 0.0f, recorded_error = 0.0f;  ///< standard errors of their luminance
    float records = 0.0f;                                                   ///< that cover the pixel
    const SampledLight* sampled = nullptr;  ///< what is noisy in it; null where no layer asks for that
};

struct PictureLayers;

/// Where the samples of one pass lie.
struct SamplePass {
    const PictureLayers& picture;
    const GBuffer& gbuffer;
    const View& view;
    bool first;  ///< nothing is in front of these surfaces: it is their albedo, normal and depth that the picture keeps
    std::optional<Motion::Images> images;  ///< of the view, if its motion is told
};

/// How a layer of the table adds up over passes. Sums begin with 0.
struct LayerSum {
    std::string_view name;
    int channels;  ///< of the sums
    void (*add)(const SamplePass& pass, std::span<const Sample> samples, Image& sums);
    void (*finish)(int passes, Image& sums);  ///< makes the layer of them
    /// Adds the sums of the first pass once more where `met` is not 0.
    void (*repeat)(const Image& first, const std::vector<std::uint8_t>& met, Image& sums);
    bool grows = false;  ///< the sums: samples are added by a thread at a time, else pixels are apart
};
/// Of a layer that render() makes.
const LayerSum& layer_sum(std::string_view name);

/// What beauty is the sum of.
inline constexpr const char* kBeautyParts[] = {"emission", "direct", "indirect"};

/// Adds the parts of beauty up, anew.
void add_up_beauty(LayeredImage& image);

/// The layers of one picture in the making, and what they are made from beside samples.
struct PictureLayers {
    struct Made {
        const LayerSum* sum;
        bool filled;  ///< something adds to it; else it stays 0
        bool kept;
    };
    const Scene& scene;
    std::vector<Made> made = {};
    bool for_filter = false;            ///< there is one that tells what is noisy (kSampledLayer)
    std::optional<Motion> motion = {};  ///< these three only where a layer asks for them
    CryptomatteIds objects = {}, materials = {};
};
/// @param for_filter  whether kSampledLayer is made as well   @param motion  what the layer `motion` is told by
/// @throws Error bad_argument: that layer is kept, and there is nothing it could be told by
PictureLayers picture_layers(const EffectPlan& plan, const Scene& scene, const std::optional<MotionFrom>& motion,
                             bool for_filter);
/// Those that errors are judged by (estimate_errors()).
PictureLayers error_layers(const PictureLayers& all);

}  // namespace rcs
