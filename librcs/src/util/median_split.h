#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include <glm/glm.hpp>

namespace rcs {

/// Orders the items from `begin` to before `end` so that those of the first half lie lower, along the longest side of
/// the box, than the others. @param place  of an item   @return where the second half begins
template <typename Item, typename Place>
std::size_t split_at_median(std::vector<Item>& items, std::size_t begin, std::size_t end, glm::vec3 box,
                            const Place& place)
{
    const int axis = box.x >= box.y && box.x >= box.z ? 0 : box.y >= box.z ? 1 : 2;
    const std::size_t middle = (begin + end) / 2;
    const auto at = [&](std::size_t k) { return items.begin() + static_cast<std::ptrdiff_t>(k); };
    std::nth_element(at(begin), at(middle), at(end),
                     [&](const Item& a, const Item& b) { return place(a)[axis] < place(b)[axis]; });
    return middle;
}

}  // namespace rcs
