#include "device/gather_choice.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <vector>

#include "device/kept_speeds.h"
#include "device/ray_caster.h"
#include "rays/ray_scene_impl.h"
#include "rays/surface.h"
#include "rcs/error.h"
#include "rcs/machine.h"
#include "scene/demo_scenes.h"
#include "util/basis.h"
#include "util/random.h"

namespace rcs {
namespace {

constexpr std::size_t kProbePackets = 1u << 14;  // of 16 rays
// Both are tried so often, and the best counts: others may be at work on the machine.
constexpr int kTries = 3;
// Waves are collected and sorted back by the processor, which it could spend on rays.
constexpr double kLeastGain = 1.2;

/// Rays per second, millions.
struct Speeds {
    double processor = 0.0, device = 0.0;
};

/// Rays from points on surfaces, a hemisphere's neighbours in a packet, as gathers shoot them.
std::vector<HitPacket> probe_packets(const RayScene& rays)
{
    std::vector<HitPacket> packets(kProbePackets);
    const RayScene::Impl& impl = rays.impl();
    RandomStream random(1);
    for (HitPacket& packet : packets) {
        reset(packet.ray);
        const auto pick = [&](std::size_t count) {
            return static_cast<std::uint32_t>(random.next() * static_cast<float>(count));
        };
        std::uint32_t instance = 0;
        do {
            instance = pick(impl.instances.size());
        } while (impl.instances[instance].mesh->triangles.empty());
        const SurfacePoint point = surface_at(rays, instance, pick(impl.instances[instance].mesh->triangles.size()),
                                              1.0f / 3.0f, 1.0f / 3.0f, glm::vec3(0.0f, -1.0f, 0.1f));
        const float turn = random.next();
        for (std::size_t lane = 0; lane < RayPacket::kWidth; ++lane)
            set_lane(packet.ray, lane,
                     ray_from(point,
                              cosine_direction(point.geometric_normal, {random.next(), turn + 0.25f * random.next()})));
    }
    return packets;
}

template <typename Work>
double rays_per_second(const std::vector<HitPacket>& packets, const Work& work)
{
    double best = 0.0;
    for (int i = 0; i < kTries; ++i) {
        std::vector<HitPacket> to_trace = packets;
        std::vector<LaneWeights> weights(to_trace.size());
        const auto begin = std::chrono::steady_clock::now();
        work(to_trace, weights);
        const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
        best = std::max(best, 1e-6 * static_cast<double>(RayPacket::kWidth * packets.size()) / seconds);
    }
    return best;
}

Speeds measure(GlContext& gl, ThreadPool& pool)
{
    constexpr std::uint32_t kAll = (1u << RayPacket::kWidth) - 1u;
    const Scene scene = make_demo_scene("demo:atrium");
    const RayScene rays(make_ray_scene(scene, pool, {}));
    const std::vector<HitPacket> packets = probe_packets(rays);
    RayCaster caster(gl, rays);
    Speeds speeds;
    speeds.processor = rays_per_second(packets, [&](std::vector<HitPacket>& p, std::vector<LaneWeights>& w) {
        pool.parallel_for(p.size(), 64, [&](std::size_t begin, std::size_t end, int) {
            for (std::size_t i = begin; i < end; ++i) intersect(rays, kAll, p[i], w[i]);
        });
    });
    speeds.device = rays_per_second(packets, [&](std::vector<HitPacket>& p, std::vector<LaneWeights>& w) {
        std::vector<AimedPacket> aimed;
        for (std::size_t i = 0; i < p.size(); ++i) aimed.push_back({&p[i], &w[i], kAll});
        caster.intersect(aimed, pool);
        if (!caster.works()) throw Error(ErrorCode::gl_unavailable, "rays cannot be traced on " + gl.renderer());
    });
    return speeds;
}

}  // namespace

GatherChoice choose_gather(GlContext& gl, ThreadPool& pool, bool ask)
{
    if (gl.software() && !ask) return {false, gl.renderer() + " is software: rays would take the processor anyway"};
    MeasuredSpeeds measured;
    try {
        measured = speeds_of("gather", gl, pool, 2, [&] {
            const Speeds speeds = measure(gl, pool);
            return std::vector{speeds.processor, speeds.device};
        });
    } catch (const Error& why) {
        return {false, why.what()};
    }
    const Speeds speeds{measured.speeds[0], measured.speeds[1]};
    char numbers[128];
    std::snprintf(numbers, sizeof numbers, ": %.1f million rays a second, the processor %.1f (%s)", speeds.device,
                  speeds.processor, measured.when());
    return {speeds.device > kLeastGain * speeds.processor, gl.renderer() + numbers};
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
