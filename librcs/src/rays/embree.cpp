#include "rays/embree.h"

#include <cstdint>
#include <string>

#include "rcs/error.h"
#include "rcs/machine.h"

namespace rcs {

void throw_on_error(RTCDevice device, const char* what)
{
    const RTCError error = rtcGetDeviceError(device);
    if (error == RTC_ERROR_NONE) return;
    if (error == RTC_ERROR_OUT_OF_MEMORY)
        throw Error(ErrorCode::out_of_memory, std::string("Embree ran out of memory while ") + what);
    throw Error(ErrorCode::internal, std::string("Embree reported error ") + std::to_string(error) + " while " + what);
}

namespace {

RTCScene new_scene(RTCDevice device)
{
    RTCScene scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
    return scene;
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
        rtcSetGeometryIntersectFilterFunction(geometry, filter_hits);
        rtcSetGeometryOccludedFilterFunction(geometry, filter_hits);
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

/// The mesh by itself, to be shared by its instances: made when the first of them asks for it.
RTCScene object_of(RayScene::Impl& impl, std::size_t mesh, bool filtered)
{
    EmbreeScene& embree = *impl.embree;
    RTCScene& object = embree.objects[mesh];
    if (!object) {
        const Mesh& m = impl.scene->meshes[mesh];
        impl.object_positions[mesh] = padded(m.positions, nullptr);
        object = new_scene(embree.device);
        attach(object, new_triangles(embree.device, impl.object_positions[mesh], m, filtered), 0);
        rtcCommitScene(object);
    }
    return object;
}

}  // namespace

EmbreeScene::EmbreeScene(int threads)
{
    device = rtcNewDevice(("threads=" + std::to_string(threads)).c_str());
    if (!device) throw Error(ErrorCode::internal, "Embree could not create a device");
    top = new_scene(device);
}

EmbreeScene::~EmbreeScene()
{
    for (RTCScene object : objects)
        if (object) rtcReleaseScene(object);
    if (top) rtcReleaseScene(top);
    rtcReleaseDevice(device);
}

void build_acceleration(RayScene::Impl& impl)
{
    EmbreeScene& embree = *impl.embree;
    const Scene& scene = *impl.scene;
    std::vector<int> uses(scene.meshes.size(), 0);
    for (const Instance& instance : scene.instances) ++uses[static_cast<std::size_t>(instance.mesh)];
    embree.objects.resize(scene.meshes.size(), nullptr);
    impl.object_positions.resize(scene.meshes.size());
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        const Instance& instance = scene.instances[i];
        const std::size_t m = static_cast<std::size_t>(instance.mesh);
        const Mesh& mesh = scene.meshes[m];
        if (mesh.triangles.empty()) continue;
        RayInstance& target = impl.instances[i];
        const bool filtered = (target.simulated & kSeeThrough) != 0u;
        target.instanced = uses[m] > 1 && !impl.choice.without.has(Effect::instancing);
        RTCGeometry geometry = nullptr;
        if (target.instanced) {
            target.scene_from_object = glm::mat4x3(instance.world_from_object);
            geometry = new_instance(embree.device, object_of(impl, m, filtered), target.scene_from_object);
        } else {
            target.positions = padded(mesh.positions, &instance.world_from_object);
            geometry = new_triangles(embree.device, target.positions, mesh, filtered);
        }
        attach(embree.top, geometry, static_cast<std::uint32_t>(i));
    }
    rtcCommitScene(embree.top);
    throw_on_error(embree.device, "building the acceleration structure");
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
