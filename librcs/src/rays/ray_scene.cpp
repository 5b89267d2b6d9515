#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "rays/embree.h"
#include "rays/ray_scene_impl.h"

namespace rcs {
namespace {

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

/// What each mesh can be, and its bounds.
void describe_meshes(RayScene::Impl& impl)
{
    const Scene& scene = *impl.scene;
    impl.traits = find_traits(scene);
    for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
        const Material& material = scene.materials[static_cast<std::size_t>(scene.meshes[m].material)];
        impl.simulated.push_back(simulated_traits(impl.traits[m], material, impl.choice));
        Bounds& bounds = impl.bounds.emplace_back();
        for (const glm::vec3& p : scene.meshes[m].positions) {
            bounds.min = glm::min(bounds.min, glm::dvec3(p));
            bounds.max = glm::max(bounds.max, glm::dvec3(p));
        }
    }
    impl.hit_triangles.resize(scene.meshes.size());
}

/// All that a hit needs of an instance but where its triangles lie.
void describe_instance(const Instance& instance, RayScene::Impl& impl)
{
    const std::size_t m = static_cast<std::size_t>(instance.mesh);
    const Mesh& mesh = impl.scene->meshes[m];
    const glm::dmat3 linear(instance.world_from_object);
    RayInstance& target = impl.instances.emplace_back();
    target.mesh = &mesh;
    target.material = mesh.material;
    if (impl.hit_triangles[m].empty()) impl.hit_triangles[m] = hit_triangles(mesh);
    target.smooth = !mesh.normals.empty();
    target.triangles = impl.hit_triangles[m].data();
    target.inverse_scale = static_cast<float>(1.0 / std::cbrt(std::abs(glm::determinant(linear))));
    target.mirrored = glm::determinant(linear) < 0.0;
    target.normal_from_object = glm::mat3(glm::transpose(glm::inverse(linear)));
    target.simulated = impl.simulated[m];
    impl.triangle_count += mesh.triangles.size();
    const bool filtered = (target.simulated & kSeeThrough) != 0u;
    impl.has_transparency = impl.has_transparency || (filtered && !mesh.triangles.empty());
}

}  // namespace

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
    impl->environment = Environment(scene);
    impl->embree = std::make_unique<EmbreeScene>(pool.size());
    describe_meshes(*impl);
    impl->instances.reserve(scene.instances.size());
    for (const Instance& instance : scene.instances) describe_instance(instance, *impl);
    build_acceleration(*impl);
    return impl;
}

}  // namespace rcs
