#include <glm/gtc/constants.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "scene/demo_scenes.h"
#include "scene/demo_shapes.h"

namespace rcs {
namespace {

// Goral et al. 1984, in the measures of the box at Cornell, taken to metres and squared up.
constexpr float kHalfWidth = 2.78f;
constexpr float kHeight = 5.488f;
constexpr float kHalfDepth = 2.796f;

void add_walls(Scene& scene, int white, int red, int green)
{
    const float x = kHalfWidth, y = kHeight, z = kHalfDepth;
    Mesh shell;  // the front, towards +Z, is open
    add_quad(shell, {-x, 0, z}, {x, 0, z}, {x, 0, -z}, {-x, 0, -z});
    add_quad(shell, {-x, y, -z}, {x, y, -z}, {x, y, z}, {-x, y, z});
    add_quad(shell, {-x, 0, -z}, {x, 0, -z}, {x, y, -z}, {-x, y, -z});
    add_object(scene, "shell", white, shell);
    Mesh left;
    add_quad(left, {-x, 0, z}, {-x, 0, -z}, {-x, y, -z}, {-x, y, z});
    add_object(scene, "left wall", red, left);
    Mesh right;
    add_quad(right, {x, 0, -z}, {x, 0, z}, {x, y, z}, {x, y, -z});
    add_object(scene, "right wall", green, right);
}

/// Two instances of one unit cube.
void add_blocks(Scene& scene, int white)
{
    Mesh cube;
    add_box(cube, {-0.5f, 0.0f, -0.5f}, {0.5f, 1.0f, 0.5f});
    const int mesh = add_mesh(scene, "block", white, cube);
    const auto place = [&](const char* name, glm::dvec3 position, double degrees, glm::dvec3 size) {
        const glm::dmat4 moved = glm::translate(glm::dmat4(1.0), position);
        const glm::dmat4 turned = glm::rotate(moved, glm::radians(degrees), glm::dvec3(0.0, 1.0, 0.0));
        add_instance(scene, name, mesh, glm::scale(turned, size));
    };
    place("short block", {0.92, 0.0, 1.10}, -17.0, {1.65, 1.65, 1.65});
    place("tall block", {-0.90, 0.0, -0.70}, 20.0, {1.65, 3.30, 1.65});
}

}  // namespace

Scene make_cornell()
{
    Scene scene;
    scene.name = "cornell";
    const int white = add_material(scene, "white", {0.725f, 0.71f, 0.68f});
    const int red = add_material(scene, "red", {0.63f, 0.065f, 0.05f});
    const int green = add_material(scene, "green", {0.14f, 0.45f, 0.091f});
    const int lamp = add_material(scene, "lamp", {0.78f, 0.78f, 0.78f}, {25.0f, 18.0f, 6.0f});
    add_walls(scene, white, red, green);
    add_blocks(scene, white);

    Mesh panel;  // one-sided: it emits downwards only
    const float y = kHeight - 0.01f;
    add_quad(panel, {-0.65f, y, -0.525f}, {0.65f, y, -0.525f}, {0.65f, y, 0.525f}, {-0.65f, y, 0.525f});
    add_object(scene, "lamp", lamp, panel);

    // Far enough outside that the open front fills the picture.
    scene.cameras.push_back(look_at_camera("front", {0.0, 2.73, 10.8}, {0.0, 2.73, 0.0}, glm::radians(37.5)));
    return scene;
}

}  // namespace rcs
