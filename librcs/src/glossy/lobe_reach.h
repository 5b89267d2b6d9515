#pragma once

#include <cstddef>

#include "gbuffer/shading.h"
#include "rcs/gbuffer.h"

namespace rcs {

/// Whether traced lobes show what is behind, which neighbours do not.
bool looks_through(const Bsdf& bsdf);

/// Width of a pixel's narrowest lobe that is traced.
float narrowest_traced(const Shading& shading, std::size_t pixel);

/// Whether a neighbour lies on the same, about equally glossy surface: only then may it share rays.
bool may_share(const GBuffer& g, const Shading& shading, std::size_t pixel, std::size_t neighbour);

/// How far a pixel may share, however far its rays go [px]. @param alpha  width of its lobe
float most_reach(const GBuffer& g, const Shading& shading, std::size_t pixel, float alpha);

}  // namespace rcs
