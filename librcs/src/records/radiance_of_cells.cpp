#include <algorithm>
#include <cstddef>
#include <numbers>
#include <vector>

#include "records/gatherer.h"

namespace rcs {

/// Cells have equal weights under the cosine: pi over their number.
std::vector<float> Gatherer::radiance(const GatherSize& size, GatherWorkspace& w) const
{
    const int cells = size.cells();
    w.radiance.clear();
    for (int first = 0; first < cells; first += RayPacket::kWidth) {
        // Lanes past the last cell, and rays below the surface, bring nothing.
        float colors[3][RayPacket::kWidth] = {};
        bool any = false;
        for (int i = 0; i < std::min(RayPacket::kWidth, cells - first); ++i) {
            const std::size_t c = static_cast<std::size_t>(first + i);
            const float scale = w.aimed.scale_of(c);
            colors[0][i] = scale * w.samples.red[c];
            colors[1][i] = scale * w.samples.green[c];
            colors[2][i] = scale * w.samples.blue[c];
            any = any || colors[0][i] != 0.0f || colors[1][i] != 0.0f || colors[2][i] != 0.0f;
        }
        if (any)
            w.radiance.add(w.packets[static_cast<std::size_t>(first / RayPacket::kWidth)].ray, colors[0], colors[1],
                           colors[2]);
    }
    const float weight = std::numbers::pi_v<float> / static_cast<float>(size.grid.cells);
    add_looks(1.0f / weight, w);
    return w.radiance.coefficients(weight);
}

std::vector<float> Gatherer::radiance_of_lamps(const GatherSize& size, GatherWorkspace& w) const
{
    const float weight = std::numbers::pi_v<float> / static_cast<float>(size.grid.cells);
    w.radiance.clear();
    for (std::size_t k = 0; k < w.lamp_hits.size();) {
        const std::size_t packet = w.lamp_hits[k].cell / RayPacket::kWidth;
        float colors[3][RayPacket::kWidth] = {};
        for (; k < w.lamp_hits.size() && w.lamp_hits[k].cell / RayPacket::kWidth == packet; ++k)
            for (int color = 0; color < 3; ++color)
                colors[color][w.lamp_hits[k].cell % RayPacket::kWidth] =
                    w.aimed.scale_of(w.lamp_hits[k].cell) * w.lamp_hits[k].radiance[color];
        w.radiance.add(w.packets[packet].ray, colors[0], colors[1], colors[2]);
    }
    return w.radiance.coefficients(weight);
}

}  // namespace rcs
