#pragma once

#include <cstdint>
#include <vector>

namespace rcs {

class LampFinder;

/// Lamps with area whose light records gather by the way, as they gather that of the sky: huge ones of which little is
/// seen, such as a panel behind windows. Shadow rays of pixels leave their diffuse light to them.
struct GatheredLamps {
    std::vector<std::uint8_t> of_instance;  ///< per instance of the ray scene: 1 if it is such a lamp; empty: none is
    std::uint32_t id = 0;                   ///< differs between sets, 0 if there are none
    bool by_direction = false;              ///< records know their light by direction: wide lobes are left to those
    bool along_lobes = false;               ///< rays along the lobes of visible points find it: narrow ones likewise

    const LampFinder* finder = nullptr;  ///< of their light where rays end; null: as that of other lamps

    bool any() const { return id != 0; }
    bool has(std::uint32_t instance) const { return id != 0 && of_instance[instance] != 0; }
};

}  // namespace rcs
