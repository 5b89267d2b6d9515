#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <glm/glm.hpp>

#include "compose/compose.h"
#include "compose/layer_sums.h"

namespace rcs {

/// The layer that tells a filter what pixels have sampled by themselves. No picture keeps it.
inline constexpr const char* kSampledLayer = "sampled";

/// What a sample shows of light that is noisy by itself; `share` is taken in.
struct SampledLight {
    /// Kinds of it: of lamps by diffuse surfaces, of lamps by lobes, of other surfaces by lobes too narrow for records.
    enum Kind { diffuse, highlights, reflections };
    static constexpr std::size_t kKinds = 3;
    struct OfKind {
        glm::vec3 light{0.0f};            ///< [W m^-2 sr^-1]
        float error = 0.0f;               ///< standard error of its luminance
        float noisy = 0.0f;               ///< 1: it may be so, though its neighbours tell of no error
        std::array<float, 2> again = {};  ///< luminances by other samples, at pixels of CheckedPixels
    };
    std::array<OfKind, kKinds> kinds = {};
    glm::vec3 diffuse_reflectance{0.0f}, lobe_reflectance{0.0f}, normal{0.0f};
};

/// Where the layer's channels lie.
struct SampledChannels {
    static constexpr std::size_t kOfKind = 7;  ///< light, squared error, noisy, again
    static constexpr std::size_t kDiffuseReflectance = SampledLight::kKinds * kOfKind;
    static constexpr std::size_t kLobeReflectance = kDiffuseReflectance + 3, kNormal = kLobeReflectance + 3;
    static constexpr std::size_t kAll = kNormal + 3;
    static constexpr std::size_t kLight = 0, kSquaredError = 3, kNoisy = 4, kAgain = 5;  ///< within a kind
};

/// @param pass, s  where, and the sample so far: of its direct light, what is not the records'
SampledLight look_at_sampled(const SamplePass& pass, const Shading& shading, const ShownLight& light, const Sample& s);

}  // namespace rcs
