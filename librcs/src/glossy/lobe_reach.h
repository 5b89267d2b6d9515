#pragma once

#include <cstddef>
#include <cstdint>

#include "gbuffer/shading.h"
#include "rcs/gbuffer.h"

namespace rcs {

/// Whether traced lobes show what is behind, which neighbours do not.
bool looks_through(const Bsdf& bsdf);

/// Whether a neighbour lies on the same, about equally glossy surface: only then may it share rays.
bool may_share(const GBuffer& g, const Shading& shading, std::size_t pixel, std::size_t neighbour);

/// How far a pixel may share, however far its rays go [px]. @param alpha  width of its lobe
float most_reach(const GBuffer& g, const Shading& shading, std::size_t pixel, float alpha);

/// Of what a pixel's lobes reflect of light from all around, what comes from above its face, in [0, 1]: where the
/// normal is bent, some of a lobe looks below it, and finds nothing. By a few directions of the lobes' own.
/// @param outgoing  unit, towards the viewer   @param key  of random numbers
float part_above_face(const Bsdf& bsdf, glm::vec3 outgoing, LobeSet lobes, std::uint64_t key);

}  // namespace rcs
