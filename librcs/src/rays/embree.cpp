#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include "rays/packet.h"
#include "rays/ray_scene_impl.h"
#include "rays/transparency.h"
#include "rcs/error.h"
#include "rcs/machine.h"
#include "util/counters.h"

namespace rcs {
namespace {

static_assert(offsetof(RayPacket, t_max) == offsetof(RTCRay16, tfar));
static_assert(sizeof(RayPacket) == sizeof(RTCRay16));
static_assert(offsetof(HitPacket, u) == offsetof(RTCRayHit16, hit.u));
static_assert(offsetof(HitPacket, instance_id) == offsetof(RTCRayHit16, hit.instID));
static_assert(sizeof(RTCRayHit16) <= sizeof(HitPacket));
static_assert(RayPacket::kMiss == RTC_INVALID_GEOMETRY_ID);

void throw_on_error(RTCDevice device, const char* what)
{
    const RTCError error = rtcGetDeviceError(device);
    if (error == RTC_ERROR_NONE) return;
    if (error == RTC_ERROR_OUT_OF_MEMORY)
        throw Error(ErrorCode::out_of_memory, std::string("Embree ran out of memory while ") + what);
    throw Error(ErrorCode::internal, std::string("Embree reported error ") + std::to_string(error) + " while " + what);
}

RTCScene new_scene(RTCDevice device)
{
    RTCScene scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
    return scene;
}

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

/// Asked by Embree for each meeting of rays with a surface that may let them through.
void filter(const RTCFilterFunctionNArguments* arguments)
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

/// A triangle geometry that reads `positions` and the mesh's indices in place.
RTCGeometry new_triangles(RTCDevice device, const std::vector<glm::vec3>& positions, const Mesh& mesh, bool filtered)
{
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    // Embree may read 16 bytes at the last vertex; both vectors are kept one element longer than used.
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, positions.data(), 0,
                               sizeof(glm::vec3), positions.size() - 1);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.triangles.data(), 0,
                               sizeof(glm::uvec3), mesh.triangles.size());
    rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
    if (filtered) {
        rtcSetGeometryIntersectFilterFunction(geometry, filter);
        rtcSetGeometryOccludedFilterFunction(geometry, filter);
    }
    rtcCommitGeometry(geometry);
    return geometry;
}

void attach(RTCScene scene, RTCGeometry geometry, std::uint32_t id)
{
    rtcAttachGeometryByID(scene, geometry, id);
    rtcReleaseGeometry(geometry);
}

std::vector<glm::vec3> padded(const std::vector<glm::vec3>& positions, const glm::dmat4* transform)
{
    std::vector<glm::vec3> result;
    result.reserve(positions.size() + 1);
    for (const glm::vec3& p : positions)
        result.push_back(transform ? glm::vec3(*transform * glm::dvec4(glm::dvec3(p), 1.0)) : p);
    result.emplace_back(0.0f);
    return result;
}

RTCGeometry new_instance(RTCDevice device, RTCScene object, const glm::mat4x3& scene_from_object)
{
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(geometry, object);
    rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, &scene_from_object[0][0]);
    rtcCommitGeometry(geometry);
    return geometry;
}

bool is_flat(const HitTriangle& h, glm::vec3 face)
{
    // Closer than vertex normals stored as floats are exact anyway.
    constexpr float kSame2 = 1e-10f;
    return std::all_of(h.normal, h.normal + 3, [&](glm::vec3 n) { return glm::dot(n - face, n - face) < kSame2; });
}

