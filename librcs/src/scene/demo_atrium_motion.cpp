#include <algorithm>

#include <glm/gtc/constants.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "scene/demo_atrium_parts.h"
#include "scene/demo_scenes.h"
#include "scene/demo_shapes.h"

namespace rcs {
namespace {

/// How far something is between two times, in [0, 1], without a jolt at either.
double eased(double time, double from, double to)
{
    const double part = std::clamp((time - from) / (to - from), 0.0, 1.0);
    return part * part * (3.0 - 2.0 * part);
}

/// By the north wall, in the arcade.
void add_ball(Scene& scene, double time)
{
    constexpr float kRadius = 0.5f;
    const double x = glm::mix(-2.0, 2.0, time / kDemoSeconds);
    Mesh ball;
    add_sphere(ball, kRadius, 4, true);
    const int mesh = add_mesh(scene, "ball", add_material(scene, "ball", {0.70f, 0.20f, 0.10f}), ball);
    add_instance(scene, "ball", mesh, glm::translate(glm::dmat4(1.0), glm::dvec3(x, kRadius, -8.55)));
}

/// A leaf in one of the bays between arcade and court, which turns about its left edge into the arcade.
void add_gate(Scene& scene, double time)
{
    const double degrees = 85.0 * eased(time, 0.5, 1.75);
    Mesh leaf;
    add_box(leaf, {0.0f, 0.02f, -0.04f}, {2.4f, 2.68f, 0.04f});
    const int mesh = add_mesh(scene, "gate", add_material(scene, "gate", {0.20f, 0.11f, 0.06f}), leaf);
    const glm::dmat4 hinge = glm::translate(glm::dmat4(1.0), glm::dvec3(0.3, 0.0, -2.0 * double{kBay}));
    add_instance(scene, "gate", mesh, glm::rotate(hinge, glm::radians(degrees), glm::dvec3(0.0, 1.0, 0.0)));
}

void add_lamp(Scene& scene, double time)
{
    if (time < 1.0) return;
    PunctualLight lamp;
    lamp.name = "lamp";
    lamp.intensity = 4.0f * glm::vec3(1.0f, 0.78f, 0.50f);
    lamp.position = {-1.5, 3.4, -7.6};
    scene.lights.push_back(lamp);
}

}  // namespace

Scene make_atrium_at(double time)
{
    time = std::clamp(time, 0.0, kDemoSeconds);
    Scene scene = make_atrium();
    add_ball(scene, time);
    add_gate(scene, time);
    add_lamp(scene, time);
    const double way = time / kDemoSeconds;
    const glm::dvec3 eye = glm::mix(glm::dvec3(-6.6, 1.7, -8.1), glm::dvec3(-5.4, 1.7, -7.7), way);
    scene.cameras.push_back(look_at_camera("walk", eye, {4.0, 1.9, -6.9}, glm::radians(62.0)));
    return scene;
}

}  // namespace rcs
