#include "plan/plan_layers.h"

#include <algorithm>

namespace rcs {

std::vector<PlannedLayer> plan_layers(const std::optional<std::vector<std::string>>& kept, const EffectSet& effects,
                                      double pixels)
{
    std::vector<const LayerKind*> named;
    for (const std::string& name : kept.value_or(std::vector<std::string>{})) named.push_back(&find_layer(name));
    std::vector<PlannedLayer> layers;
    for (const LayerKind& layer : all_layers()) {
        if (!layer.of_render) continue;
        PlannedLayer planned{&layer};
        const bool is_named = std::find(named.begin(), named.end(), &layer) != named.end();
        planned.kept = layer.name == "beauty" || (kept ? is_named : layer.by_default);
        planned.made = planned.kept || (layer.in_sum && layer.made_by.has_any(effects));
        if (planned.made) planned.bytes = pixels * layer.channel_count() * static_cast<double>(sizeof(float));
        layers.push_back(planned);
    }
    return layers;
}

}  // namespace rcs
