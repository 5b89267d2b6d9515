#include "splat/splat_choice.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <iterator>
#include <vector>

#include "device/kept_speeds.h"
#include "gbuffer/views.h"
#include "rcs/error.h"
#include "rcs/gbuffer.h"
#include "rcs/machine.h"
#include "rcs/option_table.h"
#include "rcs/ray_scene.h"
#include "rcs/splat.h"
#include "scene/demo_scenes.h"

namespace rcs {
namespace {

// Each way is tried so often, and the best counts: others may be at work on the machine.
constexpr int kSplatTries = 3;
// A way that comes later here has to be that much faster than one before it: what a moment tells is not sure.
constexpr double kClearlyFaster = 1.2;
constexpr SplatMethod kWays[] = {SplatMethod::quads, SplatMethod::gpu_tiles, SplatMethod::tiles};

constexpr int kProbeSide = 512;   // [px]
constexpr int kRecordsApart = 8;  // records [px], about as placement leaves them

/// What is splatted: a view of a built-in scene, with records all over it.
struct SplatProbe {
    View view;
    GBuffer gbuffer;
    std::vector<Record> records;
};

SplatProbe make_probe(GlContext& gl, ThreadPool& pool)
{
    const Scene scene = make_demo_scene("demo:atrium");
    const RayScene rays = build_ray_scene(scene, pool);
    SplatProbe probe;
    probe.view = make_views(scene.cameras.front(), kProbeSide, kProbeSide, 1).front();
    probe.gbuffer = render_gbuffer(gl, rays, probe.view, 1.0f, pool);
    for (int y = kRecordsApart / 2; y < kProbeSide; y += kRecordsApart)
        for (int x = kRecordsApart / 2; x < kProbeSide; x += kRecordsApart) {
            const auto pixel = static_cast<std::size_t>(y * kProbeSide + x);
            if (!probe.gbuffer.covered(pixel)) continue;
            Record record;
            record.position = probe.gbuffer.scene_position(pixel);
            record.normal = probe.gbuffer.normal(pixel);
            record.irradiance = glm::vec3(1.0f);
            record.spacing_radius = kRecordsApart * probe.gbuffer.footprint[pixel];
            probe.records.push_back(record);
        }
    return probe;
}

SplatBuffer splat_once(SplatMethod method, const SplatProbe& probe, GlContext& gl, ThreadPool& pool)
{
    SplatSettings settings;
    settings.overlap = RenderOptions{}.overlap;
    SplatStats stats;
    switch (method) {
        case SplatMethod::quads:
            return splat_quads(gl, probe.records, probe.gbuffer, probe.view, settings, pool, stats);
        case SplatMethod::gpu_tiles:
            return splat_gpu_tiles(gl, probe.records, probe.gbuffer, probe.view, settings, pool, stats);
        default:
            return splat_tiles(probe.records, probe.gbuffer, probe.view, settings, pool, stats);
    }
}

/// Splats of the probe a second, of each of kWays; next to nothing where it cannot be done.
std::vector<double> measure_ways(GlContext& gl, ThreadPool& pool)
{
    constexpr double kCannot = 1e-3;
    const SplatProbe probe = make_probe(gl, pool);
    std::vector<double> speeds;
    for (const SplatMethod method : kWays) {
        double best = kCannot;
        try {
            splat_once(method, probe, gl, pool);  // builds the programs
            for (int i = 0; i < kSplatTries; ++i) {
                const auto begin = std::chrono::steady_clock::now();
                splat_once(method, probe, gl, pool);
                const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
                best = std::max(best, 1.0 / took.count());
            }
        } catch (const Error&) {
            best = kCannot;
        }
        speeds.push_back(best);
    }
    return speeds;
}

}  // namespace

std::string name_of(SplatMethod method)
{
    return std::string(find_option("splat").choices[static_cast<std::size_t>(method)]);
}

std::string SplatChoice::words() const { return name_of(method) + ": " + why; }

SplatChoice choose_splat(GlContext& gl, ThreadPool& pool, bool ask)
{
    if (gl.software() && !ask)
        return {SplatMethod::tiles, gl.renderer() + " is software: the processor sums up faster by itself"};
    MeasuredSpeeds measured;
    try {
        measured = speeds_of("splat", gl, pool, std::size(kWays), [&] { return measure_ways(gl, pool); });
    } catch (const Error& why) {
        return {SplatMethod::tiles, why.what()};
    }
    std::size_t best = 0;
    for (std::size_t i = 1; i < std::size(kWays); ++i)
        if (measured.speeds[i] > kClearlyFaster * measured.speeds[best]) best = i;
    std::string why = gl.renderer();
    for (std::size_t i = 0; i < std::size(kWays); ++i) {
        char speed[32];
        std::snprintf(speed, sizeof speed, " %.1f", measured.speeds[i]);
        why.append(i == 0 ? ": " : ", ").append(name_of(kWays[i])).append(speed);
    }
    return {kWays[best], why + " splats of a small picture a second (" + measured.when() + ")"};
}

std::vector<MachineFact> describe_splat(GlContext& gl, ThreadPool& pool)
{
    return {{"--splat auto", choose_splat(gl, pool).words()}};
}

}  // namespace rcs
