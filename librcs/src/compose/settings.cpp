#include "compose/settings.h"

#include <algorithm>
#include <string>

#include "rcs/error.h"

namespace rcs {
namespace {

void require(bool valid, const char* field, double value, const char* range)
{
    if (valid) return;
    std::string number = std::to_string(value);
    number.erase(std::min(number.find_last_not_of('0') + 1, number.size()));
    if (number.back() == '.') number.pop_back();
    throw Error(ErrorCode::bad_argument, std::string(field) + " is " + number + ", expected " + range);
}

}  // namespace

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
            .penumbra_samples = o.penumbra_samples,
            .lamp_picks = o.lamp_picks,
            .seed = o.seed};
}

void validate(const RenderOptions& o)
{
    require(o.width >= 1 && o.width <= 16384, "width", o.width, "a value in [1, 16384]");
    require(o.height >= 1 && o.height <= 16384, "height", o.height, "a value in [1, 16384]");
    require(o.aa >= 1 && o.aa <= 64, "aa", o.aa, "a value in [1, 64]");
    require(o.bounces >= 0 && o.bounces <= 64, "bounces", o.bounces, "a value in [0, 64]");
    require(o.lobe_rays >= 1 && o.lobe_rays <= 1024, "lobe_rays", o.lobe_rays, "a value in [1, 1024]");
    require(o.overlap >= 1.0f && o.overlap <= 16.0f, "overlap", o.overlap, "a value in [1, 16]");
    if (const TargetError* target = std::get_if<TargetError>(&o.quality))
        require(target->error > 0.0 && target->error <= 1.0, "target_error", target->error, "a value in (0, 1]");
    if (const Budget* budget = std::get_if<Budget>(&o.quality))
        require(budget->seconds > 0.0 && budget->seconds <= 1e6, "budget_seconds", budget->seconds,
                "a value in (0, 1e6]");
    validate(record_settings(o));
    validate(direct_settings(o));
}

}  // namespace rcs
