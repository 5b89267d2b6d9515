#include "records/known_record.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "util/color.h"

namespace rcs {

bool is_born(const Record& record) { return record.watch.geometric_normal != glm::vec3(0.0f); }

float gradient_reach(const Record& r)
{
    const glm::vec3 gradient =
        0.2126f * r.translation_gradient[0] + 0.7152f * r.translation_gradient[1] + 0.0722f * r.translation_gradient[2];
    const float steepness = glm::length(gradient);
    return steepness > 0.0f ? luminance(r.irradiance) / steepness : std::numeric_limits<float>::infinity();
}

void add_gather(Record& record, const Record& more)
{
    const float share = static_cast<float>(more.rays) / static_cast<float>(record.rays + more.rays);
    const float before = record.noise * luminance(record.irradiance);
    record.irradiance = glm::mix(record.irradiance, more.irradiance, share);
    record.of_lamps = glm::mix(record.of_lamps, more.of_lamps, share);
    for (std::size_t color = 0; color < 3; ++color) {
        record.rotation_gradient[color] =
            glm::mix(record.rotation_gradient[color], more.rotation_gradient[color], share);
        record.translation_gradient[color] =
            glm::mix(record.translation_gradient[color], more.translation_gradient[color], share);
    }
    const auto mix = [&](std::vector<float>& values, const std::vector<float>& other) {
        for (std::size_t k = 0; k < values.size(); ++k) values[k] = glm::mix(values[k], other[k], share);
    };
    mix(record.radiance, more.radiance);
    mix(record.radiance_of_lamps, more.radiance_of_lamps);
    const float error = std::hypot((1.0f - share) * before, share * more.noise * luminance(more.irradiance));
    const float e = luminance(record.irradiance);
    record.noise = e > 0.0f ? std::min(1.0f, error / e) : 0.0f;
    record.rays += more.rays;
}

}  // namespace rcs
