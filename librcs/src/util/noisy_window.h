#pragma once

#include <algorithm>
#include <cmath>

#include <glm/glm.hpp>

#include "util/color.h"

namespace rcs {

/// Light of places beside each other, each with noise of its own that is known: how much of a place's difference to
/// their mean is not likely to be noise. The local linear minimum mean square error filter (Lee 1980).
class NoisyWindow {
public:
    /// @param error  standard one of its luminance
    void add(glm::vec3 light, float error)
    {
        const float l = luminance(light);
        sum_ += light;
        luminance_ += l, squares_ += l * l, noise_ += error * error;
        count_ += 1.0f;
    }
    float count() const { return count_; }
    glm::vec3 sum() const { return sum_; }

    /// What a place keeps of its own, the rest being the mean's, in [0, 1]. @param most_noise  of the noise's variance:
    /// what a window makes of it by chance may be more
    float own_part(float most_noise) const
    {
        const float mean = luminance_ / count_, variance = squares_ / count_ - mean * mean;
        const float of_noise = most_noise * noise_ / count_;
        return variance > of_noise ? 1.0f - of_noise / variance : 0.0f;
    }

private:
    glm::vec3 sum_{0.0f};
    float luminance_ = 0.0f, squares_ = 0.0f, noise_ = 0.0f, count_ = 0.0f;
};

/// Of a place's standard error, what is left. @param independent  places whose noise is not each other's
inline float part_of_error(float own, float independent)
{
    return std::sqrt(own * own + (1.0f - own * own) / std::max(1.0f, independent));
}

}  // namespace rcs
