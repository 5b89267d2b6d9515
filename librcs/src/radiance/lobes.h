#pragma once

#include <glm/glm.hpp>

#include "material/bsdf.h"
#include "radiance/harmonics.h"
#include "shared/gpu_lobe.h"

namespace rcs {

/// Lobes that are lit_by_records() as records meet them: coefficients c with
///   sum c_lm Lambda_lm = reflected radiance / directional albedo of the lobe,
/// where Lambda holds incoming radiance times cosine (IncidentRadiance). Not the lobe's own projection: that
/// is cut at the horizon and rings; below the horizon Lambda's function is zero and the fit may do as it likes, so
/// it is a least-squares fit of f over the upper hemisphere, weighted by the cosine.
///
/// A lobe is mirror-symmetric about the plane of normal and viewer, so kBands zonal harmonics about axes in that
/// plane span each band: a rotation into scene space rotates the axes, and no harmonics have to be rotated.
/// @param lobes  16 pointers; null: zeros   @param normals, outgoing  unit, scene space
void evaluate_lobes(const Lobe* const* lobes, const glm::vec3* normals, const glm::vec3* outgoing,
                    HarmonicLanes& coefficients);

/// The fits that these are mixed from, as shaders/lobes.comp reads them, which does the same.
const gpu::GpuLobeFits& device_lobe_fits();
/// A lobe as it reads it: roughness over the range of the fits, f0, f90 - f0, and 1; zeros if it is null.
glm::vec4 device_lobe(const Lobe* lobe);

}  // namespace rcs
