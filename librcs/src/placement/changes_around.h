#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "rcs/records.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// What has changed at a record, as the records around it see it, too.
struct ChangeAround {
    bool large = false;    ///< no mere correction: the record is to be gathered again, and the mean need not be set
    float change = 0.0f;   ///< root mean square of what the nearest others saw, over the light there
    float error = 0.0f;    ///< standard error of what one of those saw, over the light there
    glm::vec3 mean{0.0f};  ///< of what all around saw, this record among them, but where others say large [W m^-2]
    float noise = 0.0f;    ///< standard error of that mean, on luminance [W m^-2]
    std::vector<float> radiance{};  ///< the mean of that by direction, where the record holds it: Record::radiance

    bool any() const { return large || change > 0.0f || mean != glm::vec3(0.0f); }
};

/// Light that few rays find is missed by most records and seen too large by the rest. So what becomes of a record is
/// judged by what others saw: by its own word, those that saw too much would be gathered again and those that missed
/// it would stay, and all around would lag behind light that grows. Only what it saw beyond doubt counts as well, and
/// where there are hardly any others its word is all there is. And a record takes on what all around saw: changes are
/// smooth where they are small, and the mean of many is less noisy.
/// @param which  numbers of the records that were looked at   @param changes  what each of those saw: irradiance, noise
/// @return one for each of them
std::vector<ChangeAround> changes_around(std::span<const Record> records, std::span<const std::uint32_t> which,
                                         std::span<const Record> changes, float error_tolerance, ThreadPool& pool);

}  // namespace rcs
