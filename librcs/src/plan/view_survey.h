#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "rcs/camera.h"
#include "rcs/ray_scene.h"
#include "scene/mesh_traits.h"

namespace rcs {

/// What the camera may see of surfaces with a trait.
struct Sighting {
    enum class How {
        nowhere,    ///< no instance of the scene has it
        outside,    ///< those that have it lie outside the view
        hidden,     ///< none of the picture's samples meets it
        unsettled,  ///< the rays ran out before it was found or ruled out
        seen,       ///< a sample meets it
    };
    How how = How::nowhere;
    double share = 0.0, low = 0.0, high = 0.0;  ///< of the picture's samples, measured; 95 % confidence
    std::uint64_t samples = 0;                  ///< that were looked along for it

    bool possible() const { return how == How::seen || how == How::unsettled; }
};

/// How a sighting reads, with its number. @param what  "surface that reflects"
std::string words(const Sighting& sighting, const char* what);

struct Survey {
    std::array<Sighting, kTraits> of;  ///< by bit number of Trait
    double sky_share = 0.0;            ///< pilot rays that met nothing
    bool any_in_view = false;          ///< an instance's bounds reach into the view
    std::uint64_t rays = 0;

    const Sighting& operator[](Trait trait) const;
};

/// First the instances' bounds against the view; then a pilot of 1,024 samples spread over the picture says how much of
/// it has each trait; what it has not met although it may be there is looked for with the samples of all passes that
/// fall on its bounds, until one meets it, up to a number of rays that is small beside the picture's.
/// @param views  the picture's passes, at least one
Survey survey(const RayScene& rays, const std::vector<View>& views);

}  // namespace rcs
