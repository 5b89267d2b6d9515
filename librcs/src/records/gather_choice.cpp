#include "records/gather_choice.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "device/kept_speeds.h"
#include "device/ray_caster.h"
#include "gbuffer/views.h"
#include "rcs/error.h"
#include "rcs/gbuffer.h"
#include "rcs/machine.h"
#include "rcs/ray_scene.h"
#include "rcs/records.h"
#include "scene/demo_scenes.h"

namespace rcs {
namespace {

constexpr int kProbeSide = 128;         // [px]
constexpr std::size_t kProbeApart = 8;  // pixels from one record to the next: a wave of two thousand
constexpr int kProbeTries = 3;          // of either, and the best counts: others may be at work on the machine
constexpr double kClearGain = 1.1;      // what a moment tells is not sure

/// Records a second, thousands.
struct Speeds {
    double processor = 0.0, device = 0.0;
};

/// Gathers at every so many pixels, as the record stage does: rays are but a part of what that takes.
class GatherProbe {
public:
    GatherProbe(GlContext& gl, ThreadPool& pool)
        : pool_(pool), scene_(make_demo_scene("demo:atrium")), rays_(build_ray_scene(scene_, pool))
    {
        const View view = make_views(scene_.cameras.front(), kProbeSide, kProbeSide, 1).front();
        gbuffer_ = render_gbuffer(gl, rays_, view, 1.0f, pool);
        for (std::size_t pixel = 0; pixel < gbuffer_.size(); pixel += kProbeApart)
            if (gbuffer_.covered(pixel)) pixels_.push_back(static_cast<std::uint32_t>(pixel));
    }

    const RayScene& rays() const { return rays_; }

    /// @param caster  null: the processor traces
    double thousands_a_second(RayCaster* caster) const
    {
        const LitScene lit(rays_, nullptr, nullptr, nullptr, caster);
        double best = 0.0;
        for (int i = 0; i < kProbeTries; ++i) {
            RecordStats stats;
            const auto begin = std::chrono::steady_clock::now();
            gather_records(lit, gbuffer_, pixels_, {}, pool_, stats);
            const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
            best = std::max(best, 1e-3 * static_cast<double>(pixels_.size()) / took.count());
        }
        return best;
    }

private:
    ThreadPool& pool_;
    Scene scene_;
    RayScene rays_;
    GBuffer gbuffer_;
    std::vector<std::uint32_t> pixels_;
};

Speeds measure(GlContext& gl, ThreadPool& pool)
{
    const GatherProbe probe(gl, pool);
    RayCaster caster(gl, probe.rays());
    const Speeds speeds{probe.thousands_a_second(nullptr), probe.thousands_a_second(&caster)};
    if (!caster.works()) throw Error(ErrorCode::gl_unavailable, "rays cannot be traced on " + gl.renderer());
    return speeds;
}

}  // namespace

GatherChoice choose_gather(GlContext& gl, ThreadPool& pool, bool ask)
{
    if (gl.software() && !ask) return {false, gl.renderer() + " is software: rays would take the processor anyway"};
    MeasuredSpeeds measured;
    try {
        measured = speeds_of("gathers", gl, pool, 2, [&] {
            const Speeds speeds = measure(gl, pool);
            return std::vector{speeds.processor, speeds.device};
        });
    } catch (const Error& why) {
        return {false, why.what()};
    }
    const Speeds speeds{measured.speeds[0], measured.speeds[1]};
    char numbers[128];
    std::snprintf(numbers, sizeof numbers, ": %.1f thousand records a second, the processor %.1f (%s)", speeds.device,
                  speeds.processor, measured.when());
    return {speeds.device > kClearGain * speeds.processor, gl.renderer() + numbers};
}

std::vector<MachineFact> describe_gather(GlContext& gl, ThreadPool& pool)
{
    std::vector<MachineFact> facts;
    const std::vector<std::string> devices = gl_devices();
    for (std::size_t i = 0; i < devices.size(); ++i) facts.emplace_back("--device " + std::to_string(i), devices[i]);
    facts.emplace_back("--gather auto", choose_gather(gl, pool).words());
    return facts;
}

}  // namespace rcs
