#pragma once

#include "gbuffer/shading.h"
#include "glossy/traced_lobes.h"
#include "rcs/gbuffer.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// What rays along a pixel's lobes found is noise of its own about what changes slowly over a surface, over the albedo
/// of its lobes. So pixels beside each other, whose lobes look about the same way, put it together: each keeps of its
/// difference to the mean around it what is not likely to be noise (Lee 1980, as for lamps that are drawn).
/// @param light  keeps in `apart` what each pixel found, and begins with that if it is there
void put_together(const GBuffer& gbuffer, const Shading& shading, ThreadPool& pool, TracedLight& light);

}  // namespace rcs
