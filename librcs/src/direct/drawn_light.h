#pragma once

#include <cstdint>
#include <vector>

#include "direct/direct.h"
#include "rcs/gbuffer.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// Where each point draws some of many lamps, what it finds of their light is noise of its own about what changes
/// slowly. So pixels beside each other on one surface put it together: each keeps of its difference to the mean around
/// it what is not likely to be noise (Lee 1980: the local linear minimum mean square error filter).
/// @param light  with errors, else nothing is done; keeps in `apart` what each pixel found, and begins with that if it
///               is there
/// @param keeps  1: the pixel's light stays as it is; empty: that of none does
void put_together(const GBuffer& gbuffer, const std::vector<std::uint8_t>& keeps, ThreadPool& pool,
                  DirectLightResult& light);

}  // namespace rcs
