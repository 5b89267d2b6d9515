#include "render/frame.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <string>
#include <utility>

#include "denoise/denoise.h"
#include "gbuffer/checked_pixels.h"
#include "gbuffer/views.h"
#include "image/cut.h"
#include "plan/plan_words.h"
#include "rcs/effect_plan.h"
#include "rcs/option_table.h"
#include "rcs/version.h"
#include "render/moments.h"
#include "render/stage_clock.h"
#include "splat/splat_choice.h"

namespace rcs {
namespace {

/// Takes out the records without radiance, which are no use to glossy surfaces but to other views.
std::vector<Record> take_plain(std::vector<Record>& records)
{
    const auto plain =
        std::stable_partition(records.begin(), records.end(), [](const Record& r) { return !r.radiance.empty(); });
    std::vector<Record> taken(std::make_move_iterator(plain), std::make_move_iterator(records.end()));
    records.erase(plain, records.end());
    return taken;
}

// Beyond so many times the target a render says that it did not get there: the estimate itself scatters by as much.
constexpr double kNotReached = 1.05;

std::string percent(double part)
{
    char text[32];
    std::snprintf(text, sizeof text, "%.3g %%", 100.0 * part);
    return text;
}

/// The options as they were asked for, or as the plan and a goal made them.
void describe_options(const Frame& f, LayeredImage& image)
{
    RenderOptions options = f.asked;
    const auto list = [&] {
        for (const auto& [name, text] : list_options(options)) image.metadata["rcs:" + name] = text;
    };
    options.bounces = f.result.stats.plan.bounces;
    options.aa = f.course.passes;
    list();
    const RecordSettings& used = f.course.records;  // with a goal, as it left them
    options.quality = QualitySettings{.error_tolerance = used.error_tolerance,
                                      .rays = used.rays,
                                      .noise_target = used.noise_target,
                                      .refinement = used.refinement};
    list();
}

void describe(const Frame& f, LayeredImage& image)
{
    const auto number = [](auto value) { return std::to_string(value); };
    const RenderStats& stats = f.result.stats;
    image.metadata["rcs:effects"] = list_effects(stats.plan, true);
    image.metadata["rcs:effects-left-out"] = list_effects(stats.plan, false);
    image.metadata["rcs:version"] = kVersion;
    image.metadata["rcs:camera"] = f.camera.name;
    describe_options(f, image);
    image.metadata["rcs:splat"] = stats.splat_method;
    image.metadata["rcs:gather"] = stats.gather_method;
    const auto tell = [&](const std::string& prefix, const ErrorEstimate& error) {
        image.metadata[prefix + "-mean"] = number(error.mean_relative);
        image.metadata[prefix + "-median"] = number(error.median_relative);
        image.metadata[prefix + "-p95"] = number(error.p95_relative);
    };
    tell("rcs:image-error", stats.errors.image);
    tell("rcs:indirect-error", stats.errors.indirect);
    const DenoiseStats& denoised = stats.denoised;
    if (!denoised.library.empty()) {
        image.metadata["rcs:denoised-by"] = denoised.library + " (" + denoised.device + ")";
        tell("rcs:image-error-before-denoising", denoised.before.image);
        tell("rcs:indirect-error-before-denoising", denoised.before.indirect);
    }
    for (const DenoisedLight& light : denoised.lights)
        image.metadata["rcs:denoised-" + light.name] =
            light.is_exact ? "exact" : number(light.error_before) + " to " + number(light.error_after);
    image.metadata["rcs:renderer"] = stats.gl_renderer;
    image.metadata["rcs:records"] = number(f.records.size());
}

void warn(const Frame& f)
{
    if (!f.hooks.log) return;
    const double target = target_error(f.asked);
    std::string missed;
    const auto tell = [&](const std::string& of, const ErrorEstimate& reached) {
        if (target > 0.0 && reached.mean_relative > kNotReached * target)
            missed.append(missed.empty() ? "the error of " : ", that of ")
                .append(of + " is estimated as " + percent(reached.mean_relative));
    };
    if (aims_at_picture(f.asked)) tell("the picture", f.result.stats.errors.image);
    tell("indirect light", f.result.stats.errors.indirect);
    if (!missed.empty()) f.hooks.log(LogLevel::warning, missed + ", not the " + percent(target) + " wanted");
    if (const std::uint64_t unserved = f.result.stats.unserved_pixels; unserved > 0)
        f.hooks.log(LogLevel::warning, std::to_string(unserved) + " visible pixels are served by no record");
    const auto beauty = f.result.image.layers.find("beauty");
    if (beauty == f.result.image.layers.end()) return;
    const std::vector<float>& values = beauty->second.pixels;
    const auto lost = std::count_if(values.begin(), values.end(), [](float value) { return !std::isfinite(value); });
    if (lost > 0) f.hooks.log(LogLevel::warning, std::to_string(lost) + " values of the picture are not finite");
}

}  // namespace

void RenderStats::add(const std::string& stage, double seconds)
{
    const auto found = std::find_if(stage_seconds.begin(), stage_seconds.end(),
                                    [&](const auto& entry) { return entry.first == stage; });
    if (found == stage_seconds.end())
        stage_seconds.emplace_back(stage, seconds);
    else
        found->second += seconds;
}

Frame begin_frame(Session& session, const Camera& camera, const RenderOptions& asked, const RenderHooks& hooks)
{
    validate(asked);
    session.state().moves = false;
    const RayScene& rays = session.rays(asked.effects);
    session.state().use_device(asked.device);
    GlContext& gl = session.gl();
    auto oidn = asked.denoise == Denoiser::oidn ? std::make_unique<Oidn>(session.pool().size()) : nullptr;
    const EffectTally tally(gl, session.pool());
    RenderStats stats;
    stats.plan = timed(stats, hooks.progress, "plan", [&] { return plan_effects(rays, camera, asked); });
    tell(stats.plan, hooks.log);
    const Settings settings = make_settings(asked, stats.plan, rays.scene());
    stats.threads = session.pool().size();
    stats.gl_renderer = gl.renderer();
    stats.gl_version = gl.version();
    stats.gl_platform = gl.platform();
    const SplatMethod splat_method = session.state().graphics.choose_splat(gl, session.pool(), asked.splat, hooks.log);
    stats.splat_method = name_of(splat_method);
    session.state().prepare_caster(gl, asked.gather, hooks.log);
    Frame frame{.session = session,
                .rays = rays,
                .camera = camera,
                .asked = asked,
                .hooks = hooks,
                .settings = settings,
                .splat_method = splat_method,
                .moments = nullptr,
                .layers = picture_layers(stats.plan, rays.scene(), asked.motion, oidn != nullptr),
                .deadline = Deadline(asked.quality),
                .tally = tally,
                .course = begin_course(settings),
                .views = views_of(camera, asked, settings.passes),
                .oidn = std::move(oidn),
                .result = {{}, {}, std::move(stats)},
                .records = session.state().take_records(asked)};
    if (asked.f_stop && frame.layers->motion) frame.layers->motion->seen_by_pinhole(camera);
    if (settings.records.radiance) frame.without_radiance = take_plain(frame.records);
    return frame;
}

Frame begin_frame(Session& session, const MomentFunction& moments, const RenderOptions& asked, const RenderHooks& hooks)
{
    validate(asked);
    if (asked.aa < 2)
        throw Error(ErrorCode::bad_argument,
                    "aa is 1, expected at least 2 with motion blur: each sample is of another moment");
    if (asked.motion)
        throw Error(ErrorCode::bad_argument, "motion is given beside motion blur: its vectors are of one moment");
    Moment first = moments(part_of_shutter(asked, 0));
    session.state().moves = true;
    if (first.scene) session.show(std::move(*first.scene));
    Frame frame = begin_frame(session, first.camera, asked, hooks);
    session.state().moves = true;
    frame.moments = &moments;
    return frame;
}

void cut_to_crop(const Frame& f, LayeredImage& image)
{
    if (!f.asked.crop) return;
    const auto [x, y, width, height] = *f.asked.crop;
    const glm::ivec2 corner = f.views.front().corner;
    for (auto& [name, layer] : image.layers) layer = cut(layer, x - corner.x, y - corner.y, width, height);
    image.window = ImageWindow{x, y, f.asked.width, f.asked.height};
}

namespace {

/// @param estimate  of the picture's errors
template <typename Estimate>
void filter_picture(Frame& f, const Estimate& estimate)
{
    const ErrorEstimates before = estimate();
    timed(f.stats(), f.hooks.progress, "denoise", [&] {
        const View& view = f.views.front();
        const CheckedPixels checked(view.width, view.height, f.settings.seed);
        f.stats().denoised = denoise(*f.oidn, checked, f.result.image);
        f.stats().denoised.before = before;
    });
}

}  // namespace

void give_back(Frame& f)
{
    Session::State& session = f.session.state();
    if (session.moves || !session.records.empty()) return;
    bring_back(f);
    for (std::vector<Record>* part : {&f.aside, &f.without_radiance})
        f.records.insert(f.records.end(), std::make_move_iterator(part->begin()), std::make_move_iterator(part->end()));
    session.put_back(std::move(f.records), f.asked, f.views.front());
    if (f.kept_guide.guide && session.options.keep_records && !session.guide) session.guide = std::move(f.kept_guide);
}

void finish_picture(Frame& f)
{
    f.gbuffer = {}, f.shading = {}, f.weight = {}, f.light = {};
    RenderResult& result = f.result;
    RenderStats& stats = result.stats;
    timed(stats, f.hooks.progress, "compose", [&] { finish_passes(f.course.passes, result.image); });
    const auto estimate = [&] {
        if (!f.needs(Effect::error_estimate)) return ErrorEstimates{};
        return timed(stats, f.hooks.progress, "estimate",
                     [&] { return estimate_errors(result.image, f.error_scale, f.session.pool()); });
    };
    if (f.oidn) filter_picture(f, estimate);
    cut_to_crop(f, result.image);
    stats.errors = estimate();
    const RayCaster* const caster = f.session.state().graphics.caster.get();
    stats.gather_method = caster && caster->works() ? "gpu" : "cpu";
    keep_layers(*f.layers, result.image);
    f.tally.finish(f.session.gl(), f.session.pool(), f.records, result.image, stats.counts);
    describe(f, result.image);
    warn(f);
}

std::vector<Record> hand_over(Frame& f)
{
    const RecordStats& made = f.stats().records;
    if (f.needs(Effect::indirect_diffuse))
        f.session.state().keep_guide(std::move(f.kept_guide), made.records + made.renewed,
                                     f.records.size() - made.records - made.renewed);
    f.aside.insert(f.aside.end(), std::make_move_iterator(f.without_radiance.begin()),
                   std::make_move_iterator(f.without_radiance.end()));
    return f.session.state().keep_records(std::move(f.records), std::move(f.aside), f.asked, f.views.front());
}

RenderResult finish(Frame& f)
{
    finish_picture(f);
    f.result.records = hand_over(f);
    f.stats().kept = f.session.state().end_view();
    f.session.state().moves = false;
    return std::move(f.result);
}

}  // namespace rcs
