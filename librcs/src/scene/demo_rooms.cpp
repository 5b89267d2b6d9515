// Two rooms whose light is hard to find: through the gap of a door, and between the slats of a blind.
#include <array>
#include <cmath>

#include <glm/gtc/constants.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "scene/demo_scenes.h"
#include "scene/demo_shapes.h"

namespace rcs {
namespace {

/// A rectangle in a wall's own measures: along it and up [m].
struct Opening {
    glm::vec2 low, high;
};

/// A wall from `corner` along the unit vector `right`, its front where right x up points, around an opening.
void add_wall(Mesh& mesh, glm::vec3 corner, glm::vec3 right, glm::vec2 size, const Opening& o)
{
    const auto part = [&](glm::vec2 low, glm::vec2 high) {
        const auto at = [&](float u, float v) { return corner + u * right + glm::vec3(0.0f, v, 0.0f); };
        if (low.x < high.x && low.y < high.y)
            add_quad(mesh, at(low.x, low.y), at(high.x, low.y), at(high.x, high.y), at(low.x, high.y));
    };
    part({0.0f, 0.0f}, {o.low.x, size.y});
    part({o.high.x, 0.0f}, size);
    part({o.low.x, 0.0f}, {o.high.x, o.low.y});
    part({o.low.x, o.high.y}, {o.high.x, size.y});
}

/// The four faces of an opening through a wall of some depth, which look into it.
void add_reveal(Mesh& mesh, glm::vec3 corner, glm::vec3 right, glm::vec3 depth, const Opening& o)
{
    const std::array<glm::vec2, 4> around = {o.low, {o.high.x, o.low.y}, o.high, {o.low.x, o.high.y}};
    for (std::size_t i = 0; i < 4; ++i) {
        const auto at = [&](glm::vec2 p) { return corner + p.x * right + glm::vec3(0.0f, p.y, 0.0f); };
        const glm::vec3 a = at(around[i]), b = at(around[(i + 1) % 4]);
        add_quad(mesh, a, b, b + depth, a + depth);
    }
}

/// Floor and ceiling of a room and its walls but those at the sides given.
enum Side : unsigned { kLeftSide = 1, kRightSide = 2, kBackSide = 4, kFrontSide = 8 };
void add_shell(Mesh& walls, Mesh& floor, glm::vec3 low, glm::vec3 high, unsigned without)
{
    const float x = low.x, X = high.x, y = low.y, Y = high.y, z = low.z, Z = high.z;
    add_quad(floor, {x, y, Z}, {X, y, Z}, {X, y, z}, {x, y, z});
    add_quad(walls, {x, Y, z}, {X, Y, z}, {X, Y, Z}, {x, Y, Z});
    if ((without & kLeftSide) == 0u) add_quad(walls, {x, y, Z}, {x, y, z}, {x, Y, z}, {x, Y, Z});
    if ((without & kRightSide) == 0u) add_quad(walls, {X, y, z}, {X, y, Z}, {X, Y, Z}, {X, Y, z});
    if ((without & kBackSide) == 0u) add_quad(walls, {x, y, z}, {X, y, z}, {X, Y, z}, {x, Y, z});
    if ((without & kFrontSide) == 0u) add_quad(walls, {X, y, Z}, {x, y, Z}, {x, Y, Z}, {X, Y, Z});
}

int add_glossy(Scene& scene, const char* name, glm::vec3 color, float metallic, float roughness)
{
    const int material = add_material(scene, name, color);
    Material& m = scene.materials[static_cast<std::size_t>(material)];
    m.metallic = metallic;
    m.roughness = roughness;
    m.specular = 1.0f;
    return material;
}

/// A table top of the given measures on four legs.
void add_table(Scene& scene, int material, glm::vec3 centre, glm::vec2 half, float height)
{
    Mesh table;
    add_box(table, centre + glm::vec3(-half.x, height - 0.04f, -half.y), centre + glm::vec3(half.x, height, half.y));
    for (const glm::vec2 leg : {glm::vec2(-1, -1), glm::vec2(1, -1), glm::vec2(1, 1), glm::vec2(-1, 1)}) {
        const glm::vec3 at = centre + glm::vec3(leg.x * (half.x - 0.06f), 0.0f, leg.y * (half.y - 0.06f));
        add_box(table, at - glm::vec3(0.025f, 0.0f, 0.025f), at + glm::vec3(0.025f, height - 0.041f, 0.025f));
    }
    add_object(scene, "table", material, table);
}

void add_ball(Scene& scene, const char* name, int material, glm::dvec3 centre, float radius)
{
    Mesh ball;
    add_sphere(ball, radius, 3, true);
    add_instance(scene, name, add_mesh(scene, name, material, ball), glm::translate(glm::dmat4(1.0), centre));
}

void add_vase(Scene& scene, int material, glm::dvec3 foot)
{
    constexpr std::array<glm::vec2, 9> kProfile = {{{0.06f, 0.0f},
                                                    {0.08f, 0.02f},
                                                    {0.13f, 0.10f},
                                                    {0.14f, 0.16f},
                                                    {0.11f, 0.23f},
                                                    {0.06f, 0.28f},
                                                    {0.05f, 0.32f},
                                                    {0.08f, 0.37f},
                                                    {0.001f, 0.371f}}};
    Mesh vase;
    add_lathe(vase, kProfile, 32);
    add_instance(scene, "vase", add_mesh(scene, "vase", material, vase), glm::translate(glm::dmat4(1.0), foot));
}

/// On the wall z = const that looks to +Z.
void add_picture(Scene& scene, int frame, int canvas, glm::vec3 low, glm::vec2 size)
{
    Mesh border, inside;
    const glm::vec3 high = low + glm::vec3(size, 0.03f);
    add_box(border, low + glm::vec3(0.0f, 0.0f, 0.001f), high);
    const float x = low.x + 0.05f, X = high.x - 0.05f, y = low.y + 0.05f, Y = high.y - 0.05f, z = high.z + 0.002f;
    add_quad(inside, {x, y, z}, {X, y, z}, {X, Y, z}, {x, Y, z});
    add_object(scene, "frame", frame, border);
    add_object(scene, "canvas", canvas, inside);
}

/// Hinged on the right side of its opening, so wide open into the room behind [degrees].
void add_door(Scene& scene, int material, glm::dvec3 hinge, float width, double angle)
{
    Mesh door;
    add_box(door, {-width, 0.005f, -0.04f}, {0.0f, 2.09f, 0.0f});
    const glm::dmat4 moved = glm::translate(glm::dmat4(1.0), hinge);
    add_instance(scene, "door", add_mesh(scene, "door", material, door),
                 glm::rotate(moved, glm::radians(angle), glm::dvec3(0.0, 1.0, 0.0)));
}

/// Slats along Z between two heights, their inner edges (towards +X) lower.
Mesh blind(glm::vec3 low, float length, float top)
{
    constexpr float kPitch = 0.05f;
    const glm::vec3 half = 0.026f * glm::vec3(std::cos(0.6f), -std::sin(0.6f), 0.0f), along(0.0f, 0.0f, length);
    Mesh slats;
    for (float y = low.y + 0.5f * kPitch; y < top; y += kPitch) {
        const glm::vec3 middle(low.x, y, low.z);
        add_quad(slats, middle - half, middle - half + along, middle + half + along, middle + half);
    }
    return slats;
}

}  // namespace

Scene make_ajar()
{
    Scene scene;
    scene.name = "ajar";
    const int plaster = add_material(scene, "plaster", {0.7f, 0.68f, 0.64f});
    const int red = add_material(scene, "red", {0.6f, 0.15f, 0.1f});
    const int wood = add_material(scene, "wood", {0.45f, 0.3f, 0.18f});
    const int floor = add_glossy(scene, "floor", {0.4f, 0.33f, 0.25f}, 0.0f, 0.45f);
    const int copper = add_glossy(scene, "copper", {0.9f, 0.6f, 0.45f}, 1.0f, 0.25f);
    const int china = add_glossy(scene, "china", {0.75f, 0.76f, 0.78f}, 0.0f, 0.2f);
    const int lamp = add_material(scene, "lamp", glm::vec3(0.0f), {240.0f, 220.0f, 180.0f});

    const Opening doorway{{2.9f, 0.0f}, {3.85f, 2.1f}};  // along a wall that begins at x = -2.4
    const glm::vec3 corner(-2.4f, 0.0f, -2.0f), right(1, 0, 0);
    Mesh walls, ground;
    add_shell(walls, ground, {-2.4f, 0.0f, -2.0f}, {2.4f, 2.6f, 2.6f}, kBackSide);
    add_wall(walls, corner, right, {4.8f, 2.6f}, doorway);
    add_reveal(walls, corner, right, {0.0f, 0.0f, -0.12f}, doorway);
    add_shell(walls, ground, {-0.8f, 0.0f, -4.6f}, {2.4f, 2.6f, -2.12f}, kFrontSide);
    add_wall(walls, {2.4f, 0.0f, -2.12f}, -right, {3.2f, 2.6f}, {{0.95f, 0.0f}, {1.9f, 2.1f}});
    add_object(scene, "walls", plaster, walls);
    add_object(scene, "floor", floor, ground);
    add_door(scene, wood, {1.445, 0.0, -2.06}, 0.94f, 32.0);

    Mesh panel;  // faces down; the main room sees it through the gap alone
    add_quad(panel, {-0.3f, 2.55f, -4.0f}, {0.3f, 2.55f, -4.0f}, {0.3f, 2.55f, -3.4f}, {-0.3f, 2.55f, -3.4f});
    add_object(scene, "lamp", lamp, panel);

    add_table(scene, wood, {-1.2f, 0.0f, -0.9f}, {0.7f, 0.4f}, 0.74f);
    add_vase(scene, copper, {-1.45, 0.74, -0.95});
    add_ball(scene, "ball", china, {-0.9, 0.86, -0.85}, 0.12f);
    add_picture(scene, wood, red, {-1.8f, 1.3f, -2.0f}, {1.1f, 0.8f});
    scene.cameras.push_back(look_at_camera("room", {-1.5, 1.5, 2.4}, {0.15, 0.85, -1.6}, glm::radians(58.0)));
    return scene;
}

Scene make_blinds()
{
    Scene scene;
    scene.name = "blinds";
    const int plaster = add_material(scene, "plaster", {0.72f, 0.71f, 0.7f});
    const int blue = add_material(scene, "blue", {0.15f, 0.25f, 0.5f});
    const int wood = add_material(scene, "wood", {0.5f, 0.36f, 0.22f});
    const int slat = add_material(scene, "slat", {0.8f, 0.8f, 0.78f});
    scene.materials[static_cast<std::size_t>(slat)].double_sided = true;
    const int floor = add_glossy(scene, "floor", {0.45f, 0.4f, 0.35f}, 0.0f, 0.3f);
    const int mirror = add_glossy(scene, "mirror", glm::vec3(0.9f), 1.0f, 0.02f);
    const int steel = add_glossy(scene, "steel", {0.7f, 0.7f, 0.72f}, 1.0f, 0.35f);
    const int sky = add_material(scene, "sky", glm::vec3(0.0f), {17.0f, 19.0f, 22.0f});

    const Opening window{{1.6f, 0.9f}, {3.6f, 2.2f}};  // along a wall that begins at z = 2.6 and goes back
    const glm::vec3 corner(-2.5f, 0.0f, 2.6f), back(0, 0, -1);
    Mesh walls, ground;
    add_shell(walls, ground, {-2.5f, 0.0f, -2.0f}, {2.5f, 2.7f, 2.6f}, kLeftSide);
    add_wall(walls, corner, back, {4.6f, 2.7f}, window);
    add_reveal(walls, corner, back, {-0.2f, 0.0f, 0.0f}, window);
    add_object(scene, "walls", plaster, walls);
    add_object(scene, "floor", floor, ground);
    add_object(scene, "blind", slat, blind({-2.6f, 0.9f, -1.0f}, 2.0f, 2.2f));

    Mesh panel;  // as large as the sky of a street, of which the slats leave little
    add_quad(panel, {-22, -20, 40}, {-22, -20, -40}, {-22, 40, -40}, {-22, 40, 40});
    add_object(scene, "sky", sky, panel);

    add_table(scene, wood, {0.4f, 0.0f, -0.9f}, {0.8f, 0.45f}, 0.72f);
    add_ball(scene, "ball", steel, {0.65, 0.90, -0.85}, 0.18f);
    Mesh box;
    add_box(box, {-0.15f, 0.721f, -1.1f}, {0.2f, 0.95f, -0.75f});
    add_object(scene, "box", blue, box);
    add_picture(scene, wood, mirror, {-0.6f, 1.15f, -2.0f}, {1.7f, 1.1f});
    scene.cameras.push_back(look_at_camera("room", {2.2, 1.55, 2.4}, {-0.55, 0.95, -1.3}, glm::radians(60.0)));
    return scene;
}

}  // namespace rcs
