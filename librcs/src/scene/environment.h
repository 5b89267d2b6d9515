#pragma once

#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "rcs/scene.h"

namespace rcs {

/// The sky of a scene: its constant radiance and its image, split for light transport into a soft part that
/// rays may find by themselves and peaks that are sampled like a lamp. Directions are unit and point to the sky.
///
/// The split of a texel L with largest channel m at threshold c: soft L min(1, c / m), peak the rest. c is 8 times
/// the mean of the soft part itself (a fixed point), so however bright a sun is, it does not move c; where less than
/// an eighth of the sphere shines at all, c is 0 and all of it is peaks. A constant sky has none.
///
/// Sampling is exact for the bilinear image: a texel by its share, then a point under its tent. So with a texel's
/// weight w = luminance x sin(theta), the density is the bilinear interpolation of w, over sin(theta).
class Environment {
public:
    Environment() = default;
    /// Refers to the scene's image, which must outlive it.
    explicit Environment(const Scene& scene);

    bool is_black() const { return constant_ == glm::vec3(0.0f) && !has_image(); }
    bool has_image() const { return image_ != nullptr; }
    bool has_peaks() const { return peak_weight_ > 0.0; }
    float threshold() const { return threshold_; }

    glm::vec3 radiance(glm::vec3 direction) const;  ///< soft and peak together
    glm::vec3 soft(glm::vec3 direction) const;
    glm::vec3 peak(glm::vec3 direction) const;
    /// The soft part over about a degree: for rays that each stand for much more. Same energy.
    glm::vec3 soft_blurred(glm::vec3 direction) const;

    struct Sample {
        glm::vec3 direction{0.0f, 1.0f, 0.0f};
        glm::vec3 radiance{0.0f};
        float density = 0.0f;  ///< [1/sr]; 0: nothing to sample
    };
    /// Of the peaks alone. @param u  in [0, 1)^2; neighbouring numbers give neighbouring directions
    Sample sample_peak(glm::vec2 u) const;
    float peak_density(glm::vec3 direction) const;
    /// Of the whole sky, the constant part included: for multiple importance sampling.
    Sample sample(glm::vec2 u) const;
    float density(glm::vec3 direction) const;

    /// Luminance of the peaks, integrated over the sphere: irradiance on a plane that faces them all [W m^-2].
    float peak_flux() const { return peak_flux_; }
    float peak_solid_angle() const { return peak_solid_angle_; }  ///< that has peaks [sr]
    /// Upper bound, up to a factor of the mean cosine, of what the peaks send to a surface that faces `normal`; 0
    /// only where they send nothing.
    float peak_estimate(glm::vec3 normal) const;

private:
    struct Footprint;
    Footprint footprint(glm::vec2 uv, int width, int height) const;
    glm::vec2 uv_of(glm::vec3 direction) const;
    glm::vec3 direction_of(glm::vec2 uv) const;
    glm::vec3 soft_texel(std::size_t i) const;
    glm::vec3 peak_texel(std::size_t i) const;
    float peak_weight(std::size_t i, int row) const;
    void choose_threshold();
    void build_peaks();
    void build_soft();

    glm::vec3 constant_{0.0f};
    const EnvironmentImage* image_ = nullptr;
    float turn_ = 0.0f;  // rotation / 2 pi
    float threshold_ = 0.0f;
    std::vector<float> sine_;  // per row, at its centre

    // Texels with a peak, row by row, and the sum of weights up to and with each.
    std::vector<std::uint32_t> row_first_, column_;
    std::vector<double> peak_cdf_;
    double peak_weight_ = 0.0;
    float peak_flux_ = 0.0f, peak_solid_angle_ = 0.0f;
    glm::vec3 peak_axis_{0.0f, 1.0f, 0.0f};
    float peak_cone_ = 0.0f;  // all peaks lie within this angle of the axis [rad]

    // The soft part as a small image; and how it and the constant are sampled: by cells of that image.
    int soft_width_ = 0, soft_height_ = 0;
    std::vector<glm::vec3> soft_;
    std::vector<double> soft_cdf_;
    float peak_share_ = 0.0f;  // of samples of the whole that go to the peaks
};

/// Of no scene.
inline const Environment& black_environment()
{
    static const Environment black;
    return black;
}

}  // namespace rcs
