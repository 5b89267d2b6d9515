#include "device/ray_caster.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "device/device_scene.h"
#include "gl/gl_context_impl.h"
#include "gl/gl_objects.h"
#include "rays/ray_scene_impl.h"
#include "rcs/error.h"
#include "shared/bindings.h"
#include "shared/device_scene.h"

namespace rcs {
namespace {

constexpr std::size_t kWidth = RayPacket::kWidth;
constexpr std::size_t kMostRays = std::size_t{1} << 18;   // of a dispatch: some milliseconds
constexpr std::size_t kLeastRays = std::size_t{1} << 12;  // fewer are no use
constexpr std::size_t kPacketsAtATime = 64;
constexpr std::size_t kBytesPerRay = sizeof(DeviceRay) + sizeof(DeviceHit);

bool is_active(std::uint32_t active, std::size_t lane) { return (active >> lane & 1u) != 0u; }

void put_rays(const RayPacket& packet, std::uint32_t active, DeviceRay* to)
{
    for (std::size_t i = 0; i < kWidth; ++i) {
        const int lane = static_cast<int>(i);
        const float end = is_active(active, i) ? packet.t_max[i] : -1.0f;  // none
        to[i] = {ray_origin(packet, lane), end, ray_direction(packet, lane), 0.0f};
    }
}

/// The packet's active lanes as intersect() leaves them; the processor traces those that the device could not.
/// @return how many that were
std::uint64_t take_hits(const RayScene& rays, const AimedPacket& to, const DeviceHit* hits)
{
    HitPacket& p = *to.packet;
    std::uint32_t ask = 0;
    for (std::size_t i = 0; i < kWidth; ++i) {
        p.geometry[i] = p.instance_id[i] = RayPacket::kMiss;
        to.weights->weight[i] = glm::vec3(1.0f);
        if (!is_active(to.active, i) || hits[i].instance == RCS_DEVICE_MISS) continue;
        if (hits[i].instance == RCS_DEVICE_UNDECIDED) {
            ask |= 1u << i;
            continue;
        }
        const bool instanced = rays.impl().instances[hits[i].instance].instanced;
        p.ray.t_max[i] = hits[i].t;
        p.u[i] = hits[i].u;
        p.v[i] = hits[i].v;
        p.normal_x[i] = hits[i].normal.x;
        p.normal_y[i] = hits[i].normal.y;
        p.normal_z[i] = hits[i].normal.z;
        p.primitive[i] = hits[i].primitive;
        p.geometry[i] = instanced ? 0 : hits[i].instance;
        if (instanced) p.instance_id[i] = hits[i].instance;
    }
    if (ask == 0) return 0;
    HitPacket asked = p;
    LaneWeights weights;
    intersect(rays, ask, asked, weights);
    for (std::size_t i = 0; i < kWidth; ++i) {
        if (!is_active(ask, i)) continue;
        p.ray.t_max[i] = asked.ray.t_max[i];
        p.u[i] = asked.u[i];
        p.v[i] = asked.v[i];
        p.normal_x[i] = asked.normal_x[i];
        p.normal_y[i] = asked.normal_y[i];
        p.normal_z[i] = asked.normal_z[i];
        p.primitive[i] = asked.primitive[i];
        p.geometry[i] = asked.geometry[i];
        p.instance_id[i] = asked.instance_id[i];
        to.weights->weight[i] = weights.weight[i];
    }
    return static_cast<std::uint64_t>(std::popcount(ask));
}

/// A packet of shadow rays.
struct ShadowPacket {
    ShadowBatch* batch;
    std::size_t number;
};

std::uint64_t take_shadows(const RayScene& rays, const ShadowPacket& to, const std::uint32_t* found)
{
    RayPacket& p = to.batch->packet(to.number);
    const std::uint32_t active = to.batch->active(to.number);
    std::uint32_t ask = 0;
    for (std::size_t i = 0; i < kWidth; ++i) {
        if (!is_active(active, i)) continue;
        if (found[i] == RCS_DEVICE_BLOCKED) p.t_max[i] = -std::numeric_limits<float>::infinity();
        if (found[i] == RCS_DEVICE_ASK) ask |= 1u << i;
    }
    if (!rays.has_transparency()) {
        if (ask == 0) return 0;
        RayPacket asked = p;
        occluded(rays, ask, asked);
        for (std::size_t i = 0; i < kWidth; ++i)
            if (is_active(ask, i)) p.t_max[i] = asked.t_max[i];
        return static_cast<std::uint64_t>(std::popcount(ask));
    }
    LaneWeights& transmitted = to.batch->transmitted(to.number);
    std::fill(transmitted.weight, transmitted.weight + kWidth, glm::vec3(1.0f));
    if (ask == 0) return 0;
    RayPacket asked = p;
    LaneWeights weights;
    transmittance(rays, ask, asked, weights);
    for (std::size_t i = 0; i < kWidth; ++i)
        if (is_active(ask, i)) p.t_max[i] = asked.t_max[i], transmitted.weight[i] = weights.weight[i];
    return static_cast<std::uint64_t>(std::popcount(ask));
}

GlBuffer filled_buffer(const std::vector<DeviceWords>& words)
{
    const auto bytes = static_cast<GLsizeiptr>(words.size() * sizeof(DeviceWords));
    GlBuffer buffer = make_buffer(bytes);
    if (bytes > 0) glNamedBufferSubData(buffer.id(), 0, bytes, words.data());
    return buffer;
}

std::string mebibytes(std::size_t bytes) { return std::to_string((bytes + (1u << 20) - 1) >> 20) + " MiB"; }

}  // namespace

struct RayCaster::Impl {
    GlContext& gl;
    const RayScene& rays;
    LogFunction log;
    bool works = true;
    std::size_t most_rays = kMostRays;  // of a dispatch
    std::uint32_t roots[2] = {};
    GlBuffer nodes, triangles, instances, ray_buffer, results;
    std::vector<DeviceRay> up;
    std::vector<std::uint32_t> down;
    std::vector<std::uint64_t> asked;  // per thread
    CasterCounts counts;

