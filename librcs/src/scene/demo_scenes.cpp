#include "scene/demo_scenes.h"

#include <utility>

#include <glm/gtc/constants.hpp>

#include "rcs/error.h"
#include "rcs/suggestion.h"
#include "scene/demo_shapes.h"

namespace rcs {
namespace {

/// A convex body under a constant sky: seen radiance = albedo x sky, E = pi x sky.
Scene make_furnace()
{
    Scene scene;
    scene.name = "furnace";
    scene.sky_radiance = glm::vec3(1.0f);
    Mesh sphere;
    add_sphere(sphere, 1.0f, 5, true);
    add_object(scene, "sphere", add_material(scene, "grey", glm::vec3(0.5f)), sphere);
    scene.cameras.push_back(look_at_camera("front", {0.0, 0.5, 3.0}, {0.0, 0.0, 0.0}, glm::radians(45.0)));
    return scene;
}

/// Walls that emit L = 1 and reflect rho = 1/2, all around: after n bounces of indirect light
/// L (1 - rho^(n + 2)) / (1 - rho) everywhere.
Scene make_closed_box()
{
    Scene scene;
    scene.name = "closed-box";
    Mesh box;
    add_box(box, glm::vec3(-1.0f), glm::vec3(1.0f));
    for (glm::uvec3& triangle : box.triangles) std::swap(triangle.y, triangle.z);
    for (glm::vec3& normal : box.normals) normal = -normal;
    add_object(scene, "box", add_material(scene, "glowing", glm::vec3(0.5f), glm::vec3(1.0f)), box);
    scene.cameras.push_back(look_at_camera("inside", {0.6, 0.3, 0.7}, {-0.5, -0.4, -0.6}, glm::radians(70.0)));
    return scene;
}

/// A point light of 1 W/sr in the middle of a sphere of radius r = 2 m and albedo rho = 0.6: direct
/// irradiance 1 / r^2, each further bounce rho times that, the same all over.
Scene make_sphere_light()
{
    Scene scene;
    scene.name = "sphere-light";
    Mesh sphere;
    add_sphere(sphere, 2.0f, 5, false);
    add_object(scene, "sphere", add_material(scene, "grey", glm::vec3(0.6f)), sphere);
    PunctualLight light;
    light.name = "centre";
    scene.lights.push_back(light);
    scene.cameras.push_back(look_at_camera("inside", {0.7, 0.4, 1.0}, {-1.0, -0.3, -1.0}, glm::radians(70.0)));
    return scene;
}

/// A floor lit by nothing but a wall of uniform radiance 0.8: the light travels along the floor and
/// meets the wall at right angles.
Scene make_corner()
{
    Scene scene;
    scene.name = "corner";
    Mesh floor;
    add_quad(floor, {0, 0, 2}, {4, 0, 2}, {4, 0, -2}, {0, 0, -2});
    add_object(scene, "floor", add_material(scene, "floor", glm::vec3(0.5f)), floor);
    Mesh wall;
    add_quad(wall, {0, 0, 2}, {0, 0, -2}, {0, 4, -2}, {0, 4, 2});
    add_object(scene, "wall", add_material(scene, "wall", glm::vec3(0.8f)), wall);
    PunctualLight light;
    light.name = "along the floor";
    light.kind = LightKind::directional;
    light.intensity = glm::vec3(glm::pi<float>());
    light.direction = {-1.0, 0.0, 0.0};
    scene.lights.push_back(light);
    scene.cameras.push_back(look_at_camera("above", {5.0, 3.5, 2.5}, {1.2, 0.6, 0.0}, glm::radians(50.0)));
    return scene;
}

struct Demo {
    const char* name;
    Scene (*make)();
    Scene (*make_at)(double time) = nullptr;  ///< null: it has no animation
};
constexpr Demo kDemos[] = {{"demo:cornell", make_cornell},       {"demo:atrium", make_atrium, make_atrium_at},
                           {"demo:spheres", make_spheres},       {"demo:furnace", make_furnace},
                           {"demo:closed-box", make_closed_box}, {"demo:sphere-light", make_sphere_light},
                           {"demo:corner", make_corner},         {"demo:ajar", make_ajar},
                           {"demo:blinds", make_blinds}};

const Demo& find_demo(const std::string& name)
{
    std::string list;
    std::vector<std::string> names;
    for (const Demo& demo : kDemos) {
        if (name == demo.name) return demo;
        list += (list.empty() ? "" : ", ") + std::string(demo.name);
        names.emplace_back(demo.name);
    }
    throw Error(ErrorCode::not_found,
                "scene '" + name + "' does not exist; built in are " + list + did_you_mean(name, names));
}

}  // namespace

std::vector<std::string> demo_scene_names()
{
    std::vector<std::string> names;
    for (const Demo& demo : kDemos) names.emplace_back(demo.name);
    return names;
}

Scene make_demo_scene(const std::string& name, std::optional<double> time)
{
    const Demo& demo = find_demo(name);
    return time && demo.make_at != nullptr ? demo.make_at(*time) : demo.make();
}

bool is_animated_demo(const std::string& name) { return find_demo(name).make_at != nullptr; }

}  // namespace rcs
