#include "rcs/render_options.h"

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
    if (const auto* picture = std::get_if<TargetError>(&options.quality)) return picture->error;
    const auto* indirect = std::get_if<TargetIndirectError>(&options.quality);
    return indirect ? indirect->error : 0.0;
}

double budget_seconds(const RenderOptions& options)
{
    const Budget* budget = std::get_if<Budget>(&options.quality);
    return budget ? budget->seconds : 0.0;
}

}  // namespace rcs