    Impl(GlContext& g, const RayScene& r, LogFunction l) : gl(g), rays(r), log(std::move(l)) {}
    ~Impl();
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;

    void load(std::size_t most_bytes);
    void dispatch(std::size_t count, bool shadow, std::size_t words_per_ray);
    void fail(const Error& why);
    /// @param put  (number of a packet, its rays)   @param take  (number of a packet, its results): how many were asked
    /// @return so many packets are done: fewer if the device has failed
    template <typename Put, typename Take>
    std::size_t cast(std::size_t packets, bool shadow, ThreadPool& pool, const Put& put, const Take& take);
};

RayCaster::Impl::~Impl()
{
    try {
        gl.impl().make_current();
    } catch (const Error&) {
        // A context that is lost took its buffers along.
        for (GlBuffer* buffer : {&nodes, &triangles, &instances, &ray_buffer, &results}) buffer->release();
    }
}

void RayCaster::Impl::load(std::size_t most_bytes)
{
    const DeviceScene scene = make_device_scene(rays);
    gl.impl().make_current();
    GLint64 block = 0;
    glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &block);
    const auto most_in_block = static_cast<std::size_t>(std::max<GLint64>(block, 0));
    const std::size_t largest =
        sizeof(DeviceWords) * std::max({scene.nodes.size(), scene.triangles.size(), scene.instances.size()});
    if (largest > most_in_block)
        throw Error(ErrorCode::unsupported, "the scene takes a buffer of " + mebibytes(largest) + ", of which " +
                                                gl.renderer() + " has at most " + mebibytes(most_in_block));
    const std::size_t left = most_bytes > scene.bytes() ? most_bytes - scene.bytes() : 0;
    most_rays = std::min({kMostRays, left / kBytesPerRay, most_in_block / sizeof(DeviceRay)}) / kWidth * kWidth;
    if (most_rays < kLeastRays)
        throw Error(ErrorCode::out_of_memory, "the scene and its rays take " +
                                                  mebibytes(scene.bytes() + kLeastRays * kBytesPerRay) + " on " +
                                                  gl.renderer() + ", of which there are " + mebibytes(most_bytes));
    roots[0] = scene.root;
    roots[1] = scene.root_of_instances;
    nodes = filled_buffer(scene.nodes);
    triangles = filled_buffer(scene.triangles);
    instances = filled_buffer(scene.instances);
    ray_buffer = make_buffer(static_cast<GLsizeiptr>(most_rays * sizeof(DeviceRay)));
    results = make_buffer(static_cast<GLsizeiptr>(most_rays * sizeof(DeviceHit)));
    check_gl("bringing the scene to the device");
}

void RayCaster::Impl::dispatch(std::size_t count, bool shadow, std::size_t words_per_ray)
{
    gl.impl().make_current();
    glUseProgram(gl.impl().compute_program("rays.comp", shadow ? ShaderDefines{"RCS_RAYS_SHADOW"} : ShaderDefines{}));
    glNamedBufferSubData(ray_buffer.id(), 0, static_cast<GLsizeiptr>(count * sizeof(DeviceRay)), up.data());
    const std::array<std::pair<GLuint, const GlBuffer*>, 5> bound = {{{RCS_RAYS_BUFFER_NODES, &nodes},
                                                                      {RCS_RAYS_BUFFER_TRIANGLES, &triangles},
                                                                      {RCS_RAYS_BUFFER_INSTANCES, &instances},
                                                                      {RCS_RAYS_BUFFER_RAYS, &ray_buffer},
                                                                      {RCS_RAYS_BUFFER_RESULTS, &results}}};
    for (const auto& [binding, buffer] : bound) glBindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, buffer->id());
    glUniform1ui(RCS_RAYS_UNIFORM_COUNT, static_cast<GLuint>(count));
    glUniform2ui(RCS_RAYS_UNIFORM_ROOTS, roots[0], roots[1]);
    glDispatchCompute(static_cast<GLuint>((count + RCS_RAYS_GROUP - 1) / RCS_RAYS_GROUP), 1, 1);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
    down.resize(kMostRays * sizeof(DeviceHit) / sizeof(std::uint32_t));
    glGetNamedBufferSubData(results.id(), 0, static_cast<GLsizeiptr>(count * words_per_ray * sizeof(std::uint32_t)),
                            down.data());
    check_gl("tracing rays on the device");
    ++counts.dispatches;
}

