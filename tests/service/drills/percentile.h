#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace rcs::test {

/// @param part  0.5: the median
inline double percentile(std::vector<double> values, double part)
{
    std::sort(values.begin(), values.end());
    return values[std::min(values.size() - 1, static_cast<std::size_t>(part * static_cast<double>(values.size())))];
}

}  // namespace rcs::test
