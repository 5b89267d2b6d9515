#include <algorithm>
#include <bit>
#include <cstddef>

#include "rays/embree.h"
#include "rays/packet.h"
#include "rays/ray_scene_impl.h"
#include "rays/transparency.h"
#include "util/counters.h"

namespace rcs {
namespace {

static_assert(offsetof(RayPacket, t_max) == offsetof(RTCRay16, tfar));
static_assert(sizeof(RayPacket) == sizeof(RTCRay16));
static_assert(offsetof(HitPacket, u) == offsetof(RTCRayHit16, hit.u));
static_assert(offsetof(HitPacket, instance_id) == offsetof(RTCRayHit16, hit.instID));
static_assert(sizeof(RTCRayHit16) <= sizeof(HitPacket));
static_assert(RayPacket::kMiss == RTC_INVALID_GEOMETRY_ID);

// The one place where Embree 3 and 4 differ: 3 takes a context, 4 takes arguments that point to one.
#if RTC_VERSION_MAJOR >= 4
using EmbreeContext = RTCRayQueryContext;
void init(EmbreeContext& context) { rtcInitRayQueryContext(&context); }
RTCIntersectArguments intersect_arguments(EmbreeContext* context)
{
    RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.context = context;
    return arguments;
}
RTCOccludedArguments occluded_arguments(EmbreeContext* context)
{
    RTCOccludedArguments arguments;
    rtcInitOccludedArguments(&arguments);
    arguments.context = context;
    return arguments;
}
#define RCS_RTC_INTERSECT(function, context, rayhit, ...)               \
    do {                                                                \
        RTCIntersectArguments arguments = intersect_arguments(context); \
        function(__VA_ARGS__, rayhit, &arguments);                      \
    } while (false)
#define RCS_RTC_OCCLUDED(function, context, ray, ...)                 \
    do {                                                              \
        RTCOccludedArguments arguments = occluded_arguments(context); \
        function(__VA_ARGS__, ray, &arguments);                       \
    } while (false)
#else
using EmbreeContext = RTCIntersectContext;
void init(EmbreeContext& context) { rtcInitIntersectContext(&context); }
#define RCS_RTC_INTERSECT(function, context, rayhit, ...) function(__VA_ARGS__, context, rayhit)
#define RCS_RTC_OCCLUDED(function, context, ray, ...) function(__VA_ARGS__, context, ray)
#endif

/// What a query hands to the filter below. Embree gives back the pointer to its first member.
struct Query {
    EmbreeContext context;
    Passage* passage = nullptr;

