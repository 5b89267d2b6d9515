#include "wire/options.h"

#include <cmath>
#include <string>

#include "rcs/error.h"

namespace rcs::service {
namespace {

[[noreturn]] void refuse(const std::string& what) { throw Error(ErrorCode::bad_argument, what); }

/// The fields of a struct by name: this no longer compiles once a field is added, and its place on the wire is to be
/// decided.
template <typename Use>
void visit(const RecordOptions& o, const Use& use)
{
    const auto& [error_tolerance, rays, noise_target, min_reach, max_reach, gradient_limit, radiance, bounces, seed,
                 effects] = o;
    use(error_tolerance, rays, noise_target, min_reach, max_reach, gradient_limit);
    static_cast<void>(radiance), static_cast<void>(bounces), static_cast<void>(seed), static_cast<void>(effects);
}

v1::RecordOptions to_message(const RecordOptions& o)
{
    v1::RecordOptions m;
    visit(o, [&](float error_tolerance, int rays, float noise_target, float min_reach, float max_reach,
                 float gradient_limit) {
        m.set_error_tolerance(error_tolerance);
        m.set_rays(rays);
        m.set_noise_target(noise_target);
        m.set_min_reach(min_reach);
        m.set_max_reach(max_reach);
        m.set_gradient_limit(gradient_limit);
    });
    return m;
}

RecordOptions from_message(const v1::RecordOptions& m)
{
    RecordOptions o;
    if (m.has_error_tolerance()) o.error_tolerance = m.error_tolerance();
    if (m.has_rays()) o.rays = m.rays();
    if (m.has_noise_target()) o.noise_target = m.noise_target();
    if (m.has_min_reach()) o.min_reach = m.min_reach();
    if (m.has_max_reach()) o.max_reach = m.max_reach();
    if (m.has_gradient_limit()) o.gradient_limit = m.gradient_limit();
    return o;
}

v1::DirectOptions to_message(const DirectOptions& o)
{
    const auto& [area_samples, penumbra_samples, lamp_picks, seed, effects] = o;
    static_cast<void>(seed), static_cast<void>(effects);
    v1::DirectOptions m;
    m.set_area_samples(area_samples);
    m.set_penumbra_samples(penumbra_samples);
    m.set_lamp_picks(lamp_picks);
    return m;
}

DirectOptions from_message(const v1::DirectOptions& m)
{
    DirectOptions o;
    if (m.has_area_samples()) o.area_samples = m.area_samples();
    if (m.has_penumbra_samples()) o.penumbra_samples = m.penumbra_samples();
    if (m.has_lamp_picks()) o.lamp_picks = m.lamp_picks();
    return o;
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
    const auto& [width, height, aa, bounces, records, direct, lobe_rays, overlap, splat, target_error, budget_seconds,
                 dry_run, effects, layers, auto_exposure, seed] = o;
    static_cast<void>(dry_run), static_cast<void>(layers), static_cast<void>(auto_exposure);
    v1::RenderOptions m;
    m.set_width(width);
    m.set_height(height);
    m.set_aa(aa);
    m.set_bounces(bounces);
    *m.mutable_records() = to_message(records);
    *m.mutable_direct() = to_message(direct);
    m.set_lobe_rays(lobe_rays);
    m.set_overlap(overlap);
    m.set_splat(to_wire(splat));
    m.set_target_error(target_error);
    m.set_budget_seconds(budget_seconds);
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
    o.records = from_message(m.records());
    o.direct = from_message(m.direct());
    if (m.has_lobe_rays()) o.lobe_rays = m.lobe_rays();
    if (m.has_overlap()) o.overlap = m.overlap();
    if (m.has_splat()) o.splat = from_wire(m.splat());
    if (m.has_target_error()) o.target_error = m.target_error();
    if (m.has_budget_seconds()) o.budget_seconds = m.budget_seconds();
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
