#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "rcs/api.h"
#include "rcs/camera.h"
#include "rcs/gl_context.h"
#include "rcs/ray_scene.h"

namespace rcs {

/// The visible points of one view, one per pixel, row by row from the top left. Components lie in
/// planes of their own so that splatting and sampling run over whole vectors.
/// Positions are relative to `camera_position`: their error shrinks with the distance to the camera.
struct GBuffer {
    /// The instance where nothing is seen.
    static constexpr std::uint32_t kNone = 0xffffffffu;

    int width = 0;                    ///< [px]
    int height = 0;                   ///< [px]
    glm::dvec3 camera_position{0.0};  ///< scene space [m]

    std::vector<float> position_x;            ///< relative to the camera [m]; 0 where nothing is seen
    std::vector<float> position_y;            ///< likewise
    std::vector<float> position_z;            ///< likewise
    std::vector<float> normal_x;              ///< of the shading normal, unit, towards the viewer's side
    std::vector<float> normal_y;              ///< likewise
    std::vector<float> normal_z;              ///< likewise
    std::vector<glm::vec3> geometric_normal;  ///< unit, towards the viewer's side
    std::vector<float> footprint;             ///< sqrt of the surface area that one pixel covers [m]
    std::vector<float> position_error;        ///< bound of the rounding error of the scene-space position [m]
    std::vector<std::uint32_t> instance;      ///< index into Scene::instances; kNone where nothing is seen
    std::vector<std::uint32_t> primitive;     ///< index into Mesh::triangles; kNone where nothing is seen
    std::vector<glm::vec3> albedo;            ///< filtered over the pixel's footprint
    std::vector<glm::vec3> emission;          ///< radiance towards the camera; sky where nothing is seen

    /// Pixels.
    std::size_t size() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
    /// Whether a surface is seen there.
    bool covered(std::size_t pixel) const { return instance[pixel] != kNone; }
    /// Relative to the camera [m].
    glm::vec3 position(std::size_t i) const { return {position_x[i], position_y[i], position_z[i]}; }
    /// Shading normal, unit.
    glm::vec3 normal(std::size_t i) const { return {normal_x[i], normal_y[i], normal_z[i]}; }
    /// In scene space, rounded to floats [m].
    glm::vec3 scene_position(std::size_t i) const { return glm::vec3(camera_position + glm::dvec3(position(i))); }
};

/// Rasterises which triangle each pixel's sample sees (OpenGL), then evaluates the surface there
/// from the same attributes that rays use: one definition of a surface for both.
/// @param texture_scale  the width of the texture filter in pixels, > 0 (1/sqrt(n) with n samples a pixel)
RCS_API GBuffer render_gbuffer(GlContext& gl, const RayScene& rays, const View& view, float texture_scale,
                               ThreadPool& pool);

}  // namespace rcs
