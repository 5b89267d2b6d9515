#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
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

/// Light that both rays and looks may bring: of it rays bring D / (D + bound), looks the rest, with D pi times the part
/// of a lobe's light that comes from that direction, per solid angle.
struct LitPart {
    glm::vec3 radiance{0.0f};
    float bound = 0.0f;  ///< from where the ray or look starts [1/sr]
};

/// Soft light that a ray's first hit reflects, and how: narrow lobes of neighbours that hit near by share it.
struct SoftLight {
    glm::vec3 radiance{0.0f};
    glm::vec3 albedo{0.0f};  ///< 0: there is none
    glm::vec3 normal{0.0f};  ///< of the hit's face
};

/// The rays of the rows being worked on, in a ring: a band, and the rows around it that its pixels may share with. Each
/// pixel has rays along its lobe, and looks at lit points (LobeLooks).
class RayRing {
public:
    static constexpr int kMostReach = 12;  // of a neighbour [px]
    static constexpr int kBand = 64;       // rows that are shared at a time
    static constexpr int kKeptRows = kBand + 2 * kMostReach;

    struct Size {
        int width;    ///< of the picture [px]
        int columns;  ///< that are kept at a time; as many as the width, unless single pixels are looked at
        int rays, looks;
        bool of_lamps = false;  ///< rays also find gathered lamps
        bool soft = false;      ///< soft light is kept apart
    };
    explicit RayRing(const Size& size)
        : width_(static_cast<std::size_t>(size.width)),
          columns_(static_cast<std::size_t>(std::min(size.columns, size.width))),
          rays_(static_cast<std::size_t>(size.rays)),
          looks_(static_cast<std::size_t>(size.looks)),
          ring_(columns_ * kKeptRows * (rays_ + looks_)),
          lit_(looks_ > 0 ? ring_.size() : 0),
          of_lamps_(size.of_lamps ? ring_.size() : 0),
          soft_(size.soft ? ring_.size() : 0)
    {
    }
    /// Columns that a pixel and its neighbours take.
    static constexpr int kColumnsOfOne = 2 * kMostReach + 1;

    std::size_t count() const { return rays_; }
    std::span<LobeRay> of(std::size_t pixel) { return {ring_.data() + place(pixel), rays_}; }
    std::span<const LobeRay> of(std::size_t pixel) const { return {ring_.data() + place(pixel), rays_}; }
    std::span<LobeRay> looks_of(std::size_t pixel) { return {ring_.data() + place(pixel) + rays_, looks_}; }
    std::span<const LobeRay> looks_of(std::size_t pixel) const { return {ring_.data() + place(pixel) + rays_, looks_}; }
    /// What a ray or look brings that the other kind may bring as well; only where there are looks.
    LitPart& lit(const LobeRay& ray) { return lit_[static_cast<std::size_t>(&ray - ring_.data())]; }
    const LitPart& lit(const LobeRay& ray) const { return lit_[static_cast<std::size_t>(&ray - ring_.data())]; }
    bool has_looks() const { return looks_ > 0; }
    bool finds_lamps() const { return !of_lamps_.empty(); }
    /// Radiance of gathered lamps that a ray found beside its other; only where they are looked for.
    glm::vec3& of_lamps(const LobeRay& ray) { return of_lamps_[static_cast<std::size_t>(&ray - ring_.data())]; }
    glm::vec3 of_lamps(const LobeRay& ray) const { return of_lamps_[static_cast<std::size_t>(&ray - ring_.data())]; }
    bool has_soft() const { return !soft_.empty(); }
    SoftLight& soft(const LobeRay& ray) { return soft_[static_cast<std::size_t>(&ray - ring_.data())]; }
    const SoftLight& soft(const LobeRay& ray) const { return soft_[static_cast<std::size_t>(&ray - ring_.data())]; }

private:
    std::size_t place(std::size_t pixel) const
    {
        return (pixel / width_ % kKeptRows * columns_ + pixel % width_ % columns_) * (rays_ + looks_);
    }
    std::size_t width_, columns_, rays_, looks_;
    std::vector<LobeRay> ring_;
    std::vector<LitPart> lit_;
    std::vector<glm::vec3> of_lamps_;
    std::vector<SoftLight> soft_;
};

/// Of all random numbers of a pixel's lobe. @param pixel  its number in the whole picture
inline std::uint64_t lobe_key(std::uint64_t seed, std::uint64_t pixel)
{
    return stream_key(seed, Stream::glossy, pixel);
}

}  // namespace rcs
