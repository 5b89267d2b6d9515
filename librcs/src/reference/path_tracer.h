#pragma once

#include <optional>

#include <glm/glm.hpp>

#include "rcs/camera.h"
#include "rcs/ray_scene.h"
#include "rcs/reference.h"
#include "reference/lamp_sampling.h"
#include "scene/surface.h"

namespace rcs {

// The transport that the reference solves, and that render() approximates:
//  - Surfaces are Lambertian on both sides. They emit from the front, or from both sides if their
//    material is double sided. The camera looks through the backs of single-sided materials; for
//    every other ray any triangle is an end.
//  - Irradiance at a point with geometric normal n_g and shading normal n_s, both turned to the side
//    it is seen from: E = integral of L(w) (w.n_s) over the directions with w.n_s > 0 and w.n_g > 0.
//    Reflected radiance is albedo E / pi, at visible points and deeper in a path alike.
//  - direct: E of the lamps (punctual lights and emissive triangles). The sky is not a lamp.
//  - indirect: E of what else arrives: the sky where it is seen, and light that surfaces reflect. With
//    N bounces a path meets up to N surfaces after the visible point; each reflects the light of lamps
//    and sky. Lamps that a path runs into are not counted: next-event estimation has them already.

/// What the camera sees along one ray.
struct Seen {
    std::optional<VisiblePoint> point;  ///< empty: the sky
    LampsAtPoint lamps;                 ///< those left to sample
    glm::vec3 exact_irradiance{0.0f};   ///< of lamps that need no sampling
};

/// One path's share of each layer.
struct PathResult {
    glm::vec3 emission{0.0f}, direct{0.0f}, indirect{0.0f};
};

/// The pair of a path's points that places it in the pixel; the tracer takes those after it.
constexpr int kPixelPair = 0;

class PathTracer {
public:
    /// Refers to `rays` and `view`.
    PathTracer(const RayScene& rays, const View& view, const ReferenceOptions& options);

    /// Looks through image position (x, y) [px].
    /// @param which  the lamps that paths will sample; the others are computed exactly here
    void look(double x, double y, Lamps which, Seen& seen) const;

    /// @param scratch  for the lamps at deeper points
    PathResult trace(const Seen& seen, const PathPoints& points, LampsAtPoint& scratch) const;

private:
    std::optional<VisiblePoint> see(const CameraRay& camera) const;
    glm::vec3 gathered_radiance(SurfacePoint point, const PathPoints& points, LampsAtPoint& lamps) const;

    const RayScene& rays_;
    const View& view_;
    glm::dvec3 camera_position_;
    float texture_scale_;
    int bounces_;
    Lights lights_;
    bool has_sky_;
};

}  // namespace rcs
