#include "scene/gltf_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <glm/gtc/constants.hpp>

#include "scene/gltf_instances.h"
#include "scene/gltf_material.h"
#include "scene/gltf_nodes.h"

namespace rcs {
namespace {

constexpr GltfNoteKind kCones{"cone angles out of order", "light", "moved into 0 <= inner < outer <= 90 degrees"};

template <class Elements>
std::size_t checked_index(const GltfFile& file, const std::string& user, const char* kind, int index,
                          const Elements& elements)
{
    if (index < 0 || static_cast<std::size_t>(index) >= elements.size()) {
        bad_file(file, user + " names " + kind + " " + std::to_string(index) + ", the file has " +
                           std::to_string(elements.size()));
    }
    return static_cast<std::size_t>(index);
}

/// A material for primitives that name none (glTF 2.0, section 3.9: all defaults), made when first needed.
int default_material(Scene& scene, std::size_t materials_in_file)
{
    if (scene.materials.size() == materials_in_file) {
        scene.materials.push_back(default_gltf_material());
    }
    return static_cast<int>(materials_in_file);
}

void add_materials(const GltfFile& file, const tinygltf::Model& model, Scene& scene)
{
    std::vector<bool> in_use(model.materials.size(), false);
    for (const Mesh& mesh : scene.meshes) {
        if (mesh.material >= 0) in_use[static_cast<std::size_t>(mesh.material)] = true;
    }
    read_materials(file, model, in_use, scene);
    for (Mesh& mesh : scene.meshes) {
        if (mesh.material < 0) mesh.material = default_material(scene, model.materials.size());
    }
}

void read_cone(const GltfFile& file, const tinygltf::Light& source, const std::string& name, PunctualLight& light)
{
    // A cone of a milliradian is narrower than any lamp's, and keeps divisions by its width finite.
    constexpr double kNarrowest = 1e-3;
    const double outer = std::clamp(source.spot.outerConeAngle, kNarrowest, glm::half_pi<double>());
    const double inner = std::clamp(source.spot.innerConeAngle, 0.0, outer - kNarrowest);
    if (outer != source.spot.outerConeAngle || inner != source.spot.innerConeAngle) file.notes->add(kCones, name);
    light.inner_cone = static_cast<float>(inner);
    light.outer_cone = static_cast<float>(outer);
}

PunctualLight read_light(const GltfFile& file, const tinygltf::Light& source, std::size_t index,
                         const std::string& node_name, const glm::dmat4& matrix)
{
    const std::string what = element_name("light", index, source.name);
    PunctualLight light;
    light.name = node_name.empty() ? source.name : node_name;
    if (source.type == "point")
        light.kind = LightKind::point;
    else if (source.type == "spot")
        light.kind = LightKind::spot;
    else if (source.type == "directional")
        light.kind = LightKind::directional;
    else
        bad_file(file, what + " has type '" + source.type + "', expected point, spot or directional");

    glm::dvec3 color(1.0);
    if (!source.color.empty() && source.color.size() != 3)
        bad_file(file, what + " has a colour of other than 3 numbers");
    if (source.color.size() == 3) color = {source.color[0], source.color[1], source.color[2]};
    light.intensity = glm::vec3(color * source.intensity);
    for (int channel = 0; channel < 3; ++channel) {
        if (!(light.intensity[channel] >= 0.0f) || !std::isfinite(light.intensity[channel])) {
            bad_file(file, what + " has the intensity " + std::to_string(light.intensity[channel]) +
                               ", expected a finite number >= 0");
        }
    }
    // tinygltf writes 0 where the file gives no range. Zero is no valid range either.
    if (source.range > 0.0) light.range = static_cast<float>(source.range);
    if (light.kind == LightKind::spot) read_cone(file, source, what, light);
    light.position = glm::dvec3(matrix[3]);
    const glm::dvec3 direction = -glm::dvec3(matrix[2]);
    if (glm::length(direction) > 0.0) light.direction = glm::normalize(direction);
    return light;
}

void add_lights(const GltfFile& file, const tinygltf::Model& model, const Matrices& matrices,
                const std::vector<bool>& visible, Scene& scene)
{
    for (std::size_t i = 0; i < model.nodes.size(); ++i) {
        const auto found = model.nodes[i].extensions.find("KHR_lights_punctual");
        if (!matrices[i] || !visible[i] || found == model.nodes[i].extensions.end()) continue;
        const std::string& name = model.nodes[i].name;
        const tinygltf::Value& number = found->second.Get("light");
        if (!number.IsInt()) bad_file(file, element_name("node", i, name) + " names no light");
        const std::size_t index =
            checked_index(file, element_name("node", i, name), "light", number.GetNumberAsInt(), model.lights);
        if (model.lights[index].type != "point" && is_singular(*matrices[i])) {
            file.notes->add(kSingularNode, short_name(i, name));
            continue;
        }
        scene.lights.push_back(read_light(file, model.lights[index], index, name, *matrices[i]));
    }
}

/// The rotation and translation of a camera's node, without its scale.
glm::dmat4 rigid(const glm::dmat4& matrix)
{
    const glm::dvec3 z = glm::normalize(glm::dvec3(matrix[2]));
    glm::dvec3 x = glm::normalize(glm::cross(glm::dvec3(matrix[1]), z));
    const glm::dvec3 y = glm::cross(z, x);
    return glm::dmat4(glm::dvec4(x, 0.0), glm::dvec4(y, 0.0), glm::dvec4(z, 0.0),
                      glm::dvec4(glm::dvec3(matrix[3]), 1.0));
}

Camera read_camera(const GltfFile& file, const tinygltf::Camera& source, const std::string& name,
                   const glm::dmat4& matrix)
{
    Camera camera;
    camera.name = name;
    camera.world_from_view = rigid(matrix);
    if (source.type == "perspective") {
        camera.yfov = source.perspective.yfov;
        if (!(camera.yfov > 0.0) || !(camera.yfov < glm::pi<double>())) {
            bad_file(file, "camera '" + name + "' has a yfov of " + std::to_string(camera.yfov) +
                               ", expected a value in (0, pi)");
        }
        return camera;
    }
    if (source.type != "orthographic") {
        bad_file(file, "camera '" + name + "' has type '" + source.type + "', expected perspective or orthographic");
    }
    camera.projection = Projection::orthographic;
    camera.ymag = std::fabs(source.orthographic.ymag);
    if (!(camera.ymag > 0.0)) bad_file(file, "camera '" + name + "' has a ymag of 0, expected a value above it");
    return camera;
}

void add_cameras(const GltfFile& file, const tinygltf::Model& model, const Matrices& matrices, Scene& scene)
{
    for (std::size_t i = 0; i < model.nodes.size(); ++i) {
        const tinygltf::Node& node = model.nodes[i];
        if (!matrices[i] || node.camera < 0) continue;
        const std::size_t index =
            checked_index(file, element_name("node", i, node.name), "camera", node.camera, model.cameras);
        if (is_singular(*matrices[i])) {
            file.notes->add(kSingularNode, short_name(i, node.name));
            continue;
        }
        std::string name = node.name.empty() ? model.cameras[index].name : node.name;
        if (name.empty()) name = "camera " + std::to_string(scene.cameras.size());
        scene.cameras.push_back(read_camera(file, model.cameras[index], name, *matrices[i]));
    }
}

/// Rays begin and end within what single precision can square: Embree stops the program where they do not.
constexpr double kFarthest = 1e18;

bool is_near(glm::dvec3 p)
{
    // Written so that NaN fails, too.
    return std::fabs(p.x) <= kFarthest && std::fabs(p.y) <= kFarthest && std::fabs(p.z) <= kFarthest;
}

void check_meshes_reach(const GltfFile& file, const Scene& scene)
{
    const Bounds bounds = bounds_of(scene);
    if (bounds.min.x > bounds.max.x || (is_near(bounds.min) && is_near(bounds.max))) return;
    for (const Instance& instance : scene.instances) {
        for (const glm::vec3 position : scene.meshes[static_cast<std::size_t>(instance.mesh)].positions) {
            if (!is_near(instance.world_from_object * glm::dvec4(position, 1.0))) {
                bad_file(file, "node \"" + instance.name + "\" places its mesh farther than 1e18 from zero");
            }
        }
    }
}

void check_cameras_reach(const GltfFile& file, const Scene& scene)
{
    for (const Camera& camera : scene.cameras) {
        if (!is_near(camera.world_from_view[3])) {
            bad_file(file, "camera \"" + camera.name + "\" stands farther than 1e18 from the middle of the meshes");
        }
    }
}

}  // namespace

Scene build_scene(const GltfFile& file, const tinygltf::Model& model, const std::vector<NodePose>& poses)
{
    const Matrices matrices = node_matrices(file, model, poses);
    const std::vector<bool> visible = visible_nodes(model);
    Scene scene;
    scene.name = std::filesystem::path(file.path).stem().string();
    add_instances(file, model, matrices, poses, visible, scene);
    add_materials(file, model, scene);
    add_lights(file, model, matrices, visible, scene);
    add_cameras(file, model, matrices, scene);
    check_meshes_reach(file, scene);
    move_origin(scene);
    check_cameras_reach(file, scene);
    return scene;
}

}  // namespace rcs
