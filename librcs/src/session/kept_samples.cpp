#include "session/kept_samples.h"

#include <algorithm>

namespace rcs {

void follow_change(std::vector<KeptSamples>& samples, const SceneChange& change)
{
    // Of so many boxes one or the other is between any point and a lamp.
    constexpr std::size_t kMostMoved = 64;
    for (KeptSamples& kept : samples) {
        kept.traced = {};
        kept.with.scene_number = change.state;
        kept.moved.insert(kept.moved.end(), change.where.begin(), change.where.end());
    }
    const bool is_lost = std::any_of(samples.begin(), samples.end(), [](const KeptSamples& kept) {
        return kept.moved.size() > kMostMoved || kept.direct.irradiance.empty();
    });
    if (change.everywhere || is_lost) samples.clear();
}

}  // namespace rcs
