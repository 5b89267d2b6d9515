#include <algorithm>
#include <string_view>
#include <utility>

#include "rcs/render.h"

namespace rcs {
namespace {

// Each with as many paths as the others: as many as render() shows with 64 passes.
constexpr int kMoments = 64;
// render_reference() rounds up to so many.
constexpr int kPathsAtOnce = 16;

}  // namespace

LayeredImage render_reference(Session& session, const MomentFunction& moments, View view,
                              const ReferenceOptions& options, const std::function<Lens(const Camera&)>& lens,
                              const ProgressFunction& progress)
{
    ReferenceOptions own = options;
    const int blocks = (options.samples + kPathsAtOnce - 1) / kPathsAtOnce, count = std::min(blocks, kMoments);
    LayeredImage sum;
    for (int m = 0; m < count; ++m) {
        Moment moment = moments((m + 0.5) / count);
        if (moment.scene) session.show(std::move(*moment.scene));
        view.camera = std::move(moment.camera);
        if (lens) own.lens = lens(view.camera);
        // Each goes on with the paths where the one before ends.
        own.first_sample = options.first_sample + kPathsAtOnce * (blocks * m / count);
        own.samples = options.first_sample + kPathsAtOnce * (blocks * (m + 1) / count) - own.first_sample;
        const auto part_done = [&](std::string_view stage, float part) {
            return !progress || progress(stage, (static_cast<float>(m) + part) / static_cast<float>(count));
        };
        merge_references(sum, render_reference(session.rays(EffectChoice{}), view, own, session.pool(), part_done));
    }
    return sum;
}

}  // namespace rcs