HitTriangle hit_triangle(const Mesh& mesh, glm::uvec3 t)
{
    const glm::dvec3 a(mesh.positions[t.x]);
    const glm::dvec3 e1 = glm::dvec3(mesh.positions[t.y]) - a;
    const glm::dvec3 e2 = glm::dvec3(mesh.positions[t.z]) - a;
    const glm::dvec3 face = glm::cross(e1, e2);
    const double twice_area = glm::length(face);
    HitTriangle h{};
    for (int i = 0; i < 3; ++i) {
        h.normal[i] = mesh.normals.empty() ? glm::vec3(face / std::max(twice_area, 1e-300)) : mesh.normals[t[i]];
        h.uv[i] = mesh.uvs.empty() ? glm::vec2(0.0f) : mesh.uvs[t[i]];
    }
    const glm::dvec2 d1 = glm::dvec2(h.uv[1]) - glm::dvec2(h.uv[0]);
    const glm::dvec2 d2 = glm::dvec2(h.uv[2]) - glm::dvec2(h.uv[0]);
    const double uv_area = std::abs(d1.x * d2.y - d1.y * d2.x);
    const float density = twice_area > 0.0 ? static_cast<float>(std::sqrt(uv_area / twice_area)) : 0.0f;
    h.signed_uv_density = is_flat(h, glm::vec3(face / std::max(twice_area, 1e-300))) ? -density : density;
    return h;
}

std::vector<HitTriangle> hit_triangles(const Mesh& mesh)
{
    std::vector<HitTriangle> result;
    result.reserve(mesh.triangles.size());
    for (const glm::uvec3& t : mesh.triangles) result.push_back(hit_triangle(mesh, t));
    return result;
}

RTCRay to_embree(const Ray& ray)
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
    return r;
}

}  // namespace

/// What Embree holds; released in the destructor.
struct EmbreeScene {
    RTCDevice device = nullptr;
    RTCScene top = nullptr;
    std::vector<RTCScene> objects;  // per mesh; null unless it is instanced

    explicit EmbreeScene(int threads)
    {
        device = rtcNewDevice(("threads=" + std::to_string(threads)).c_str());
        if (!device) throw Error(ErrorCode::internal, "Embree could not create a device");
        top = new_scene(device);
    }
    ~EmbreeScene()
    {
        for (RTCScene object : objects)
            if (object) rtcReleaseScene(object);
        if (top) rtcReleaseScene(top);
        rtcReleaseDevice(device);
    }
    EmbreeScene(const EmbreeScene&) = delete;
    EmbreeScene& operator=(const EmbreeScene&) = delete;
};

RayScene::Impl::Impl() = default;
RayScene::Impl::~Impl() = default;
RayScene::RayScene(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RayScene::~RayScene() = default;
RayScene::RayScene(RayScene&&) noexcept = default;
RayScene& RayScene::operator=(RayScene&&) noexcept = default;

const Scene& RayScene::scene() const noexcept { return *impl_->scene; }

std::size_t RayScene::triangle_count() const noexcept { return impl_->triangle_count; }

bool RayScene::has_transparency() const noexcept { return impl_->has_transparency; }

std::unique_ptr<RayScene::Impl> make_ray_scene(const Scene& scene, const ThreadPool& pool, const EffectChoice& effects)
{
    validate(scene);
    auto impl = std::make_unique<RayScene::Impl>();
    impl->scene = &scene;
    impl->choice = effects;
    impl->traits = find_traits(scene);
    for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
        const Material& material = scene.materials[static_cast<std::size_t>(scene.meshes[m].material)];
        impl->simulated.push_back(simulated_traits(impl->traits[m], material, effects));
        Bounds& bounds = impl->bounds.emplace_back();
        for (const glm::vec3& p : scene.meshes[m].positions) {
            bounds.min = glm::min(bounds.min, glm::dvec3(p));
            bounds.max = glm::max(bounds.max, glm::dvec3(p));
        }
    }
    impl->environment = Environment(scene);
    impl->embree = std::make_unique<EmbreeScene>(pool.size());
    EmbreeScene& embree = *impl->embree;

    std::vector<int> uses(scene.meshes.size(), 0);
    for (const Instance& instance : scene.instances) ++uses[static_cast<std::size_t>(instance.mesh)];
    embree.objects.resize(scene.meshes.size(), nullptr);
    impl->object_positions.resize(scene.meshes.size());
    impl->hit_triangles.resize(scene.meshes.size());
    impl->instances.resize(scene.instances.size());

    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        const Instance& instance = scene.instances[i];
        const std::size_t m = static_cast<std::size_t>(instance.mesh);
        const Mesh& mesh = scene.meshes[m];
        RayInstance& target = impl->instances[i];
        const glm::dmat3 linear(instance.world_from_object);
        target.mesh = &mesh;
        target.material = mesh.material;
        if (impl->hit_triangles[m].empty()) impl->hit_triangles[m] = hit_triangles(mesh);
        target.smooth = !mesh.normals.empty();
        target.triangles = impl->hit_triangles[m].data();
        target.inverse_scale = static_cast<float>(1.0 / std::cbrt(std::abs(glm::determinant(linear))));
        target.mirrored = glm::determinant(linear) < 0.0;
        target.normal_from_object = glm::mat3(glm::transpose(glm::inverse(linear)));
        impl->triangle_count += mesh.triangles.size();
        target.simulated = impl->simulated[m];
        const bool filtered = (target.simulated & kSeeThrough) != 0u;
        impl->has_transparency = impl->has_transparency || (filtered && !mesh.triangles.empty());
        if (mesh.triangles.empty()) continue;
        if (uses[m] == 1 || effects.without.has(Effect::instancing)) {
            target.positions = padded(mesh.positions, &instance.world_from_object);
            attach(embree.top, new_triangles(embree.device, target.positions, mesh, filtered),
                   static_cast<std::uint32_t>(i));
            continue;
        }
        if (!embree.objects[m]) {
            impl->object_positions[m] = padded(mesh.positions, nullptr);
            embree.objects[m] = new_scene(embree.device);
            attach(embree.objects[m], new_triangles(embree.device, impl->object_positions[m], mesh, filtered), 0);
            rtcCommitScene(embree.objects[m]);
        }
        target.instanced = true;
        target.scene_from_object = glm::mat4x3(instance.world_from_object);
        attach(embree.top, new_instance(embree.device, embree.objects[m], target.scene_from_object),
               static_cast<std::uint32_t>(i));
    }
    rtcCommitScene(embree.top);
    throw_on_error(embree.device, "building the acceleration structure");
    return impl;
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

