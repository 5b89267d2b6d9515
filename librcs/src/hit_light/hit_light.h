#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <glm/glm.hpp>

#include "lamps/candidates.h"
#include "lamps/lights.h"
#include "rays/surface.h"
#include "util/random.h"

namespace rcs {

/// The lamps as gather hits see them: one of them is chosen per hit, in proportion to an estimate of what
/// it would send if nothing stood between.
class HitLights {
public:
    explicit HitLights(const Lights& lights);

    const Lights& lights() const { return lights_; }

    /// One shadow ray to shoot: light that arrives over it if nothing blocks it, divided by the chance of the choice.
    struct Sample {
        glm::vec3 irradiance{0.0f};  ///< [W m^-2]; 0: nothing to shoot
        glm::vec3 to_light{0.0f};    ///< unit
        Ray shadow_ray;              ///< set if there is irradiance
        std::uint32_t lamp = 0;      ///< its number: punctual lamps first, then triangles, then the sky's peaks
    };
    Sample sample(const SurfacePoint& point, RandomStream& random) const;

    /// About how often sample() finds light of this lamp from a direction, if it is not the only way to find it [1/sr];
    /// 0: a punctual lamp, which no ray can find. Not exact, but the same wherever it is asked for the same.
    float density(const SurfacePoint& point, std::uint32_t lamp, glm::vec3 direction) const;
    std::uint32_t triangle_lamp(std::uint32_t triangle) const
    {
        return static_cast<std::uint32_t>(lights_.punctual.size()) + triangle;
    }
    std::uint32_t peaks_lamp() const { return triangle_lamp(static_cast<std::uint32_t>(lights_.triangles.size())); }

    /// False only if no lamp reaches the side of a surface that this unit normal looks to: quick.
    bool may_reach(glm::vec3 geometric_normal) const
    {
        return any_ && (!only_direction_ || glm::dot(geometric_normal, *only_direction_) > 0.0f);
    }

private:
    /// Punctual lamps, component by component, so that looking at all of them vectorises.
    struct PunctualEstimates {
        std::vector<float> luminance, x, y, z;                      // position [m], or the direction to a sun
        std::vector<float> axis_x, axis_y, axis_z;                  // unit, the way a spot points
        std::vector<float> inverse_range, cos_outer, inverse_cone;  // 0, -2, 1: no limit
        std::vector<float> is_sun;                                  // 1 or 0
    };
    /// Emissive triangles by their bounding spheres.
    struct TriangleEstimates {
        std::vector<float> power, x, y, z, radius;
        std::vector<float> normal_x, normal_y, normal_z;
        std::vector<float> area, two_sided;  // two_sided: 1 or 0
    };

    void add(const PunctualLamp& lamp);
    void add(const EmissiveTriangle& triangle);
    void estimate_all(const SurfacePoint& point, float* estimates) const;
    float estimate_punctual(std::size_t i, glm::vec3 p, glm::vec3 n) const;
    float estimate_triangle(std::size_t i, glm::vec3 p, glm::vec3 n) const;
    float estimate(std::uint32_t lamp, const SurfacePoint& point) const;
    Sample sample_peaks(const SurfacePoint& point, RandomStream& random) const;
    Sample sample_lamp(std::uint32_t lamp, const SurfacePoint& point, RandomStream& random) const;
    Sample sample_triangle(const EmissiveTriangle& triangle, const SurfacePoint& point, RandomStream& random) const;

    Lights lights_;
    PunctualEstimates punctual_;
    TriangleEstimates triangles_;
    LampCandidates candidates_;
    bool any_;
    std::optional<glm::vec3> only_direction_;  // to the one lamp there is, if it is a sun
};

}  // namespace rcs
