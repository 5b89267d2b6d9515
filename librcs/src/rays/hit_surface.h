#pragma once

#include "rays/packet.h"
#include "scene/surface.h"

namespace rcs {

/// A packet ray's hit as gathering shades it: the same surface as surface_at(), from one cache line per
/// triangle, its position taken from the ray (as exact as the ray is short).
struct HitSurface {
    SurfacePoint point;
    float log2_uv_per_length;  ///< texture space per scene length [1/m], for the choice of a mip level
};
HitSurface hit_surface(const RayScene& rays, const HitPacket& packet, int lane);

/// Asks for the memory that hit_surface() will read: hits lie anywhere in the scene.
void prefetch_hit_surface(const RayScene& rays, const HitPacket& packet, int lane);

}  // namespace rcs