void RayCaster::Impl::fail(const Error& why)
{
    works = false;
    if (log)
        log(LogLevel::warning,
            std::string("the processor gathers from here on, as ") + gl.renderer() + " failed: " + why.what());
}

template <typename Put, typename Take>
std::size_t RayCaster::Impl::cast(std::size_t packets, bool shadow, ThreadPool& pool, const Put& put, const Take& take)
{
    const std::size_t words = (shadow ? sizeof(std::uint32_t) : sizeof(DeviceHit)) / sizeof(std::uint32_t);
    up.resize(kMostRays);
    asked.assign(static_cast<std::size_t>(pool.size()), 0);
    const std::size_t at_once = most_rays / kWidth;
    std::size_t first = 0;
    for (std::size_t count = 0; first < packets && works; first += count) {
        count = std::min(at_once, packets - first);
        pool.parallel_for(count, kPacketsAtATime, [&](std::size_t begin, std::size_t end, int) {
            for (std::size_t p = begin; p < end; ++p) put(first + p, up.data() + kWidth * p);
        });
        try {
            dispatch(kWidth * count, shadow, words);
        } catch (const Error& why) {
            fail(why);
            break;
        }
        pool.parallel_for(count, kPacketsAtATime, [&](std::size_t begin, std::size_t end, int thread) {
            for (std::size_t p = begin; p < end; ++p)
                asked[static_cast<std::size_t>(thread)] += take(first + p, down.data() + kWidth * words * p);
        });
    }
    for (const std::uint64_t a : asked) counts.asked += a;
    return first;
}

RayCaster::RayCaster(GlContext& gl, const RayScene& rays, std::size_t most_bytes, LogFunction log)
    : impl_(new Impl(gl, rays, std::move(log)))
{
    impl_->load(most_bytes);
}

RayCaster::~RayCaster() = default;

bool RayCaster::works() const noexcept { return impl_->works; }
std::size_t RayCaster::wave() const noexcept { return impl_->most_rays; }
const CasterCounts& RayCaster::counts() const noexcept { return impl_->counts; }

void RayCaster::intersect(std::span<const AimedPacket> packets, ThreadPool& pool)
{
    for (const AimedPacket& p : packets) impl_->counts.rays += static_cast<std::uint64_t>(std::popcount(p.active));
    const std::size_t done = impl_->cast(
        packets.size(), false, pool,
        [&](std::size_t p, DeviceRay* to) { put_rays(packets[p].packet->ray, packets[p].active, to); },
        [&](std::size_t p, const std::uint32_t* found) {
            return take_hits(impl_->rays, packets[p], reinterpret_cast<const DeviceHit*>(found));
        });
    const std::span<const AimedPacket> left = packets.subspan(done);
    pool.parallel_for(left.size(), kPacketsAtATime, [&](std::size_t begin, std::size_t end, int) {
        for (const AimedPacket& p : left.subspan(begin, end - begin))
            rcs::intersect(impl_->rays, p.active, *p.packet, *p.weights);
    });
}

void RayCaster::trace(std::span<ShadowBatch* const> batches, ThreadPool& pool)
{
    std::vector<ShadowPacket> packets;
    for (ShadowBatch* batch : batches) {
        impl_->counts.rays += batch->size();
        if (impl_->rays.has_transparency()) batch->expect_transmitted();
        for (std::size_t p = 0; p < batch->packets(); ++p) packets.push_back({batch, p});
    }
    const std::size_t done = impl_->cast(
        packets.size(), true, pool,
        [&](std::size_t p, DeviceRay* to) {
            const auto [batch, number] = packets[p];
            put_rays(batch->packet(number), batch->active(number), to);
        },
        [&](std::size_t p, const std::uint32_t* found) { return take_shadows(impl_->rays, packets[p], found); });
    const std::span<const ShadowPacket> left = std::span(packets).subspan(done);
    pool.parallel_for(left.size(), kPacketsAtATime, [&](std::size_t begin, std::size_t end, int) {
        for (const auto& [batch, number] : left.subspan(begin, end - begin)) batch->trace(impl_->rays, number);
    });
}

}  // namespace rcs
