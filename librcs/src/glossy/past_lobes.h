#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "gbuffer/past_view.h"
#include "glossy/traced_lobes.h"
#include "scene/camera_rays.h"

namespace rcs {

/// What an earlier view lets the lobes of this one be spared: most rays of those pixels whose light it knows. A lobe
/// shows the same where the viewer hardly turned about the point, over its width; else a plane shows the same where the
/// image behind it shows that both views see in it.
class PastLobes {
public:
    /// @param options  what is past of them; null: nothing is known
    PastLobes(const LobeSettings& options, const GBuffer& gbuffer, const View& view, const Shading& shading,
              ThreadPool& pool);

    /// Of a pixel that would have `all`.
    std::size_t rays(std::size_t pixel, std::size_t all) const
    {
        return known_.empty() ? all : all / known_[pixel].fewer;
    }
    /// Whether it looks at lit points: of those whose light is known every other one, in turn with those beside it. Of
    /// fewer each would be brighter than neighbours and the view before can hide.
    bool looks(std::size_t pixel) const
    {
        if (known_.empty() || known_[pixel].fewer == 1) return true;
        const auto width = static_cast<std::size_t>(g_.width);
        return ((pixel % width + pixel / width + turn_) & 1u) == 0;
    }
    /// Adds what is known to what the pixels' rays found.
    void add_to(TracedLight& light) const;

private:
    struct Known {
        PastPlace place = {};
        std::uint8_t alike = 0;  ///< of the four pixels around it, bit by bit, those with lobes like this one's
        std::uint8_t fewer = 1;  ///< times: 1, 2 or 4
        bool is_image = false;
    };
    /// Of four pixels some, and their parts of the mean.
    struct Alike {
        std::array<std::size_t, 4> pixel{};
        std::array<float, 4> part{};  ///< 0: it is none of them
    };

    Known find(std::size_t pixel) const;
    Alike those(std::uint8_t which, const PastPlace& place) const;
    std::uint8_t alike_at(std::size_t pixel, const PastPlace& place) const;
    bool is_known(const Alike& alike, const PastPlace& place) const;
    template <typename Value>
    static auto mean(const Alike& alike, const Value& value);
    glm::vec3 mean_as(glm::vec3 reflectance, const std::vector<glm::vec3>& light, const Alike& alike) const;
    float part_of_lobes(const Alike& alike, const PastPlace& place) const;
    glm::dvec3 image_at(std::size_t pixel, float distance) const;
    PastPlace image_of(std::size_t pixel) const;
    struct Image {
        glm::vec3 at;           ///< relative to the earlier camera
        glm::vec3 reflectance;  ///< of the lobes that show it
    };
    bool shows_image(std::size_t pixel, const Image& image, std::size_t before) const;
    bool still_shows(std::size_t pixel, float distance) const;
    double blur_of(std::size_t pixel, double distance) const;

    const LobeSettings& options_;
    const PastTraced* past_;
    const GBuffer& g_;
    const View& view_;
    ImageProjection projection_;
    double pixel_;  // as ImagePlane has it
    const Shading& shading_;
    int most_fewer_;
    std::size_t turn_;
    std::vector<Known> known_;
};

}  // namespace rcs