    explicit Query(Passage* p = nullptr) : passage(p) { init(context); }
};

}  // namespace

void filter_hits(const RTCFilterFunctionNArguments* arguments)
{
    Passage& passage = *reinterpret_cast<const Query*>(arguments->context)->passage;
    RTCRayN* ray = arguments->ray;
    RTCHitN* hit = arguments->hit;
    const unsigned n = arguments->N;
    std::uint64_t asked = 0;
    for (unsigned i = 0; i < n; ++i) {
        if (arguments->valid[i] != -1) continue;
        ++asked;
        const std::uint32_t instance = RTCHitN_instID(hit, n, i, 0);
        Meeting m;
        m.lane = RTCRayN_id(ray, n, i);
        m.is_instanced = instance != RTC_INVALID_GEOMETRY_ID;
        m.hit = {RTCRayN_tfar(ray, n, i), RTCHitN_u(hit, n, i), RTCHitN_v(hit, n, i),
                 m.is_instanced ? instance : RTCHitN_geomID(hit, n, i), RTCHitN_primID(hit, n, i)};
        m.origin = {RTCRayN_org_x(ray, n, i), RTCRayN_org_y(ray, n, i), RTCRayN_org_z(ray, n, i)};
        m.direction = {RTCRayN_dir_x(ray, n, i), RTCRayN_dir_y(ray, n, i), RTCRayN_dir_z(ray, n, i)};
        if (goes_on(passage, m)) arguments->valid[i] = 0;
    }
    tally(Count::alpha_tests, asked);
}

void reset(RayPacket& packet)
{
    for (int i = 0; i < RayPacket::kWidth; ++i) {
        packet.t_min[i] = 0.0f;
        packet.time[i] = 0.0f;
        packet.mask[i] = ~0u;
        packet.id[i] = static_cast<std::uint32_t>(i);
        packet.flags[i] = 0;
    }
}

namespace {

// So few rays take less time one by one than as lanes of a packet (measured: looks at what has changed, a third of it).
constexpr int kFewRays = 4;

/// @param id  what a filter knows it by
RTCRay to_embree(const Ray& ray, std::uint32_t id = 0)
{
    RTCRay r{};
    r.org_x = ray.origin.x;
    r.org_y = ray.origin.y;
    r.org_z = ray.origin.z;
    r.tnear = ray.t_min;
    r.dir_x = ray.direction.x;
    r.dir_y = ray.direction.y;
    r.dir_z = ray.direction.z;
    r.tfar = ray.t_max;
    r.mask = ~0u;
    r.id = id;
    return r;
}

/// Embree wants one int per lane, -1 where the ray is alive.
struct alignas(64) LaneMask {
    int lane[RayPacket::kWidth];
    explicit LaneMask(std::uint32_t active)
    {
        for (int i = 0; i < RayPacket::kWidth; ++i) lane[i] = (active >> i & 1u) != 0u ? -1 : 0;
    }
};

/// Lanes without a ray get one that is over at once: with 8 lanes at a time Embree 3.13 asserts that those are valid
/// too where none of the 8 is alive, and what they held may be anything.
void end_idle_lanes(std::uint32_t active, RayPacket& packet)
{
    constexpr std::uint32_t kAll = (1u << RayPacket::kWidth) - 1u;
    if (active == kAll) return;
    for (std::size_t i = 0; i < RayPacket::kWidth; ++i)
        if ((active >> i & 1u) == 0u) set_lane(packet, i, {glm::vec3(0.0f), glm::vec3(0.0f, 0.0f, 1.0f), 0.0f, 0.0f});
}

RTCRayHit to_embree_hit(const Ray& ray, std::uint32_t id = 0)
{
    RTCRayHit hit{};
    hit.ray = to_embree(ray, id);
    hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    hit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    return hit;
}

Ray ray_of(const RayPacket& packet, std::size_t lane)
{
    const int i = static_cast<int>(lane);
    return {ray_origin(packet, i), ray_direction(packet, i), 0.0f, packet.t_max[lane]};
}

void trace_lane(const RayScene& rays, std::size_t lane, HitPacket& packet, Query& query)
{
    RTCRayHit r = to_embree_hit(ray_of(packet.ray, lane), packet.ray.id[lane]);
    RCS_RTC_INTERSECT(rtcIntersect1, &query.context, &r, rays.impl().embree->top);
    packet.ray.t_max[lane] = r.ray.tfar;
    packet.normal_x[lane] = r.hit.Ng_x;
    packet.normal_y[lane] = r.hit.Ng_y;
    packet.normal_z[lane] = r.hit.Ng_z;
    packet.u[lane] = r.hit.u;
    packet.v[lane] = r.hit.v;
    packet.primitive[lane] = r.hit.primID;
    packet.geometry[lane] = r.hit.geomID;
    packet.instance_id[lane] = r.hit.instID[0];
}

void trace_lane(const RayScene& rays, std::size_t lane, RayPacket& packet, Query& query)
{
    RTCRay r = to_embree(ray_of(packet, lane), packet.id[lane]);
    RCS_RTC_OCCLUDED(rtcOccluded1, &query.context, &r, rays.impl().embree->top);
    packet.t_max[lane] = r.tfar;
}

void trace_all(const RayScene& rays, std::uint32_t active, HitPacket& packet, Query& query)
{
    const LaneMask valid(active);
    end_idle_lanes(active, packet.ray);
    RCS_RTC_INTERSECT(rtcIntersect16, &query.context, reinterpret_cast<RTCRayHit16*>(&packet), valid.lane,
                      rays.impl().embree->top);
}

void trace_all(const RayScene& rays, std::uint32_t active, RayPacket& packet, Query& query)
{
    const LaneMask valid(active);
    end_idle_lanes(active, packet);
    RCS_RTC_OCCLUDED(rtcOccluded16, &query.context, reinterpret_cast<RTCRay16*>(&packet), valid.lane,
                     rays.impl().embree->top);
}

void begin(RayPacket&) {}
void begin(HitPacket& packet)
{
    std::fill(packet.geometry, packet.geometry + RayPacket::kWidth, RayPacket::kMiss);
    std::fill(packet.instance_id, packet.instance_id + RayPacket::kWidth, RayPacket::kMiss);
}

template <typename Packet>
void trace(const RayScene& rays, std::uint32_t active, Packet& packet, Passage* passage)
{
    begin(packet);
    Query query(passage);
    if (std::popcount(active) > kFewRays) return trace_all(rays, active, packet, query);
    for (std::uint32_t left = active; left != 0; left &= left - 1)
        trace_lane(rays, static_cast<std::size_t>(std::countr_zero(left)), packet, query);
}

template <typename Packet>
void trace_by_chance(const RayScene& rays, std::uint32_t active, Packet& packet)
{
    if (!rays.has_transparency()) return trace(rays, active, packet, nullptr);
    Passage passage(rays, Passage::Rule::by_chance);
    trace(rays, active, packet, &passage);
}

}  // namespace

void intersect(const RayScene& rays, std::uint32_t active, HitPacket& packet) { trace_by_chance(rays, active, packet); }

void intersect(const RayScene& rays, std::uint32_t active, HitPacket& packet, LaneWeights& weights)
{
    std::fill(weights.weight, weights.weight + RayPacket::kWidth, glm::vec3(1.0f));
    if (!rays.has_transparency()) return trace(rays, active, packet, nullptr);
    Passage passage(rays, Passage::Rule::by_chance);
    trace(rays, active, packet, &passage);
    for (int i = 0; i < RayPacket::kWidth; ++i) {
        if ((active >> i & 1u) == 0u) continue;
        const RayPacket& r = packet.ray;
        const Hit hit{r.t_max[i], packet.u[i], packet.v[i], packet.instance(i), packet.primitive[i]};
        const bool is_hit = packet.geometry[i] != RayPacket::kMiss;
        weights.weight[i] = weight_of(passage, static_cast<std::uint32_t>(i), is_hit ? &hit : nullptr,
                                      {r.direction_x[i], r.direction_y[i], r.direction_z[i]});
    }
}

void occluded(const RayScene& rays, std::uint32_t active, RayPacket& packet) { trace_by_chance(rays, active, packet); }

void transmittance(const RayScene& rays, std::uint32_t active, RayPacket& packet, LaneWeights& transmitted)
{
    Passage passage(rays, Passage::Rule::weighted);
    trace(rays, active, packet, rays.has_transparency() ? &passage : nullptr);
    for (int i = 0; i < RayPacket::kWidth; ++i)
        if ((active >> i & 1u) != 0u)
            transmitted.weight[i] =
                packet.t_max[i] < 0.0f ? glm::vec3(0.0f) : product(passage, static_cast<std::uint32_t>(i));
}

std::optional<Hit> intersect(const RayScene& rays, const Ray& ray, RayFilter filter, glm::vec3* weight)
{
    Passage passage(rays, filter == RayFilter::everything ? Passage::Rule::everything : Passage::Rule::by_chance);
    Query query(&passage);
    RTCRayHit r = to_embree_hit(ray);
    RCS_RTC_INTERSECT(rtcIntersect1, &query.context, &r, rays.impl().embree->top);
    const bool is_hit = r.hit.geomID != RTC_INVALID_GEOMETRY_ID;
    const std::uint32_t instance = r.hit.instID[0] != RTC_INVALID_GEOMETRY_ID ? r.hit.instID[0] : r.hit.geomID;
    const Hit hit{r.ray.tfar, r.hit.u, r.hit.v, instance, r.hit.primID};
    if (weight)
        *weight = filter == RayFilter::everything ? glm::vec3(1.0f)
                                                  : weight_of(passage, 0, is_hit ? &hit : nullptr, ray.direction);
    return is_hit ? std::optional<Hit>(hit) : std::nullopt;
}

std::optional<Hit> intersect(const RayScene& rays, const Ray& ray)
{
    return intersect(rays, ray, RayFilter::by_chance);
}

bool occluded(const RayScene& rays, const Ray& ray)
{
    Passage passage(rays, Passage::Rule::by_chance);
    Query query(&passage);
    RTCRay r = to_embree(ray);
    RCS_RTC_OCCLUDED(rtcOccluded1, &query.context, &r, rays.impl().embree->top);
    return r.tfar < 0.0f;
}

glm::vec3 transmittance(const RayScene& rays, const Ray& ray)
{
    Passage passage(rays, Passage::Rule::weighted);
    Query query(&passage);
    RTCRay r = to_embree(ray);
    RCS_RTC_OCCLUDED(rtcOccluded1, &query.context, &r, rays.impl().embree->top);
    return r.tfar < 0.0f ? glm::vec3(0.0f) : product(passage, 0);
}

}  // namespace rcs
