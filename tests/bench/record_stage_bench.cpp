/// How much of the record stage is ray tracing: places the records of a view, then shoots the very same ray
/// packets in a loop that does nothing else, with 1 and 2 threads, in one run.
///
///     record_stage_bench SCENE [CAMERA] [SIZE]
///
/// The packets are caught on their way from the library to Embree: this program defines the packet
/// functions itself, notes what passes through, and calls the library's.

#include <dlfcn.h>
#include <algorithm>
#include <atomic>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <vector>

#include "rays/packet.h"
#include "rcs/rcs.h"

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

struct Caught {
    rcs::RayPacket rays;
    std::uint32_t active;
    bool shadow;
};

std::atomic<bool> catching{false};
std::atomic<long long> tracing_nanoseconds{0};
std::atomic<bool> timing{false};

/// What one thread caught, in order; kept for the whole run.
std::vector<std::unique_ptr<std::vector<Caught>>>& all_caught()
{
    static std::vector<std::unique_ptr<std::vector<Caught>>> lists;
    return lists;
}
std::vector<Caught>& my_caught()
{
    static std::atomic_flag lock;
    thread_local std::vector<Caught>* mine = nullptr;
    if (!mine) {
        while (lock.test_and_set()) {
        }
        all_caught().push_back(std::make_unique<std::vector<Caught>>());
        mine = all_caught().back().get();
        lock.clear();
    }
    return *mine;
}

template <typename Function>
Function* library_function(const char* mangled)
{
    auto* function = reinterpret_cast<Function*>(dlsym(RTLD_NEXT, mangled));
    if (!function) {
        std::fprintf(stderr, "record_stage_bench: librcs has no %s\n", mangled);
        std::exit(1);
    }
    return function;
}

using IntersectFunction = void(const rcs::RayScene&, std::uint32_t, rcs::HitPacket&);
using WeighedFunction = void(const rcs::RayScene&, std::uint32_t, rcs::HitPacket&, rcs::LaneWeights&);
using OccludedFunction = void(const rcs::RayScene&, std::uint32_t, rcs::RayPacket&);

IntersectFunction* library_intersect()
{
    static auto* function = library_function<IntersectFunction>("_ZN3rcs9intersectERKNS_8RaySceneEjRNS_9HitPacketE");
    return function;
}
WeighedFunction* library_weighed()
{
    static auto* function =
        library_function<WeighedFunction>("_ZN3rcs9intersectERKNS_8RaySceneEjRNS_9HitPacketERNS_11LaneWeightsE");
    return function;
}
OccludedFunction* library_occluded()
{
    static auto* function = library_function<OccludedFunction>("_ZN3rcs8occludedERKNS_8RaySceneEjRNS_9RayPacketE");
    return function;
}

template <typename Work>
void timed(const Work& work)
{
    if (!timing.load(std::memory_order_relaxed)) return work();
    const Clock::time_point start = Clock::now();
    work();
    tracing_nanoseconds += std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now() - start).count();
}

}  // namespace

namespace rcs {

void intersect(const RayScene& rays, std::uint32_t active, HitPacket& packet)
{
    if (catching.load(std::memory_order_relaxed)) my_caught().push_back({packet.ray, active, false});
    timed([&] { library_intersect()(rays, active, packet); });
}

void intersect(const RayScene& rays, std::uint32_t active, HitPacket& packet, LaneWeights& weights)
{
    if (catching.load(std::memory_order_relaxed)) my_caught().push_back({packet.ray, active, false});
    timed([&] { library_weighed()(rays, active, packet, weights); });
}

void occluded(const RayScene& rays, std::uint32_t active, RayPacket& packet)
{
    if (catching.load(std::memory_order_relaxed)) my_caught().push_back({packet, active, true});
    timed([&] { library_occluded()(rays, active, packet); });
}

}  // namespace rcs

