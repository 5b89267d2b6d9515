#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "util/random.h"

namespace rcs {

/// One ray along a pixel's lobe, and what came back.
struct LobeRay {
    glm::vec3 target{0.0f};  ///< where it hit, relative to the camera; or its direction if it hit nothing
    float distance = 0.0f;   ///< [m]; +inf: nothing
    float density = 0.0f;    ///< [1/sr]; 0: no ray
    glm::vec3 radiance{0.0f};
};
static_assert(sizeof(LobeRay) == 32);

/// The rays of the rows being worked on, in a ring: a band, and the rows around it that its pixels may share with.
class RayRing {
public:
    static constexpr int kMostReach = 12;  // of a neighbour [px]
    static constexpr int kBand = 64;       // rows that are shared at a time
    static constexpr int kKeptRows = kBand + 2 * kMostReach;

    /// @param of_lamps  whether rays also find gathered lamps
    RayRing(int width, int rays, bool of_lamps)
        : width_(static_cast<std::size_t>(width)),
          rays_(static_cast<std::size_t>(rays)),
          ring_(width_ * kKeptRows * rays_),
          of_lamps_(of_lamps ? ring_.size() : 0)
    {
    }
    std::size_t count() const { return rays_; }
    LobeRay* of(std::size_t pixel) { return ring_.data() + place(pixel); }
    const LobeRay* of(std::size_t pixel) const { return ring_.data() + place(pixel); }
    bool finds_lamps() const { return !of_lamps_.empty(); }
    /// Radiance of gathered lamps that a ray found beside its other; only where they are looked for.
    glm::vec3& of_lamps(const LobeRay& ray) { return of_lamps_[static_cast<std::size_t>(&ray - ring_.data())]; }
    glm::vec3 of_lamps(const LobeRay& ray) const { return of_lamps_[static_cast<std::size_t>(&ray - ring_.data())]; }

private:
    std::size_t place(std::size_t pixel) const
    {
        return (pixel / width_ % kKeptRows * width_ + pixel % width_) * rays_;
    }
    std::size_t width_, rays_;
    std::vector<LobeRay> ring_;
    std::vector<glm::vec3> of_lamps_;
};

/// Of all random numbers of a pixel's lobe. @param pixel  its number in the whole picture
inline std::uint64_t lobe_key(std::uint64_t seed, std::uint64_t pixel)
{
    return stream_key(seed, Stream::glossy, pixel);
}

}  // namespace rcs
