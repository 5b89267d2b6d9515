#include <string>

#include <glm/gtc/constants.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "scene/demo_scenes.h"
#include "scene/demo_shapes.h"

namespace rcs {
namespace {

constexpr float kHallHalfWidth = 5.0f, kHallHeight = 3.2f, kHallFront = 8.0f, kHallBack = -2.0f;

/// Two tones on the walls, so that a mirror has something to show.
void add_room(Scene& scene)
{
    const float x = kHallHalfWidth, y = kHallHeight;
    const int wall = add_material(scene, "wall", {0.6f, 0.58f, 0.55f});
    const int dado = add_material(scene, "dado", {0.25f, 0.32f, 0.36f});
    const int floor = add_material(scene, "floor", {0.42f, 0.3f, 0.2f});
    Mesh upper, lower, ground;
    const float band = 0.9f;
    const auto side = [&](glm::vec3 a, glm::vec3 b) {
        const auto at = [](glm::vec3 p, float height) { return glm::vec3(p.x, height, p.z); };
        add_quad(lower, at(a, 0), at(b, 0), at(b, band), at(a, band));
        add_quad(upper, at(a, band), at(b, band), at(b, y), at(a, y));
    };
    side({-x, 0, kHallBack}, {x, 0, kHallBack});
    side({x, 0, kHallBack}, {x, 0, kHallFront});
    side({x, 0, kHallFront}, {-x, 0, kHallFront});
    side({-x, 0, kHallFront}, {-x, 0, kHallBack});
    add_quad(upper, {-x, y, kHallBack}, {x, y, kHallBack}, {x, y, kHallFront}, {-x, y, kHallFront});
    add_quad(ground, {-x, 0, kHallFront}, {x, 0, kHallFront}, {x, 0, kHallBack}, {-x, 0, kHallBack});
    add_object(scene, "walls", wall, upper);
    add_object(scene, "dado", dado, lower);
    add_object(scene, "floor", floor, ground);
}

/// In the wall on the left, a hand's breadth in front of it.
void add_window(Scene& scene)
{
    Mesh pane;
    const float x = -kHallHalfWidth + 0.02f;
    add_quad(pane, {x, 1.2f, 1.8f}, {x, 1.2f, -0.2f}, {x, 2.7f, -0.2f}, {x, 2.7f, 1.8f});
    add_object(scene, "window", add_material(scene, "window", glm::vec3(0.0f), {16.0f, 17.0f, 19.0f}), pane);
}

void add_row(Scene& scene, const char* name, float metallic, float height, glm::vec3 color)
{
    for (int step = 0; step <= 10; ++step) {
        const float roughness = 0.1f * static_cast<float>(step);
        const std::string label = std::string(name) + " " + std::to_string(step);
        const int material = add_material(scene, label, color);
        Material& m = scene.materials[static_cast<std::size_t>(material)];
        m.metallic = metallic;
        m.roughness = roughness;
        m.specular = 1.0f;
        Mesh ball;
        add_sphere(ball, 0.32f, 4, true);
        const int mesh = add_mesh(scene, label, material, ball);
        add_instance(scene, label, mesh,
                     glm::translate(glm::dmat4(1.0), glm::dvec3(-3.6 + 0.72 * step, static_cast<double>(height), 0.0)));
    }
}

}  // namespace

Scene make_spheres()
{
    Scene scene;
    scene.name = "spheres";
    add_room(scene);
    add_window(scene);
    add_row(scene, "metal", 1.0f, 1.25f, {0.92f, 0.78f, 0.5f});
    add_row(scene, "plastic", 0.0f, 0.45f, {0.55f, 0.12f, 0.1f});
    scene.cameras.push_back(look_at_camera("front", {0.0, 1.4, 7.6}, {0.0, 1.1, 0.0}, glm::radians(58.0)));
    return scene;
}

}  // namespace rcs
