#include <algorithm>
#include <utility>

#include "placement/view_fit.h"
#include "render/frame.h"

namespace rcs {
namespace {

// Behind so many transparent surfaces nothing more is looked for.
constexpr int kMostLayers = 16;
// ... nor where less than this part of the light comes through: half a code of an 8-bit picture.
constexpr float kLeastWeight = 1.0f / 512.0f;

/// Takes the weights on through the surfaces just shaded. @return whether anything behind them matters
bool weigh_behind(const Shading& shading, std::vector<glm::vec3>& weight)
{
    if (shading.through.empty()) return false;
    if (weight.empty()) weight.assign(shading.through.size(), glm::vec3(1.0f));
    bool any = false;
    for (std::size_t i = 0; i < weight.size(); ++i) {
        weight[i] *= shading.through[i];
        if (std::max({weight[i].r, weight[i].g, weight[i].b}) < kLeastWeight)
            weight[i] = glm::vec3(0.0f);
        else
            any = true;
    }
    return any;
}

}  // namespace

void bring_back(Frame& f)
{
    for (; !f.elsewhere.empty(); f.elsewhere.pop_back()) put_between(std::move(f.elsewhere.back()), f.records);
}

bool look_behind(Frame& f)
{
    if (!weigh_behind(f.shading, f.weight) || ++f.layer == kMostLayers) {
        bring_back(f);
        return false;
    }
    f.light = {};
    timed(f, "gbuffer", [&] {
        peel_gbuffer(f.rays, f.view(), f.settings.texture_scale, f.session.pool(), f.weight, f.gbuffer, f.shading);
    });
    ++f.stats().counts.peeled_layers;
    // The layers behind show in no other pixels than this one.
    f.elsewhere.push_back(
        timed(f, "records", [&] { return take_elsewhere(f.gbuffer, f.view(), f.session.pool(), f.records); }));
    return true;
}

}  // namespace rcs
