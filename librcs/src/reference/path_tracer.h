#pragma once

#include <cstddef>
#include <vector>

#include <glm/glm.hpp>

#include "rays/surface.h"
#include "rcs/camera.h"
#include "rcs/ray_scene.h"
#include "rcs/reference.h"
#include "reference/lamps.h"
#include "reference/path_points.h"
#include "scene/environment.h"

namespace rcs {

// The transport that the reference solves, and that render() approximates:
//  - Surfaces reflect by material/bsdf.h on both sides, and emit from the front, or from both sides if their material
//    is double sided. The camera looks through the backs of single-sided materials; for every other ray any
//    triangle is an end.
//  - Light from directions below the horizon of the geometric or the shading normal, both turned to the side a point
//    is seen from, does not count.
//  - Rays go straight on through surfaces by alpha and by thin transmission, tinted; that is no bounce. But a pane that
//  is
//    rough (kStraightAlpha) and that the camera sees, alone or behind others, scatters by its lobe what it lets
//    through (KHR_materials_transmission): that is a bounce as reflection is.
//  - direct: light of lamps (punctual lights, emissive triangles, the peaks of the sky) that the visible point
//    reflects.
//  - indirect: what else it reflects: the rest of the sky, and light that surfaces reflect. With N bounces a path meets
//    up to N surfaces after the visible point; each reflects the light of lamps and sky.
// Lambertian points find lamps by sampling them. Glossy points also by where their paths go on: both ways count, by
// the power heuristic (Veach and Guibas 1995). So do all points for an environment image.

/// One of the surfaces that the camera sees behind each other.
struct SeenLayer {
    VisiblePoint point;
    glm::vec3 weight{1.0f};        ///< of the light that it sends, in the pixel
    float chance_below = 0.0f;     ///< paths choose this layer with numbers from here up to the next one's
    LampsAtPoint lamps;            ///< those left to sample
    LampsAtPoint behind;           ///< the same for the other side, if light from there counts
    glm::vec3 exact_direct{0.0f};  ///< reflected light of lamps that need no sampling
};

/// What the camera sees along one ray.
struct Seen {
    std::vector<SeenLayer> layers;  ///< nearest first; the first `count` count
    std::size_t count = 0;          ///< 0: the sky alone
    glm::vec3 outgoing{0.0f};       ///< unit, towards the camera
    glm::vec3 emission{0.0f};       ///< of all layers and the sky behind
};

/// One path's share of each layer of the image.
struct PathResult {
    glm::vec3 emission{0.0f}, direct{0.0f}, indirect{0.0f};
};

/// The pair of a path's points that places it in the pixel; the tracer takes those after it.
constexpr int kPixelPair = 0;
/// ... and the one that places it on the lens.
constexpr int kLensPair = -1;

class PathTracer {
public:
    /// Refers to `rays`.
    PathTracer(const RayScene& rays, const View& view, const ReferenceOptions& options);

    /// @param which  the lamps that paths will sample; the others are computed exactly here
    void look(const CameraRay& camera, Lamps which, Seen& seen) const;

    /// @param scratch  for the lamps at deeper points
    PathResult trace(const Seen& seen, const PathPoints& points, LampsAtPoint& scratch) const;

private:
    struct Vertex;
    void add_layer(const Hit& hit, const CameraRay& camera, Lamps which, glm::vec3 weight, Seen& seen) const;
    glm::vec3 exact_direct(const VisiblePoint& point, glm::vec3 outgoing, Lamps which) const;
    void weigh_behind(const SurfacePoint& point, const Bsdf& bsdf, Lamps which, LampsAtPoint& lamps) const;
    glm::vec3 lamp_light(const Vertex& vertex, const LampsAtPoint& lamps, const PathPoints& points) const;
    void add_sky(const Vertex& vertex, const PathPoints& points, PathResult& result) const;
    bool extend(Vertex& vertex, LampsAtPoint& lamps, const PathPoints& points, PathResult& result) const;
    bool arrive(Vertex& vertex, const Hit& hit, glm::vec3 direction, LampsAtPoint& lamps, const PathPoints& points,
                PathResult& result) const;

    const RayScene& rays_;
    glm::dvec3 camera_position_;
    float texture_scale_;
    int bounces_;
    LampList lamps_;
    Environment sky_;
    bool has_sky_;
};

}  // namespace rcs
