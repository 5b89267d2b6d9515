#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "hit_light/hit_radiance.h"
#include "light_cache/cell_rays.h"
#include "lit_points/importance.h"
#include "lit_points/lit_points.h"
#include "lit_points/surface_pieces.h"
#include "rcs/gbuffer.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// A mixture: of where it is bright, of what is seen at all, and of everything [m^-2].
struct PointDensity {
    float bright = 0.0f, seen = 0.0f, even = 0.0f;

    float at(const Importance::Value& value) const { return bright * value.bright + seen * value.seen + even; }
    float at(const Importance& importance, glm::vec3 position, glm::vec3 normal) const
    {
        return at(importance.at(position, normal));
    }
};

/// What is found out before points are lit.
struct LightSurvey {
    PlaceLight light;
    std::uint64_t seed;
    Importance importance;
    std::vector<SurfacePiece> pieces;
    /// Of each piece's probes, as they are now: every density asks for them.
    std::vector<std::array<Importance::Value, SurfacePiece::kProbes>> at_probes;
    double area = 0.0, seen = 0.0, bright = 0.0;  ///< of all pieces: sum, and integrals of what is wanted there
};
/// Looks around from visible points, and for what is bright of what they see.
/// @param part  (0, 1], of the work of a careful one: rays, pilots and pieces of surfaces
LightSurvey survey_light(const PlaceLight& light, const GBuffer& gbuffer, const View& view, std::uint64_t seed,
                         ThreadPool& pool, double part = 1.0);

/// Visible points, and more of what they see: places whose light matters.
std::vector<SurfaceSample> places_in_view(const RayScene& rays, const HitRadiance& radiance, const GBuffer& gbuffer,
                                          std::uint64_t seed, ThreadPool& pool);

/// About so many points in all, wherever they are wanted most.
PointDensity density_of_points(const LightSurvey& survey, double points);
/// Places with this density.
std::vector<PlaceToLight> draw_places(const LightSurvey& survey, const PointDensity& density, std::uint64_t seed,
                                      ThreadPool& pool);

}  // namespace rcs
