#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include <glm/gtc/constants.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "scene/demo_atrium_parts.h"
#include "scene/demo_scenes.h"
#include "scene/demo_shapes.h"
#include "scene/texture.h"
#include "util/random.h"

namespace rcs {
namespace {

// A court of 6 x 4 bays, open to the sky, between two storeys of arcades [m]. y = 0 is the arcade's
// floor; the court lies two steps lower.
constexpr int kBaysX = 6;
constexpr int kBaysZ = 4;
constexpr float kCourtX = 0.5f * kBay * kBaysX;  ///< axis of the columns
constexpr float kCourtZ = 0.5f * kBay * kBaysZ;
constexpr float kArcade = 3.2f;  ///< from there to the outer wall
constexpr float kWallX = kCourtX + kArcade;
constexpr float kWallZ = kCourtZ + kArcade;
constexpr float kStep = 0.15f;

constexpr Storey kGround{0.0f, 2.7f, 4.6f, 0.24f};
constexpr Storey kUpper{4.9f, 7.0f, 8.8f, 0.18f};
constexpr float kSlab = kUpper.floor - kGround.top;

struct Materials {
    int stone, trim, tiles, paving, plaster, terracotta, blue, wood, water;
    std::array<int, 4> cloth;
};

/// Repeatable noise in [-1, 1] for cell (x, y).
float noise(int x, int y, std::uint64_t salt)
{
    const std::uint64_t key = static_cast<std::uint32_t>(x) | std::uint64_t{static_cast<std::uint32_t>(y)} << 32;
    return 2.0f * to_unit_float(static_cast<std::uint32_t>(mix64(key ^ mix64(salt)) >> 32)) - 1.0f;
}

constexpr int kTextureSide = 512;

/// A square picture from shade(x, y), texels.
Texture draw(const char* name, glm::vec3 (*shade)(int x, int y))
{
    std::vector<glm::vec3> texels;
    texels.reserve(static_cast<std::size_t>(kTextureSide) * kTextureSide);
    for (int y = 0; y < kTextureSide; ++y) {
        for (int x = 0; x < kTextureSide; ++x) texels.push_back(shade(x, y));
    }
    return make_texture(name, kTextureSide, kTextureSide, texels);
}

int add_texture(Scene& scene, const Texture& texture)
{
    scene.textures.push_back(texture);
    return static_cast<int>(scene.textures.size() - 1);
}

/// 8 x 8 tiles, light and dark in turn, each a little different, with joints.
glm::vec3 tile_color(int x, int y)
{
    constexpr int kTile = kTextureSide / 8;
    const int column = x / kTile;
    const int row = y / kTile;
    const int edge = std::min({x % kTile, kTile - 1 - x % kTile, y % kTile, kTile - 1 - y % kTile});
    if (edge < 1) return {0.24f, 0.22f, 0.20f};
    const glm::vec3 light(0.70f, 0.64f, 0.54f);
    const glm::vec3 dark(0.42f, 0.27f, 0.20f);
    const float shade = 1.0f + 0.10f * noise(column, row, 1) + 0.04f * noise(x / 2, y / 2, 2);
    return ((column + row) % 2 == 0 ? light : dark) * shade;
}

/// 4 courses of 2 blocks, every other course shifted by half a block.
glm::vec3 ashlar_color(int x, int y)
{
    constexpr int kCourse = kTextureSide / 4;
    constexpr int kBlock = kTextureSide / 2;
    const int row = y / kCourse;
    const int shifted = (x + (row % 2) * kBlock / 2) % kTextureSide;
    const int edge =
        std::min({shifted % kBlock, kBlock - 1 - shifted % kBlock, y % kCourse, kCourse - 1 - y % kCourse});
    const float joint = edge < 3 ? 0.72f : 1.0f;
    const float shade = 1.0f + 0.06f * noise(shifted / kBlock, row, 3) + 0.03f * noise(x / 3, y / 3, 4);
    return glm::vec3(0.93f) * joint * shade;
}

Materials add_materials(Scene& scene)
{
    // Drawn once for the court at all times.
    static const Texture tiles = draw("tiles", tile_color), ashlar = draw("ashlar", ashlar_color);
    const int tile_texture = add_texture(scene, tiles);
    const int ashlar_texture = add_texture(scene, ashlar);
    const auto textured = [&](const char* name, glm::vec3 color, int texture) {
        const int material = add_material(scene, name, color);
        scene.materials[static_cast<std::size_t>(material)].base_color_texture.texture = texture;
        return material;
    };
    Materials m{};
    m.stone = textured("stone", {0.66f, 0.58f, 0.46f}, ashlar_texture);
    m.trim = add_material(scene, "trim", {0.60f, 0.55f, 0.47f});
    m.tiles = textured("tiles", glm::vec3(1.0f), tile_texture);
    m.paving = textured("paving", {0.54f, 0.49f, 0.43f}, ashlar_texture);
    m.plaster = add_material(scene, "plaster", {0.78f, 0.62f, 0.38f});
    m.terracotta = add_material(scene, "terracotta", {0.68f, 0.30f, 0.18f});
    m.blue = add_material(scene, "blue", {0.24f, 0.36f, 0.48f});
    m.wood = add_material(scene, "wood", {0.20f, 0.11f, 0.06f});
    m.water = add_material(scene, "water", {0.08f, 0.16f, 0.17f});
    m.cloth = {add_material(scene, "red cloth", {0.62f, 0.06f, 0.05f}),
               add_material(scene, "gold cloth", {0.75f, 0.48f, 0.08f}),
               add_material(scene, "blue cloth", {0.06f, 0.14f, 0.50f}),
               add_material(scene, "green cloth", {0.07f, 0.34f, 0.14f})};
    for (Material& material : scene.materials) material.double_sided = true;
    return m;
}

glm::dmat4 placed(glm::dvec3 position, double degrees = 0.0)
{
    return glm::rotate(glm::translate(glm::dmat4(1.0), position), glm::radians(degrees), glm::dvec3(0.0, 1.0, 0.0));
}

/// Calls place(position, degrees) at the middle of each bay, on the axis of the columns; the bay's +Z
/// side faces the court.
template <class Place>
void for_each_bay(const Place& place)
{
    for (int i = 0; i < kBaysX; ++i) {
        const double x = kBay * (i + 0.5) - kCourtX;
        place(glm::dvec3(x, 0.0, -kCourtZ), 0.0);
        place(glm::dvec3(x, 0.0, kCourtZ), 180.0);
    }
    for (int i = 0; i < kBaysZ; ++i) {
        const double z = kBay * (i + 0.5) - kCourtZ;
        place(glm::dvec3(-kCourtX, 0.0, z), 90.0);
        place(glm::dvec3(kCourtX, 0.0, z), -90.0);
    }
}

/// The same between neighbouring bays, corners left out.
template <class Place>
void for_each_column(const Place& place)
{
    for (int i = 1; i < kBaysX; ++i) {
        const double x = kBay * i - kCourtX;
        place(glm::dvec3(x, 0.0, -kCourtZ), 0.0);
        place(glm::dvec3(x, 0.0, kCourtZ), 180.0);
    }
    for (int i = 1; i < kBaysZ; ++i) {
        const double z = kBay * i - kCourtZ;
        place(glm::dvec3(-kCourtX, 0.0, z), 90.0);
        place(glm::dvec3(kCourtX, 0.0, z), -90.0);
    }
}

void add_storey(Scene& scene, const Materials& m, const Storey& storey, const char* name)
{
    const double floor = storey.floor;
    const int column = add_mesh(scene, std::string(name) + " column", m.trim,
                                column_mesh(storey.column_radius, storey.spring - storey.floor));
    const int arch = add_mesh(scene, std::string(name) + " arch", m.stone, arch_mesh(storey));
    for_each_column([&](glm::dvec3 position, double) {
        add_instance(scene, std::string(name) + " column", column, placed(position + glm::dvec3(0.0, floor, 0.0)));
    });
    for_each_bay([&](glm::dvec3 position, double degrees) {
        add_instance(scene, std::string(name) + " arch", arch, placed(position, degrees));
    });
    Mesh piers;
    for (const float x : {-kCourtX, kCourtX}) {
        for (const float z : {-kCourtZ, kCourtZ}) {
            const float half = 0.3f;
            add_box(piers, {x - half, storey.floor, z - half}, {x + half, storey.top, z + half});
        }
    }
    scale_uvs(piers, 0.5f);
    add_object(scene, std::string(name) + " piers", m.stone, piers);
}

/// A frame between two rectangles about the middle of the court, from height y0 to y1.
void add_ring(Mesh& mesh, glm::vec2 inner, glm::vec2 outer, float y0, float y1)
{
    add_box(mesh, {-outer.x, y0, -outer.y}, {outer.x, y1, -inner.y});
    add_box(mesh, {-outer.x, y0, inner.y}, {outer.x, y1, outer.y});
    add_box(mesh, {-outer.x, y0, -inner.y}, {-inner.x, y1, inner.y});
    add_box(mesh, {inner.x, y0, -inner.y}, {outer.x, y1, inner.y});
}

void add_floors(Scene& scene, const Materials& m)
{
    const glm::vec2 court(kCourtX, kCourtZ);
    const glm::vec2 wall(kWallX, kWallZ);
    const float edge = 0.55f;  // from the columns' axis to the first step
    const float tread = 0.34f;
    const float court_y = -2.0f * kStep;

    Mesh arcade;
    add_ring(arcade, court - edge, wall, -0.5f, 0.0f);
    scale_uvs(arcade, 0.25f);
    add_object(scene, "arcade floor", m.tiles, arcade);
    Mesh steps;
    add_ring(steps, court - edge - tread, court - edge, -0.5f, -kStep);
    add_object(scene, "step", m.trim, steps);
    Mesh paving;
    const glm::vec2 half = court - edge - tread;
    add_quad(paving, {-half.x, court_y, half.y}, {half.x, court_y, half.y}, {half.x, court_y, -half.y},
             {-half.x, court_y, -half.y});
    scale_uvs(paving, 0.4f);
    add_object(scene, "paving", m.paving, paving);

    Mesh slabs;  // each with a cornice towards the court
    add_ring(slabs, court - 0.42f, wall, kGround.top, kGround.top + kSlab);
    add_ring(slabs, court - 0.34f, court, kGround.top - 0.12f, kGround.top);
    add_ring(slabs, court - 0.55f, wall + 0.3f, kUpper.top, kUpper.top + 0.25f);
    add_ring(slabs, court - 0.42f, court, kUpper.top - 0.14f, kUpper.top);
    add_object(scene, "slabs", m.trim, slabs);
}

void add_walls(Scene& scene, const Materials& m)
{
    const float x = kWallX, z = kWallZ, low = -0.5f, high = kUpper.top;
    const auto wall = [&](const char* name, int material, glm::vec3 min, glm::vec3 max) {
        Mesh mesh;
        add_box(mesh, min, max);
        add_object(scene, name, material, mesh);
    };
    const float t = 0.3f;
    wall("north wall", m.terracotta, {-x - t, low, -z - t}, {x + t, high, -z});
    wall("south wall", m.plaster, {-x - t, low, z}, {x + t, high, z + t});
    wall("west wall", m.plaster, {-x - t, low, -z}, {-x, high, z});
    wall("east wall", m.blue, {x, low, -z}, {x + t, high, z});

    Mesh bands;  // a dado along each storey's floor, and a course at the height of its capitals
    for (const Storey& storey : {kGround, kUpper}) {
        const glm::vec2 outer(x, z);
        add_ring(bands, outer - 0.07f, outer, storey.floor, storey.floor + 0.45f);
        add_ring(bands, outer - 0.09f, outer, storey.spring + 0.05f, storey.spring + 0.22f);
    }
    add_object(scene, "bands", m.trim, bands);

    Mesh doors;
    Mesh frames;
    for (const float at : {-1.5f * kBay, 1.5f * kBay}) {
        for (const float side : {-1.0f, 1.0f}) {
            const float face = side * z;
            const auto box = [&](Mesh& mesh, float half, float top, float depth) {
                add_box(mesh, {at - half, 0.0f, std::min(face, face - side * depth)},
                        {at + half, top, std::max(face, face - side * depth)});
            };
            box(frames, 0.75f, 2.55f, 0.10f);
            box(doors, 0.60f, 2.40f, 0.13f);
        }
    }
    add_object(scene, "door frames", m.trim, frames);
    add_object(scene, "doors", m.wood, doors);
}

void add_decoration(Scene& scene, const Materials& m)
{
    const int balustrade = add_mesh(scene, "balustrade", m.trim, balustrade_mesh());
    for_each_bay([&](glm::dvec3 position, double degrees) {
        add_instance(scene, "balustrade", balustrade,
                     placed(position + glm::dvec3(0.0, double{kUpper.floor}, 0.0), degrees));
    });
    std::array<int, 4> banners{};
    for (std::size_t i = 0; i < banners.size(); ++i) {
        banners[i] = add_mesh(scene, "banner", m.cloth[i], banner_mesh());
    }
    std::size_t next = 0;
    for_each_column([&](glm::dvec3 position, double degrees) {
        // In front of the balustrade and of the slab below it.
        const glm::dmat4 hung =
            placed(position + glm::dvec3(0.0, kUpper.floor + 0.86, 0.0), degrees) * placed({0.0, 0.0, 0.56});
        if (next % 3 != 2) add_instance(scene, "banner", banners[(next + next / 4) % banners.size()], hung);
        ++next;
    });

    const std::array<glm::vec2, 10> basin = {{{1.55f, -0.30f},
                                              {1.55f, -0.15f},
                                              {1.35f, -0.15f},
                                              {1.25f, 0.05f},
                                              {1.40f, 0.38f},
                                              {1.40f, 0.46f},
                                              {1.22f, 0.46f},
                                              {1.15f, 0.20f},
                                              {0.50f, 0.16f},
                                              {0.0f, 0.16f}}};
    const std::array<glm::vec2, 12> vase = {{{0.24f, 0.15f},
                                             {0.24f, 0.40f},
                                             {0.14f, 0.48f},
                                             {0.11f, 0.95f},
                                             {0.16f, 1.02f},
                                             {0.55f, 1.20f},
                                             {0.60f, 1.27f},
                                             {0.54f, 1.27f},
                                             {0.14f, 1.14f},
                                             {0.09f, 1.55f},
                                             {0.13f, 1.66f},
                                             {0.0f, 1.80f}}};
    Mesh fountain;
    add_lathe(fountain, basin, 32);
    add_lathe(fountain, vase, 20);
    add_object(scene, "fountain", m.trim, fountain);
    const std::array<glm::vec2, 2> surface = {{{1.2f, 0.36f}, {0.0f, 0.36f}}};
    Mesh water;
    add_lathe(water, surface, 32);
    add_object(scene, "water", m.water, water);
}

}  // namespace

Scene make_atrium()
{
    Scene scene;
    scene.name = "atrium";
    const Materials m = add_materials(scene);
    add_floors(scene, m);
    add_walls(scene, m);
    add_storey(scene, m, kGround, "ground");
    add_storey(scene, m, kUpper, "upper");
    add_decoration(scene, m);

    PunctualLight sun;
    sun.name = "sun";
    sun.kind = LightKind::directional;
    sun.intensity = 14.0f * glm::vec3(1.0f, 0.93f, 0.82f);
    sun.direction = glm::normalize(glm::dvec3(0.52, -0.80, -0.42));
    scene.lights.push_back(sun);
    scene.sky_radiance = {0.50f, 0.62f, 0.82f};

    scene.cameras.push_back(look_at_camera("court", {-7.2, 2.2, 4.4}, {4.0, 2.9, -3.0}, glm::radians(64.0)));
    scene.cameras.push_back(look_at_camera("arcade", {-6.6, 1.7, -8.3}, {4.0, 2.1, -6.3}, glm::radians(66.0)));
    return scene;
}

}  // namespace rcs