namespace {

/// Shoots everything caught and does nothing else.
double bare_loop(const rcs::RayScene& rays, const std::vector<Caught>& caught, rcs::ThreadPool& pool)
{
    const Clock::time_point start = Clock::now();
    pool.parallel_for(caught.size(), 256, [&](std::size_t begin, std::size_t end, int) {
        rcs::HitPacket packet{};
        for (std::size_t i = begin; i < end; ++i) {
            packet.ray = caught[i].rays;
            if (caught[i].shadow)
                library_occluded()(rays, caught[i].active, packet.ray);
            else
                library_intersect()(rays, caught[i].active, packet);
        }
    });
    return seconds_since(start);
}

double record_stage(const rcs::RayScene& rays, const rcs::GBuffer& gbuffer, const rcs::View& view,
                    rcs::ThreadPool& pool, rcs::RecordStats& stats)
{
    std::vector<rcs::Record> records;
    const Clock::time_point start = Clock::now();
    rcs::RecordSettings options;
    options.radiance = true;  // as for every glTF file: its surfaces have specular lobes
    rcs::place_records(rays, gbuffer, view, options, pool, records, stats);
    return seconds_since(start);
}

double median(std::vector<double> values)
{
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

/// What one round measured with a number of threads.
struct Samples {
    std::vector<double> stage, bare, share, inside;
};

void measure(const rcs::RayScene& rays, const rcs::GBuffer& gbuffer, const rcs::View& view, rcs::ThreadPool& pool,
             const std::vector<Caught>& caught, Samples& samples)
{
    rcs::RecordStats stats;
    samples.stage.push_back(record_stage(rays, gbuffer, view, pool, stats));
    samples.bare.push_back(bare_loop(rays, caught, pool));
    samples.share.push_back(samples.bare.back() / samples.stage.back());
    timing = true;
    tracing_nanoseconds = 0;
    const double timed_stage = record_stage(rays, gbuffer, view, pool, stats);
    timing = false;
    samples.inside.push_back(1e-9 * static_cast<double>(tracing_nanoseconds) / pool.size() / timed_stage);
}

}  // namespace

int main(int argc, char** argv)
try {
    if (argc < 2) {
        std::fprintf(stderr, "usage: record_stage_bench SCENE [CAMERA] [SIZE]\n");
        return 2;
    }
    const int size = argc > 3 ? std::atoi(argv[3]) : 1000;
    const rcs::Scene scene = rcs::load_scene(argv[1]);
    const rcs::View view{rcs::find_camera(scene, argc > 2 ? argv[2] : ""), size, size, {0.5, 0.5}};
    rcs::ThreadPool two(2), one(1);
    const rcs::RayScene rays = rcs::build_ray_scene(scene, two);
    rcs::GlContext gl;
    const rcs::GBuffer gbuffer = rcs::render_gbuffer(gl, rays, view, 1.0f, two);

    rcs::RecordStats stats;
    catching = true;
    record_stage(rays, gbuffer, view, one, stats);
    catching = false;
    std::vector<Caught> caught;
    for (const auto& list : all_caught()) caught.insert(caught.end(), list->begin(), list->end());
    all_caught().clear();
    const double million_rays = static_cast<double>(stats.hemisphere_rays + stats.shadow_rays) * 1e-6;
    double caught_rays = 0.0;
    for (const Caught& c : caught) caught_rays += std::popcount(c.active);
    std::printf("%s: %llu records, %.1f M rays in %zu packets\n", argv[1],
                static_cast<unsigned long long>(stats.records), million_rays, caught.size());
    if (std::abs(caught_rays * 1e-6 - million_rays) > 0.01 * million_rays) {
        std::fprintf(stderr, "record_stage_bench: caught %.1f M rays only: a way to Embree is not watched\n",
                     caught_rays * 1e-6);
        return 1;
    }

    // Stage and bare loop in turn, so that a slow moment of the machine meets both.
    constexpr int kRounds = 3;
    Samples samples[2];
    for (int round = 0; round < kRounds; ++round) {
        measure(rays, gbuffer, view, one, caught, samples[0]);
        measure(rays, gbuffer, view, two, caught, samples[1]);
    }
    for (int i = 0; i < 2; ++i)
        std::printf(
            "%d thread%s: record stage %.2f s, %.2f M rays/s; bare loop %.2f s, %.2f M rays/s; "
            "stage reaches %.0f %% of the bare rate; %.0f %% of its wall time inside Embree\n",
            i + 1, i == 0 ? "" : "s", median(samples[i].stage), million_rays / median(samples[i].stage),
            median(samples[i].bare), million_rays / median(samples[i].bare), 100.0 * median(samples[i].share),
            100.0 * median(samples[i].inside));
    std::printf("1 -> 2 threads: record stage x %.2f, bare loop x %.2f (medians of %d rounds)\n",
                median(samples[0].stage) / median(samples[1].stage), median(samples[0].bare) / median(samples[1].bare),
                kRounds);
    return 0;
} catch (const std::exception& e) {
    std::fprintf(stderr, "record_stage_bench: %s\n", e.what());
    return 1;
}
