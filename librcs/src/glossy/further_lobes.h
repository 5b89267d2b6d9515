#pragma once

#include <cstdint>
#include <vector>

#include "gbuffer/shading.h"
#include "glossy/traced_lobes.h"
#include "rcs/gbuffer.h"

namespace rcs {

struct FurtherLobes {
    float allowed = 0.06f;  ///< standard error that a pixel may keep, relative to its light
    int most = 5;           ///< rounds
};

/// How many more rounds of rays along its narrow lobes each pixel is to have: so many times more as its noise is above
/// what is allowed. The error of a picture falls most for its rays where those of a pixel go with about its noise, and
/// not with its square. What a lobe's light is off by, pixels around say together: by its own rays those would get more
/// that happened to see a rare bright spot, and the mean would be short.
/// @param traced  by one round, and what was known   @param beside  luminance of the other light of each pixel, and
///        what is too dark to be seen [W m^-2 sr^-1]   @return per pixel
std::vector<std::uint8_t> further_rounds(const GBuffer& gbuffer, const Shading& shading, const TracedLight& traced,
                                         const std::vector<float>& beside, const FurtherLobes& settings);

/// Averages a further round into the light of those pixels that had it, by what is known of them: as many rounds, or
/// what earlier views knew as well. @param had  per pixel, 0: it had none; null: all had it
void add_round(TracedLight& light, const TracedLight& more, const std::vector<std::uint8_t>* had = nullptr);

}  // namespace rcs