/// Embree wants one int per lane, -1 where the ray is alive.
struct alignas(64) LaneMask {
    int lane[RayPacket::kWidth];
    explicit LaneMask(std::uint32_t active)
    {
        for (int i = 0; i < RayPacket::kWidth; ++i) lane[i] = (active >> i & 1u) != 0u ? -1 : 0;
    }
};

}  // namespace

namespace {

RTCRayHit to_embree_hit(const Ray& ray)
{
    RTCRayHit hit{};
    hit.ray = to_embree(ray);
    hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    hit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    return hit;
}

void trace(const RayScene& rays, std::uint32_t active, HitPacket& packet, Passage* passage)
{
    const LaneMask valid(active);
    for (int i = 0; i < RayPacket::kWidth; ++i) {
        packet.geometry[i] = RayPacket::kMiss;
        packet.instance_id[i] = RayPacket::kMiss;
    }
    Query query(passage);
    RCS_RTC_INTERSECT(rtcIntersect16, &query.context, reinterpret_cast<RTCRayHit16*>(&packet), valid.lane,
                      rays.impl().embree->top);
}

void trace(const RayScene& rays, std::uint32_t active, RayPacket& packet, Passage* passage)
{
    const LaneMask valid(active);
    Query query(passage);
    RCS_RTC_OCCLUDED(rtcOccluded16, &query.context, reinterpret_cast<RTCRay16*>(&packet), valid.lane,
                     rays.impl().embree->top);
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

std::vector<MachineFact> describe_rays()
{
    const EmbreeScene embree(1);
    const auto property = [&](RTCDeviceProperty name) { return rtcGetDeviceProperty(embree.device, name); };
    const auto version = static_cast<int>(property(RTC_DEVICE_PROPERTY_VERSION));
    const std::string number = std::to_string(version / 10000) + "." + std::to_string(version / 100 % 100) + "." +
                               std::to_string(version % 100);
    const char* isa = property(RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED)  ? "AVX-512, packets of 16"
                      : property(RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) ? "AVX, packets of 8"
                                                                            : "SSE, packets of 4";
    const bool filters = property(RTC_DEVICE_PROPERTY_FILTER_FUNCTION_SUPPORTED) != 0;
    return {{"Embree", number},
            {"Embree instruction set", isa},
            {"Embree filters", filters ? "yes" : "no: transparency will not work"}};
}

}  // namespace rcs
