#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "rcs/effect_plan.h"
#include "rcs/scene.h"

namespace rcs {

/// What a surface can be somewhere on a mesh, material, textures and vertex colours taken together. Each bit errs on
/// the side of being set.
enum Trait : std::uint32_t {
    kReflects = 1u << 0,    ///< anything at all
    kHasLobe = 1u << 1,     ///< other than diffuse, which reflects lamps
    kWideLobe = 1u << 2,    ///< at least kLeastRecordAlpha: for records
    kNarrowLobe = 1u << 3,  ///< any other, but transmission that shows what is straight behind: for rays
    kEmits = 1u << 4,       ///< or is unlit
    kMasked = 1u << 5,      ///< has texels below its cutoff
    kBlended = 1u << 6,     ///< alpha is less than 1
    kTransmits = 1u << 7,
    kBumpy = 1u << 8,     ///< a normal texture that turns normals
    kTextured = 1u << 9,  ///< reflects by textures that vary
};
/// How many there are; bit numbers are below.
inline constexpr int kTraits = 10;
/// Behind these the camera looks for more.
inline constexpr std::uint32_t kSeeThrough = kMasked | kBlended | kTransmits;

struct MeshTraits {
    std::uint32_t bits = 0;
    float least_roughness = 1.0f, most_roughness = 0.0f;  ///< perceptual, of lobe and coat; least > most: there is none
    int most_lobes = 0;                                   ///< of a point
    float most_albedo = 0.0f;                             ///< bound of what part of the light it reflects, in [0, 1]

    bool is(std::uint32_t traits) const { return (bits & traits) != 0u; }
};

/// One for each mesh; textures are looked through as far as it takes.
std::vector<MeshTraits> find_traits(const Scene& scene);

/// What a mesh's material says it may be, textures and vertex colours not looked at: kMasked, kBlended, kTransmits,
/// kBumpy and kTextured.
std::uint32_t declared_traits(const Material& material);

/// Which of kMasked, kBlended, kTransmits and kBumpy rays and pixels ask this mesh for: what it has, or what its
/// material says and the user wants asked anyway.
std::uint32_t simulated_traits(const MeshTraits& traits, const Material& material, const EffectChoice& choice);

}  // namespace rcs
