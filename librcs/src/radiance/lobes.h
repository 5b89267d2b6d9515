#pragma once

#include "material/bsdf.h"
#include "radiance/harmonics.h"

namespace rcs {

/// Lobes at least this wide are lit by records. Six bands hold a GGX lobe of this width to some 2 % of its
/// reflection under light with hard edges (5 % when seen at 70 degrees; measured over random half-space
/// lights), and wider ones better; narrower lobes are ray traced per pixel. 0.3 is a roughness of 0.55.
inline constexpr float kLeastRecordAlpha = 0.3f;

inline bool lit_by_records(const Bsdf& bsdf) { return bsdf.has_specular() && bsdf.alpha >= kLeastRecordAlpha; }

/// Directional albedo of the lobe that records light: the specular one as the coat leaves it.
glm::vec3 recorded_albedo(const Bsdf& bsdf, float cosine);

/// The specular lobe as records meet it: coefficients c with
///   sum c_lm Lambda_lm = reflected radiance / directional albedo of the lobe,
/// where Lambda holds incoming radiance times cosine (IncidentRadiance). Not the lobe's own projection: that
/// is cut at the horizon and rings; below the horizon Lambda's function is zero and the fit may do as it likes, so
/// it is a least-squares fit of f over the upper hemisphere, weighted by the cosine.
///
/// A lobe is mirror-symmetric about the plane of normal and viewer, so kBands zonal harmonics about axes in that
/// plane span each band: a rotation into scene space rotates the axes, and no harmonics have to be rotated.
/// @param bsdf  16 pointers; null or not lit_by_records(): zeros   @param outgoing  unit, scene space
void evaluate_lobes(const Bsdf* const* bsdf, const glm::vec3* outgoing, HarmonicLanes& coefficients);

}  // namespace rcs
