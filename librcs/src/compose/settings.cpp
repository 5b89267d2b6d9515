#include "compose/settings.h"

#include <algorithm>

namespace rcs {

QualitySettings& settings_of(RenderOptions& options)
{
    if (has_goal(options)) options.quality = QualitySettings{};
    return std::get<QualitySettings>(options.quality);
}

QualitySettings settings_or_default(const RenderOptions& options)
{
    const QualitySettings* told = std::get_if<QualitySettings>(&options.quality);
    return told ? *told : QualitySettings{};
}

double target_error(const RenderOptions& options)
{
    const TargetError* target = std::get_if<TargetError>(&options.quality);
    return target ? target->error : 0.0;
}

double budget_seconds(const RenderOptions& options)
{
    const Budget* budget = std::get_if<Budget>(&options.quality);
    return budget ? budget->seconds : 0.0;
}

RecordSettings record_settings(const RenderOptions& o)
{
    const QualitySettings quality = settings_or_default(o);
    return {.error_tolerance = quality.error_tolerance,
            .rays = quality.rays,
            .noise_target = quality.noise_target,
            .min_reach = o.min_reach,
            .max_reach = o.max_reach,
            .gradient_limit = o.gradient_limit,
            .bounces = o.bounces,
            .seed = o.seed};
}

DirectSettings direct_settings(const RenderOptions& o)
{
    return {.area_samples = o.area_samples,
            .penumbra_samples = std::max(o.penumbra_samples, o.area_samples),
            .lamp_picks = o.lamp_picks,
            .seed = o.seed};
}

}  // namespace rcs
