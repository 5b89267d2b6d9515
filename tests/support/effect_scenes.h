#pragma once

#include <string>
#include <utility>
#include <vector>

#include "rcs/render.h"
#include "scene/texture.h"
#include "support/scenes.h"

/// Rooms that call for one effect more than a plain one.
namespace rcs::test {

inline int add_surface(Scene& scene, const Material& material)
{
    scene.materials.push_back(material);
    scene.materials.back().name = "surface " + std::to_string(scene.materials.size());
    return static_cast<int>(scene.materials.size()) - 1;
}

/// A closed room 4 m wide, 3 m high, 4 m deep; the camera looks along -z from its middle.
inline Scene room(float albedo)
{
    Scene scene;
    add_mesh(scene, box({-2, 0, -2}, {2, 3, 2}, add_material(scene, glm::vec3(albedo)), Facing::inwards));
    scene.cameras = {look_at_camera("camera", {0.0, 1.5, 1.8}, {0.0, 1.5, -2.0}, 0.9)};
    return scene;
}

/// The same with a point light.
inline Scene lit_room(float albedo = 0.5f)
{
    Scene scene = room(albedo);
    scene.lights = {point_light({1.0, 2.5, 0.5}, glm::vec3(3.0f))};
    return scene;
}

/// A square of 1 m in the room, facing the camera, with texture coordinates. @param z  [m]
inline Mesh panel(int material, float z = -1.0f, float x = -0.5f)
{
    Mesh mesh = quad({x, 1.0f, z}, {1, 0, 0}, {0, 1, 0}, material);
    mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    return mesh;
}

/// A lit room with one panel of this material.
inline Scene panel_room(const Material& material, float z = -1.0f)
{
    Scene scene = lit_room();
    add_mesh(scene, panel(add_surface(scene, material), z));
    return scene;
}

/// Left half of the first value, right half of the second; 8 x 8 texels.
inline TextureSlot add_halves(Scene& scene, glm::vec4 left, glm::vec4 right)
{
    Texture::Level level;
    level.width = level.height = 8;
    for (int i = 0; i < 64; ++i) {
        const glm::vec4 texel = 65535.0f * (i % 8 < 4 ? left : right) + 0.5f;
        level.texels.push_back({static_cast<std::uint16_t>(texel.r), static_cast<std::uint16_t>(texel.g),
                                static_cast<std::uint16_t>(texel.b), static_cast<std::uint16_t>(texel.a)});
    }
    scene.textures.push_back(make_texture("halves", level));
    TextureSlot slot;
    slot.texture = static_cast<int>(scene.textures.size()) - 1;
    return slot;
}

inline Material metal(float roughness)
{
    Material material;
    material.base_color = glm::vec3(0.9f);
    material.metallic = 1.0f;
    material.roughness = roughness;
    material.double_sided = true;
    return material;
}

/// A room 4 m wide, 3 m high, 4 m deep, with a window of 1 m in its right wall, and a huge panel far behind that.
/// @param roughness  of floor and walls, dielectric
inline Scene window_room(float roughness, float panel_size = 60.0f)
{
    Scene scene;
    Material plaster;
    plaster.base_color = glm::vec3(0.6f, 0.5f, 0.4f);
    plaster.roughness = roughness;
    plaster.specular = 1.0f;
    plaster.double_sided = true;
    const int m = add_surface(scene, plaster);
    add_mesh(scene, quad({-2, 0, -2}, {0, 0, 4}, {4, 0, 0}, m));
    add_mesh(scene, quad({-2, 3, -2}, {4, 0, 0}, {0, 0, 4}, m));
    add_mesh(scene, quad({-2, 0, -2}, {4, 0, 0}, {0, 3, 0}, m));
    add_mesh(scene, quad({-2, 0, 2}, {0, 3, 0}, {4, 0, 0}, m));
    add_mesh(scene, quad({-2, 0, -2}, {0, 3, 0}, {0, 0, 4}, m));
    add_mesh(scene, quad({2, 0, -2}, {0, 0, 4}, {0, 1, 0}, m));
    add_mesh(scene, quad({2, 2, -2}, {0, 0, 4}, {0, 1, 0}, m));
    add_mesh(scene, quad({2, 1, -2}, {0, 0, 1.5f}, {0, 1, 0}, m));
    add_mesh(scene, quad({2, 1, 0.5f}, {0, 0, 1.5f}, {0, 1, 0}, m));
    Material sky;
    sky.base_color = glm::vec3(0.0f);
    sky.emission = glm::vec3(8.0f, 9.0f, 10.0f);
    const float half = 0.5f * panel_size;
    add_mesh(scene, quad({22.0f, -half, -half}, {0, 0, panel_size}, {0, panel_size, 0}, add_surface(scene, sky)));
    scene.cameras = {look_at_camera("camera", {-1.0, 1.5, 1.8}, {0.3, 1.2, -2.0}, 0.9)};
    return scene;
}

/// A metal floor of that roughness in a room whose lamp lights, behind a screen that reaches nearly to the ceiling,
/// what of the room is seen only over the screen's edge.
inline Scene screened_room(float roughness)
{
    Scene scene = room(0.5f);
    scene.lights = {point_light({1.6, 0.6, 0.5}, glm::vec3(9.0f))};
    add_mesh(scene, quad({0.9f, 0.0f, -2.0f}, {0, 2.6f, 0}, {0, 0, 4.0f}, 0));
    add_mesh(scene, quad({-2.0f, 0.002f, 2.0f}, {2.9f, 0, 0}, {0, 0, -4.0f}, add_surface(scene, metal(roughness))));
    scene.cameras = {look_at_camera("floor", {-0.6, 1.6, 1.9}, {-0.4, 0.0, 0.2}, 0.8)};
    return scene;
}

}  // namespace rcs::test
