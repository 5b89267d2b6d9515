#pragma once

#include <cstdint>

#include "cells/direct_cells.h"
#include "hit_light/hit_radiance.h"
#include "rcs/gbuffer.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// Lights the cells that the hemispheres of visible points meet, each with as many shadow rays as its noise asks for.
/// @param samples  about so many for all of them; too few for each to have some, as for a small picture: none is lit
DirectCells light_cells(const RayScene& rays, const HitRadiance& radiance, const GBuffer& gbuffer, const View& view,
                        double samples, std::uint64_t seed, ThreadPool& pool);

}  // namespace rcs
