#include "report/sweep_run.h"

#include <algorithm>
#include <chrono>
#include <functional>
#include <iterator>
#include <optional>
#include <thread>

#include "output/stats_json.h"
#include "process/process.h"
#include "rcs/error.h"
#include "rcs/metrics.h"
#include "rcs/tone_map.h"
#include "report/converged.h"
#include "report/encoding.h"
#include "report/keys.h"
#include "report/paths.h"
#include "report/pictures.h"

namespace rcs::service {
namespace {

/// What every point is measured with.
struct Bench {
    Session& session;
    const View& view;
    const SweepPlan& plan;
    const LogFunction& log;
    const ProgressFunction& progress;
};

/// What every point is held against.
struct Standard {
    LayeredImage reference;
    std::string key;               ///< of reference, library and machine
    ToneMapper picture, indirect;  ///< all points are shown with the exposures of the reference
};

ProgressFunction within(const ProgressFunction& progress, const std::string& part)
{
    return [&progress, part](std::string_view stage, float fraction) {
        return progress(part + " " + std::string(stage), fraction);
    };
}

ToneMapper shown_as(const Image& layer)
{
    ToneMapOptions options;
    options.exposure = automatic_exposure(layer);
    return ToneMapper(options);
}

Standard make_standard(const Bench& bench, const ConvergedReference& reference, const std::string& reference_key)
{
    Standard standard{reference.image,
                      {},
                      shown_as(reference.image.layers.at("beauty")),
                      shown_as(reference.image.layers.at("indirect"))};
    Fingerprint print;
    print.add(reference_key);
    print.add(reference.paths);
    print.add(machine_key(bench.session.pool().size(), bench.session.gl().renderer()));
    print.add(standard.picture.config_name());
    print.add(standard.picture.display());
    print.add(standard.picture.view());
    standard.key = print.text();
    return standard;
}

/// Compares with the reference, and makes the pictures that every method has.
void judge(const Bench& bench, const Standard& standard, const LayeredImage& image, Measurement& point)
{
    point.indirect = compare_images(image, standard.reference, "indirect");
    point.beauty = compare_images(image, standard.reference, "beauty");
    const Image picture = standard.picture.apply(image.layers.at("beauty"), bench.session.pool());
    point.pictures.picture = jpeg_bytes(picture);
    point.pictures.indirect = jpeg_bytes(standard.indirect.apply(image.layers.at("indirect"), bench.session.pool()));
    point.pictures.difference =
        jpeg_bytes(difference_picture(relative_difference(image, standard.reference, "indirect")));
}

/// @param processor  time that others took [s]
double others_share(double processor, double seconds)
{
    const double all = seconds * std::max(1u, std::thread::hardware_concurrency());
    return all > 0.0 ? std::clamp(processor / all, 0.0, 1.0) : 0.0;
}

Measurement measure_render(const Bench& bench, const Standard& standard, const SweepPoint& point,
                           const std::string& part)
{
    bench.session.forget_light();  // each point pays for all of it
    const auto begin = std::chrono::steady_clock::now();
    const ProcessorTime processor = processor_time();
    RenderResult result = render(bench.session, bench.view.camera, point.options,
                                 {.log = bench.log, .progress = within(bench.progress, part)});
    Measurement measured;
    measured.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    const ProcessorTime after = processor_time();
    measured.processor_seconds = after.own - processor.own;
    measured.others = others_share(after.others - processor.others, measured.seconds);
    measured.label = point.label;
    measured.stage_seconds = result.stats.stage_seconds;
    measured.records = result.stats.records.records;
    measured.rays = all_rays(result.stats);
    measured.estimated_error = result.stats.errors.indirect.mean_relative;
    judge(bench, standard, result.image, measured);
    const Image display = standard.picture.apply(result.image.layers.at("beauty"), bench.session.pool());
    measured.pictures.records = jpeg_bytes(records_picture(display, bench.view, result.records));
    return measured;
}

/// A first render also waits for shaders to be built and memory to be had: the coarsest is made once without measuring.
void warm_up(const Bench& bench)
{
    render(bench.session, bench.view.camera, bench.plan.points.front().options,
           {.progress = within(bench.progress, "warm-up")});
}

std::vector<Measurement> measure_renders(const Bench& bench, const Standard& standard)
{
    std::vector<Measurement> measured;
    bool warm = false;
    for (const SweepPoint& point : bench.plan.points) {
        Fingerprint print;
        print.add(standard.key);
        print.add(point.label);
        add(print, point.options);
        const std::string folder = bench.plan.cache + "/point-" + print.text();
        std::optional<Measurement> kept = load_measurement(folder);
        if (!kept) {
            if (!warm) warm_up(bench);
            warm = true;
            const std::string part =
                std::to_string(measured.size() + 1) + "/" + std::to_string(bench.plan.points.size());
            kept = measure_render(bench, standard, point, part);
            save(folder, *kept);
        }
        measured.push_back(std::move(*kept));
    }
    return measured;
}

std::vector<Measurement> measure_paths(const Bench& bench, const Standard& standard)
{
    ReferenceOptions options = bench.plan.reference;
    options.seed = bench.plan.path_seed;
    Fingerprint sums;  // their time counts, so they belong to this machine
    sums.add(paths_key(bench.session.rays().scene(), bench.view, options));
    sums.add(machine_key(bench.session.pool().size(), {}));
    const std::string key = sums.text();
    GrowingPaths paths(bench.plan.cache + "/paths-" + key + ".exr", key, bench.view, options);
    std::vector<Measurement> measured;
    for (const int samples : bench.plan.path_samples) {
        Fingerprint print;
        print.add(standard.key);
        print.add(key);
        print.add(samples);
        const std::string folder = bench.plan.cache + "/point-" + print.text();
        std::optional<Measurement> kept = load_measurement(folder);
        if (!kept) {
            if (paths.samples() > samples) paths.clear();
            while (paths.samples() < samples)
                paths.add_round(bench.session.rays(), bench.session.pool(),
                                within(bench.progress, std::to_string(samples) + " paths"));
            kept.emplace();
            kept->label = std::to_string(samples) + " paths a pixel";
            kept->paths = samples;
            kept->seconds = paths.seconds();
            kept->processor_seconds = paths.processor_seconds();
            kept->stage_seconds = {{"path tracing", paths.seconds()}};
            judge(bench, standard, paths.image(), *kept);
            save(folder, *kept);
        }
        measured.push_back(std::move(*kept));
    }
    return measured;
}

bool has_light(const Image& layer)
{
    return std::any_of(layer.pixels.begin(), layer.pixels.end(), [](float v) { return v > 0.0f; });
}

}  // namespace

AccuracyReport run_sweep(Session& session, const View& view, const SweepPlan& plan, const LogFunction& log,
                         const ProgressFunction& progress)
{
    const Bench bench{session, view, plan, log, progress};
    const RayScene& rays = session.rays();
    ThreadPool& pool = session.pool();
    const std::string key = paths_key(rays.scene(), view, plan.reference);
    const ConvergedReference reference =
        converge(rays, view, plan.reference, {plan.cache, key}, plan.reference_error, pool, log, progress);
    if (!has_light(reference.image.layers.at("indirect")))
        throw Error(ErrorCode::bad_argument, "no indirect light reaches this view: there is no error to measure");
    const Standard standard = make_standard(bench, reference, key);

    AccuracyReport report;
    report.points = measure_renders(bench, standard);
    std::vector<Measurement> traced = measure_paths(bench, standard);
    std::move(traced.begin(), traced.end(), std::back_inserter(report.points));

    const auto& layers = standard.reference.layers;
    report.reference = {reference.paths,
                        reference.seconds,
                        reference.error,
                        plan.reference_error,
                        jpeg_bytes(standard.picture.apply(layers.at("beauty"), pool)),
                        jpeg_bytes(standard.indirect.apply(layers.at("indirect"), pool))};
    report.width = view.width;
    report.height = view.height;
    report.bounces = plan.reference.bounces;
    report.aa = plan.reference.aa;
    report.threads = pool.size();
    report.gl_renderer = session.gl().renderer();
    report.processor = processor_name();
    return report;
}

}  // namespace rcs::service
