#include "wire/options.h"

#include <cmath>
#include <string>

#include "rcs/error.h"

namespace rcs::service {
namespace {

[[noreturn]] void refuse(const std::string& what) { throw Error(ErrorCode::bad_argument, what); }

void read_quality(const v1::RenderOptions& m, RenderOptions& o)
{
    const v1::RecordOptions& records = m.records();
    const bool told = records.has_error_tolerance() || records.has_rays() || records.has_noise_target();
    if (told + m.has_target_error() + m.has_budget_seconds() > 1)
        refuse("of settings of records, target_error and budget_seconds only one can be given");
    if (m.has_target_error()) o.quality = TargetError{m.target_error()};
    if (m.has_budget_seconds()) o.quality = Budget{m.budget_seconds()};
    if (!told) return;
    QualitySettings& quality = settings_of(o);
    if (records.has_error_tolerance()) quality.error_tolerance = records.error_tolerance();
    if (records.has_rays()) quality.rays = records.rays();
    if (records.has_noise_target()) quality.noise_target = records.noise_target();
}

v1::SplatMethod to_wire(SplatMethod method)
{
    switch (method) {
        case SplatMethod::automatic:
            return v1::SPLAT_METHOD_AUTOMATIC;
        case SplatMethod::quads:
            return v1::SPLAT_METHOD_QUADS;
        case SplatMethod::tiles:
            return v1::SPLAT_METHOD_TILES;
    }
    return v1::SPLAT_METHOD_AUTOMATIC;
}

SplatMethod from_wire(v1::SplatMethod method)
{
    switch (method) {
        case v1::SPLAT_METHOD_AUTOMATIC:
            return SplatMethod::automatic;
        case v1::SPLAT_METHOD_QUADS:
            return SplatMethod::quads;
        case v1::SPLAT_METHOD_TILES:
            return SplatMethod::tiles;
        default:
            refuse("splat is " + std::to_string(method) + ", expected a value in [0, 2]");
    }
}

v1::PixelFormat to_wire(PixelFormat format)
{
    switch (format) {
        case PixelFormat::automatic:
            return v1::PIXEL_FORMAT_AUTOMATIC;
        case PixelFormat::half_float:
            return v1::PIXEL_FORMAT_HALF;
        case PixelFormat::full_float:
            return v1::PIXEL_FORMAT_FLOAT;
        case PixelFormat::uint8:
            return v1::PIXEL_FORMAT_UINT8;
        case PixelFormat::uint16:
            return v1::PIXEL_FORMAT_UINT16;
    }
    return v1::PIXEL_FORMAT_AUTOMATIC;
}

PixelFormat from_wire(v1::PixelFormat format)
{
    switch (format) {
        case v1::PIXEL_FORMAT_AUTOMATIC:
            return PixelFormat::automatic;
        case v1::PIXEL_FORMAT_HALF:
            return PixelFormat::half_float;
        case v1::PIXEL_FORMAT_FLOAT:
            return PixelFormat::full_float;
        case v1::PIXEL_FORMAT_UINT8:
            return PixelFormat::uint8;
        case v1::PIXEL_FORMAT_UINT16:
            return PixelFormat::uint16;
        default:
            refuse("pixel_format is " + std::to_string(format) + ", expected a value in [0, 4]");
    }
}

template <typename Names>
void add_names(const EffectSet& effects, Names& names)
{
    for (std::size_t i = 0; i < kEffects; ++i) {
        const auto effect = static_cast<Effect>(i);
        if (effects.has(effect)) names.Add(std::string(name_of(effect)));
    }
}

template <typename Names>
EffectSet read_names(const Names& names)
{
    EffectSet effects;
    for (const std::string& name : names) effects.set(find_effect(name));
    return effects;
}

}  // namespace

v1::RenderOptions to_message(const RenderOptions& o)
{
    const auto& [width, height, aa, bounces, quality, min_reach, max_reach, gradient_limit, area_samples,
                 penumbra_samples, lamp_picks, lobe_rays, overlap, splat, effects, layers, motion, dry_run, seed] = o;
    static_cast<void>(layers), static_cast<void>(motion), static_cast<void>(dry_run);
    v1::RenderOptions m;
    m.set_width(width);
    m.set_height(height);
    m.set_aa(aa);
    m.set_bounces(bounces);
    v1::RecordOptions& records = *m.mutable_records();
    if (const auto* told = std::get_if<QualitySettings>(&quality)) {
        records.set_error_tolerance(told->error_tolerance);
        records.set_rays(told->rays);
        records.set_noise_target(told->noise_target);
    }
    if (const auto* target = std::get_if<TargetError>(&quality)) m.set_target_error(target->error);
    if (const auto* budget = std::get_if<Budget>(&quality)) m.set_budget_seconds(budget->seconds);
    records.set_min_reach(min_reach);
    records.set_max_reach(max_reach);
    records.set_gradient_limit(gradient_limit);
    v1::DirectOptions& direct = *m.mutable_direct();
    direct.set_area_samples(area_samples);
    direct.set_penumbra_samples(penumbra_samples);
    direct.set_lamp_picks(lamp_picks);
    m.set_lobe_rays(lobe_rays);
    m.set_overlap(overlap);
    m.set_splat(to_wire(splat));
    add_names(effects.with, *m.mutable_with_effects());
    add_names(effects.without, *m.mutable_without_effects());
    m.set_seed(seed);
    return m;
}

RenderOptions from_message(const v1::RenderOptions& m)
{
    RenderOptions o;
    if (m.has_width()) o.width = m.width();
    if (m.has_height()) o.height = m.height();
    if (m.has_aa()) o.aa = m.aa();
    if (m.has_bounces()) o.bounces = m.bounces();
    read_quality(m, o);
    if (m.records().has_min_reach()) o.min_reach = m.records().min_reach();
    if (m.records().has_max_reach()) o.max_reach = m.records().max_reach();
    if (m.records().has_gradient_limit()) o.gradient_limit = m.records().gradient_limit();
    if (m.direct().has_area_samples()) o.area_samples = m.direct().area_samples();
    if (m.direct().has_penumbra_samples()) o.penumbra_samples = m.direct().penumbra_samples();
    if (m.direct().has_lamp_picks()) o.lamp_picks = m.direct().lamp_picks();
    if (m.has_lobe_rays()) o.lobe_rays = m.lobe_rays();
    if (m.has_overlap()) o.overlap = m.overlap();
    if (m.has_splat()) o.splat = from_wire(m.splat());
    o.effects.with = read_names(m.with_effects());
    o.effects.without = read_names(m.without_effects());
    if (m.has_seed()) o.seed = m.seed();
    validate(o);
    return o;
}

v1::ToneMap to_message(const ToneMapOptions& o)
{
    const auto& [ocio_config, display, view, exposure] = o;
    static_cast<void>(ocio_config);
    v1::ToneMap m;
    if (exposure) m.set_exposure(*exposure);
    m.set_display(display);
    m.set_view(view);
    return m;
}

ToneMapOptions from_message(const v1::ToneMap& m)
{
    ToneMapOptions o;
    if (m.has_exposure()) {
        if (!(std::abs(m.exposure()) <= 64.0f))
            refuse("exposure is " + std::to_string(m.exposure()) + ", expected a value in [-64, 64]");
        o.exposure = m.exposure();
    }
    o.display = m.display();
    o.view = m.view();
    return o;
}

v1::Output to_message(const OutputFile& file)
{
    const auto& [format, jpeg_quality, layers] = file.options;
    v1::Output m;
    m.set_name(file.path);
    m.set_pixel_format(to_wire(format));
    m.set_jpeg_quality(jpeg_quality);
    for (const std::string& layer : layers) m.add_layers(layer);
    return m;
}

OutputFile from_message(const v1::Output& m)
{
    OutputFile file{m.name(), {}};
    file.options.format = from_wire(m.pixel_format());
    if (m.has_jpeg_quality()) file.options.jpeg_quality = m.jpeg_quality();
    file.options.layers.assign(m.layers().begin(), m.layers().end());
    return file;
}

}  // namespace rcs::service
