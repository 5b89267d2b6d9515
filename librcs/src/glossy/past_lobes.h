#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "gbuffer/past_view.h"
#include "glossy/traced_lobes.h"

namespace rcs {

/// What an earlier view lets the lobes of this one be spared: most rays of those pixels whose light it knows. A lobe
/// shows the same where the viewer hardly turned about the point, over its width; else a plane shows the same where the
/// image behind it shows that both views see in it.
class PastLobes {
public:
    /// @param options  what is past of them; null: nothing is known
    PastLobes(const LobeSettings& options, const GBuffer& gbuffer, const View& view, const Shading& shading,
              ThreadPool& pool);

    /// How many times fewer rays a pixel takes: 1, 2 or 4.
    int fewer(std::size_t pixel) const { return known_.empty() ? 1 : known_[pixel].fewer; }
    /// Adds what is known to what the pixels' rays found.
    void add_to(TracedLight& light) const;

private:
    struct Known {
        PastPlace place = {};
        std::uint8_t fewer = 1;
    };
    struct Seen;

    Known find(const Seen& seen, std::size_t pixel) const;
    PastPlace image_of(const Seen& seen, std::size_t pixel) const;
    bool shows_image(const Seen& seen, std::size_t pixel, glm::vec3 point, glm::vec3 image, std::size_t before) const;
    int views_at(const PastPlace& place, std::optional<std::size_t> pixel) const;

    const PastTraced* past_;
    int most_fewer_;
    std::vector<Known> known_;
};

}  // namespace rcs
