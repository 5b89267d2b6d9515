// Group D: sizes, places and defects of geometry.
#include <chrono>
#include <cmath>
#include <limits>
#include <random>

#include <glm/gtc/matrix_transform.hpp>

#include "rcs/error.h"
#include "rcs/reference.h"
#include "stability/case_run.h"
#include "stability/export_glb.h"
#include "stability/metamorphic.h"
#include "stability/scenes.h"

namespace rcs::stability {
namespace {

/// More rays than usual: what is compared is renders with other random numbers.
RenderOptions quiet_options(int size)
{
    RenderOptions options = small_options(size);
    settings_of(options).rays = 512;
    options.area_samples = options.penumbra_samples = 64;
    return options;
}

struct Change {
    std::string words;
    Scene scene;
    bool mirror = false;
};

void compare_changes(CaseRun& run, const Scene& plain, const std::vector<Change>& changes, const RenderOptions& options)
{
    const RenderResult expected = run.render(plain, options, "as it is");
    for (const Change& change : changes) {
        RenderResult got = run.render(change.scene, options, change.words);
        if (change.mirror) got.image = mirrored(std::move(got.image));
        compare_pictures(run, got, expected, change.words);
    }
}

void scaled_scene(CaseRun& run)
{
    const Scene room = furnished_room();
    std::vector<Change> changes;
    for (const double factor : {1e-4, 1e-2, 10.0, 1e3, 1e5})
        changes.push_back({"times " + text_of(factor), scaled(room, factor)});
    compare_changes(run, room, changes, quiet_options(64));
    // Without rounding nothing may change but the records' random numbers, which are keyed by place.
    const LayeredImage plain = run.render(room, small_options(48), "as it is, plain options").image;
    for (const int exponent : {-13, 16}) {
        const double factor = std::ldexp(1.0, exponent);
        const LayeredImage other =
            run.render(scaled(room, factor), small_options(48), "times 2^" + std::to_string(exponent)).image;
        for (const char* layer : {"emission", "direct", "albedo", "normal"})
            run.figure(worst_difference(other, plain, layer),
                       std::string("worst pixel of ") + layer + ", times 2^" + std::to_string(exponent));
    }
}

void translated_scene(CaseRun& run)
{
    const Scene room = furnished_room();
    std::vector<Change> changes;
    for (const double by : {1e3, 1e5, 1e6})
        changes.push_back({text_of(by) + " m away", translated(room, {by, 0.5 * by, -by})});
    compare_changes(run, room, changes, quiet_options(64));
}

void turned_scene(CaseRun& run)
{
    const Scene room = furnished_room();
    const glm::dmat4 one(1.0);
    const glm::dmat4 z_up = glm::rotate(one, glm::radians(-90.0), glm::dvec3(1, 0, 0));
    compare_changes(
        run, room,
        {{"rotated", transformed(room, glm::rotate(one, 1.1, glm::normalize(glm::dvec3(1, 2, -0.5))))},
         {"z up", transformed(room, z_up)},
         {"mirrored", transformed(room, glm::scale(one, glm::dvec3(-1, 1, 1))), true},
         {"mirrored in z and turned", transformed(room, z_up * glm::scale(one, glm::dvec3(1, 1, -1))), true}},
        quiet_options(64));
}

/// A mesh with triangles that are none, and what they were made of.
Mesh with_defects(const Mesh& plain)
{
    Mesh mesh = plain;
    const auto n = static_cast<unsigned>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(),
                          {{0.3f, 0.0f, 0.0f}, {0.6f, 0.0f, 0.0f}, {0.9f, 0.0f, 0.0f}, {5, 5, 5}});
    std::vector<glm::uvec3> triangles;
    for (const glm::uvec3& t : plain.triangles) {
        triangles.push_back(t);
        triangles.push_back({t.x, t.y, t.y});    // a line
        triangles.push_back({t.z, t.z, t.z});    // a point
        triangles.push_back({n, n + 1, n + 2});  // collinear points
    }
    mesh.triangles = triangles;
    return mesh;
}

void degenerate_triangles(CaseRun& run)
{
    const Scene plain = furnished_room();
    Scene defective = plain;
    for (Mesh& mesh : defective.meshes) mesh = with_defects(mesh);
    const RenderResult expected = run.render(plain, small_options(64), "without them");
    const RenderResult in_code = run.render(defective, small_options(64), "with them");
    run.figure(worst_difference(in_code.image, expected.image, "beauty"), "worst pixel, scene made in code");
    // Through a file: the loader leaves them out and says so.
    export_glb(defective, run.folder() + "/defects.glb");
    export_glb(plain, run.folder() + "/plain.glb");
    std::string said;
    const LogFunction log = [&](LogLevel, std::string_view line) { said += std::string(line) + "\n"; };
    const RenderResult from_file =
        run.render(load_scene(run.folder() + "/defects.glb", log), small_options(64), "with them, from a file");
    const RenderResult plain_file =
        run.render(load_scene(run.folder() + "/plain.glb"), small_options(64), "without them, from a file");
    std::string layer;
    run.require(same_bits(from_file.image, plain_file.image, layer),
                "from a file layer " + layer + " has other bits than without them");
    run.require(said.find("degenerate") != std::string::npos || said.find("area") != std::string::npos,
                "the log does not name them: " + said);
}

void coincident_faces(CaseRun& run)
{
    Scene scene;
    const int red = add_material(scene, {0.8f, 0.1f, 0.1f}, glm::vec3(0.0f), true);
    const int blue = add_material(scene, {0.1f, 0.1f, 0.8f}, glm::vec3(0.0f), true);
    const int grey = add_material(scene, glm::vec3(0.6f));
    add_mesh(scene, box({-2, -1, -2}, {2, 3, 3}, grey, Facing::inwards));
    add_mesh(scene, quad({-1, 0, -1}, {2, 0, 0.7f}, {0, 1.7f, 0.3f}, red));
    add_mesh(scene, quad({-1, 0, -1}, {2, 0, 0.7f}, {0, 1.7f, 0.3f}, blue));
    scene.lights = {point_light({0.5, 2.0, 2.0}, glm::vec3(4.0f))};
    scene.cameras = {look_at_camera("camera", {0, 1, 2.5}, {0, 0.8, -1}, 0.9)};
    const LayeredImage image = run.render(scene, small_options(96)).image;
    int is_red = 0, is_blue = 0, mixed = 0;
    for (std::size_t i = 0; i < 96 * 96; ++i) {
        const float* a = image.layers.at("albedo").pixels.data() + 3 * i;
        is_red += a[0] > 0.75f && a[2] < 0.15f;
        is_blue += a[2] > 0.75f && a[0] < 0.15f;
        mixed += a[0] < 0.55f && a[0] > 0.15f;
    }
    run.require(is_red + is_blue > 500, "the faces are hardly in view");
    run.require(mixed == 0, std::to_string(mixed) + " pixels mix the two");
    run.figure(static_cast<double>(std::min(is_red, is_blue)) / std::max(is_red + is_blue, 1),
               "pixels of the other face");

    // Inside out, or seen from both sides: a closed box is lit alike.
    Scene inwards = furnished_room();
    Scene twisted = inwards;
    for (glm::uvec3& t : twisted.meshes[1].triangles) std::swap(t.y, t.z);
    for (Scene* s : {&inwards, &twisted})
        s->materials[static_cast<std::size_t>(s->meshes[1].material)].double_sided = true;
    const RenderResult a = run.render(twisted, quiet_options(64), "block inside out"),
                       b = run.render(inwards, quiet_options(64), "block");
    compare_pictures(run, a, b, "block inside out");
}

/// The room with a heap of tiny boxes, or as good as without walls: on a ground 1,000 km wide.
Scene heap(int count)
{
    Scene scene = furnished_room();
    Mesh grain = box({-0.004f, 0.0f, -0.004f}, {0.004f, 0.008f, 0.004f}, 1);
    const int mesh = static_cast<int>(scene.meshes.size());
    scene.meshes.push_back(grain);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    for (int i = 0; i < count; ++i) {
        const glm::dvec3 at(-1.9 + 3.8 * unit(random), 0.3 * unit(random) * unit(random), -1.9 + 3.8 * unit(random));
        scene.instances.push_back(
            {"grain", mesh, glm::rotate(glm::translate(glm::dmat4(1.0), at), 6.0 * unit(random), glm::dvec3(0, 1, 0))});
    }
    return scene;
}

Scene wide_ground()
{
    Scene scene = furnished_room();
    scene.sky_radiance = glm::vec3(0.3f);
    // One triangle under millimetre detail, instead of the room around it.
    Mesh ground;
    ground.positions = {{-5e5f, 0, -5e5f}, {0, 0, 5e5f}, {5e5f, 0, -5e5f}};
    ground.triangles = {{0, 1, 2}};
    ground.material = 0;
    scene.meshes[0] = ground;
    for (int i = 0; i < 30; ++i)
        add_mesh(scene, box({0.3f, 0.0f, 0.3f + 0.02f * static_cast<float>(i)},
                            {0.9f, 0.002f * static_cast<float>(i + 1), 0.31f + 0.02f * static_cast<float>(i)}, 1));
    scene.cameras = {look_at_camera("camera", {1.2, 0.9, 1.8}, {0.2, 0.2, 0.0}, 0.9)};
    return scene;
}

void against_path_tracer(CaseRun& run, const Scene& scene, const std::string& words)
{
    const int size = 64;
    const LayeredImage image = run.render(scene, quiet_options(size), words).image;
    const RayScene rays = build_ray_scene(scene, run.pool());
    ReferenceOptions options;
    options.samples = 512;
    const LayeredImage truth = render_reference(rays, view_of(scene.cameras[0], size, size), options, run.pool());
    for (const char* layer : {"direct", "indirect"})
        run.figure(difference_of_means(image, truth, layer), words + ", mean of " + layer + " light");
}

void tiny_beside_huge(CaseRun& run)
{
    against_path_tracer(run, wide_ground(), "ground 1,000 km wide");
    against_path_tracer(run, heap(20'000), "20,000 instances");
}

void million_instances(CaseRun& run)
{
    const RenderResult result = run.render(heap(1'000'000), small_options(64), "a million instances");
    run.figure(0.0, "renders");
    run.note(std::to_string(result.records.size()) + " records");
}

void gaps_and_foliage(CaseRun& run)
{
    const auto begin = std::chrono::steady_clock::now();
    Scene blinds = furnished_room();
    const int slat = add_material(blinds, glm::vec3(0.7f), glm::vec3(0.0f), true);
    Mesh slats;
    slats.material = slat;
    for (int i = 0; i < 400; ++i)  // gaps of 0.1 mm
        merge(slats, quad({-1.0f + 0.005f * static_cast<float>(i), 0.5f, 0.6f}, {0.0049f, 0, 0}, {0, 2, 0}, slat));
    add_mesh(blinds, slats);
    Scene leaves = furnished_room();
    Material leaf;
    leaf.name = "leaf";
    leaf.base_color = {0.2f, 0.6f, 0.2f};
    leaf.double_sided = true;
    leaf.alpha_mode = AlphaMode::mask;
    leaf.alpha_cutoff = 0.5f;
    const int green = add_material(leaves, leaf);
    Mesh cards;
    std::mt19937 random(3);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    for (int i = 0; i < 100'000; ++i) {
        const glm::vec3 at(-1.8f + 3.6f * unit(random), 0.2f + 2.0f * unit(random), -1.9f + 1.5f * unit(random));
        const glm::vec3 u = 0.02f * (glm::vec3(unit(random), unit(random), unit(random)) - 0.5f);
        const glm::vec3 v = 0.02f * (glm::vec3(unit(random), unit(random), unit(random)) - 0.5f);
        merge(cards, quad(at, u, v, green));
        // Alpha falls across the card: half of it is cut off.
        cards.colors.insert(cards.colors.end(), {{1, 1, 1, 0}, {1, 1, 1, 1}, {1, 1, 1, 1}, {1, 1, 1, 0}});
    }
    cards.material = green;
    add_mesh(leaves, cards);
    for (const Scene* scene : {&blinds, &leaves}) {
        const RenderResult result = run.render(*scene, small_options(64), scene == &blinds ? "slats" : "cards");
        run.figure(static_cast<double>(result.records.size()) / (64.0 * 64.0),
                   scene == &blinds ? "records a pixel, slats" : "records a pixel, cards");
    }
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    run.require(seconds < 120.0, "took " + text_of(seconds) + " s");
}

}  // namespace

std::vector<SuiteCase> geometry_cases()
{
    const std::string group = "geometry";
    const std::string noise =
        "of the picture; other random numbers at 512 rays a record: noise of the mean of 64 x 64 pixels";
    return {
        {{"D1", group, "The same room scaled by 1e-4 to 1e5, and by powers of two", "constants in metres",
          "same picture; powers of two: direct light the same at every pixel", 0.005, noise, true},
         scaled_scene},
        {{"D2", group, "The same room 1e3, 1e5 and 1e6 m away", "coarse floats far from zero", "same picture", 0.005,
          noise, true},
         translated_scene},
        {{"D3", group, "Rotated, z up, mirrored, mirrored and turned", "axes treated differently, winding",
          "same picture", 0.005, noise, true},
         turned_scene},
        {{"D4", group, "Triangles without area, unused vertices", "division by their area",
          "ignored: same picture, same bits from a file, counted in the log", 1e-4, "none of them catches a ray", true},
         degenerate_triangles},
        {{"D6", group, "Coincident faces of two colours; a block inside out", "speckle",
          "one of the two faces everywhere; same light", 0.005,
          "of pixels for the faces; noise of the mean for the block", true},
         coincident_faces},
        {{"D8", group, "Millimetre detail on a triangle 1,000 km wide; 20,000 tiny instances",
          "rays that start below the surface, cells as large as the scene", "same as the path tracer", 0.02,
          "of the mean of direct and of indirect light", false},
         tiny_beside_huge},
        {{"D8b", group, "A million tiny instances", "memory, time", "a picture", 0.0, "nothing is measured", false},
         million_instances},
        {{"D9", group, "Slats 0.1 mm apart; 100,000 alpha-tested cards", "records without end",
          "ends in bounded time and records", 1.0, "records a pixel: one each at the most", true},
         gaps_and_foliage},
    };
}

}  // namespace rcs::stability
