#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <vector>

#include "rcs/records.h"

namespace rcs::test {

/// Bit by bit; the gap in front of the radiance does not count.
inline bool same_bits(const Record& a, const Record& b)
{
    return std::memcmp(&a, &b, offsetof(Record, breadth) + sizeof(float)) == 0 && a.radiance == b.radiance;
}
inline bool same_bits(const std::vector<Record>& a, const std::vector<Record>& b)
{
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](const Record& x, const Record& y) { return same_bits(x, y); });
}

}  // namespace rcs::test
