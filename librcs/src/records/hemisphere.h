#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

namespace rcs {

/// M x N strata of equal cosine-weighted solid angle over a hemisphere, and what the gradient sums need of
/// each ring j and azimuth k. Cell c = j N + k; sin^2 of a ring's lower elevation bound is j/M.
struct HemisphereGrid {
    int rings = 0;     ///< M
    int azimuths = 0;  ///< N, about pi M
    int cells = 0;     ///< M N

    // Lattice offsets inside each cell before the record's own shift, in [0, 1).
    std::vector<float> lattice_theta, lattice_phi;

    // Per ring: sine and cosine of its lower bound's and its middle's polar angle.
    std::vector<float> sin_lower, cos_lower, sin_middle, cos_middle;
    // Per ring: mean tangent of the polar angle; factors of the wall to the ring inside it, (2 pi/N) sin cos^2 of
    // the lower bound, and of the walls between azimuths, the integral of the cosine over the polar angle.
    std::vector<float> tangent, ring_wall, azimuth_wall;
    // Per azimuth: unit vectors at the cell's middle (u_k) and at its lower bound.
    std::vector<float> cos_phi, sin_phi, cos_bound, sin_bound;
};

/// The largest grid: what RecordSettings::rays may ask for.
inline constexpr int kMostHemisphereRays = 65536;

/// @param rays  wanted number of cells, in [1, kMostHemisphereRays]; M = round(sqrt(rays / pi)) >= 2, N = round(rays /
/// M)
HemisphereGrid make_hemisphere_grid(int rays);

/// What came back from each cell's ray, component by component, index c.
struct HemisphereSamples {
    std::vector<float> red, green, blue;  ///< radiance [W m^-2 sr^-1]
    std::vector<float> inverse_distance;  ///< [1/m], 0 where nothing was hit
    std::vector<float> cosine;            ///< to the record's normal
    /// q of the plane that the ray hit, in the record's frame: that plane lies at distance 1/(q.w) along any
    /// direction w [1/m]; 0 where nothing was hit.
    std::vector<float> plane_x, plane_y, plane_z;

    explicit HemisphereSamples(int cells)
        : red(static_cast<std::size_t>(cells)),
          green(red),
          blue(red),
          inverse_distance(red),
          cosine(red),
          plane_x(red),
          plane_y(red),
          plane_z(red)
    {
    }

    /// @param radiance  [W m^-2 sr^-1]
    void add(std::size_t cell, glm::vec3 radiance)
    {
        red[cell] += radiance.r;
        green[cell] += radiance.g;
        blue[cell] += radiance.b;
    }
};

/// Unit directions of all cells in the local frame; every cell's lattice point is shifted by `shift`.
void hemisphere_directions(const HemisphereGrid& grid, glm::vec2 shift, float* x, float* y, float* z);

/// Integrals over the hemisphere in the local frame.
struct HemisphereIntegrals {
    glm::vec3 irradiance;               ///< E [W m^-2]
    glm::vec3 rotation_gradient[3];     ///< per colour, z = 0
    glm::vec3 translation_gradient[3];  ///< per colour, z = 0
    float harmonic_mean_distance;       ///< [m], may be +inf
    float minimum_distance;             ///< [m], grazing cells left out; may be +inf
    float standard_error;               ///< of E's luminance [W m^-2]
};
/// @param means  radiance of the cells as far as more rays tell it, for the gradients
HemisphereIntegrals integrate(const HemisphereGrid& grid, const HemisphereSamples& samples,
                              const HemisphereSamples& means);
inline HemisphereIntegrals integrate(const HemisphereGrid& grid, const HemisphereSamples& samples)
{
    return integrate(grid, samples, samples);
}

/// Of E's luminance [W m^-2], as integrate() has it.
float standard_error(const HemisphereGrid& grid, const HemisphereSamples& samples);

}  // namespace rcs
