// Group B: pictures whose records have to serve edges, creases and neighbours of another light.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "placement/placement.h"
#include "rcs/ray_scene.h"
#include "rcs/reference.h"
#include "splat/splat_choice.h"
#include "stability/case_run.h"
#include "stability/scenes.h"

namespace rcs::stability {
namespace {

/// Two walls that meet at an angle of two degrees, lit from the open side.
Scene crease()
{
    Scene scene;
    const int wall = add_material(scene, glm::vec3(0.7f), glm::vec3(0.0f), true);
    const float rise = 2.0f * std::tan(glm::radians(2.0f));
    add_mesh(scene, quad({0, 0, -1}, {0, 0, 2}, {2, 0, 0}, wall));
    add_mesh(scene, quad({0, 0, -1}, {2, rise, 0}, {0, 0, 2}, wall));
    scene.sky_radiance = glm::vec3(1.0f);
    scene.cameras = {look_at_camera("camera", {2.5, 0.04, 0.1}, {0, 0.0, 0}, 0.2)};
    return scene;
}

void record_in_a_crease(CaseRun& run)
{
    const RenderOptions options = small_options(64);
    const RenderResult result = run.render(crease(), options);
    const int seen = spread_of(result.image, "beauty").pixels;
    run.require(seen > 500, "the crease is hardly in view: " + std::to_string(seen) + " pixels");
    run.figure(static_cast<double>(result.records.size()) / seen, "records a pixel");
    const float least = std::min(RecordSettings{}.steepest * options.min_reach, kLeastReach);
    for (const Record& r : result.records)
        run.require(r.spacing_radius >= 0.999f * settings_or_default(options).error_tolerance * least * r.footprint,
                    "a record's radius of " + text_of(static_cast<double>(r.spacing_radius)) +
                        " m is below the least of pixels");
}

void open_plane(CaseRun& run)
{
    Scene scene;
    add_mesh(scene, quad({-50, 0, -50}, {0, 0, 100}, {100, 0, 0}, add_material(scene, glm::vec3(0.5f))));
    scene.sky_radiance = glm::vec3(3.0f);
    scene.cameras = {look_at_camera("camera", {0, 2, 5}, {0, 0, -3}, 0.9)};
    for (const SplatMethod method : kSplatMethods) {
        const RenderResult result = run.render(scene, small_options(64, method));
        run.figure(worst_deviation(result.image, "irradiance", 3.0 * kPi),
                   "irradiance, worst pixel, " + name_of(method));
        for (const Record& r : result.records) {
            run.require(std::isinf(r.harmonic_mean_distance), "a record met something on an open plane");
            run.require(std::isfinite(r.spacing_radius) && r.spacing_radius > 0.0f, "a record has no finite radius");
        }
    }
}

/// A wall patch of 20 cm, lit by a sun that the floor gets nothing of, reflects radiance 50 on to the floor.
Scene bright_spot()
{
    Scene scene;
    const int floor = add_material(scene, glm::vec3(0.5f));
    add_mesh(scene, quad({0, 0, -5}, {0, 0, 10}, {10, 0, 0}, floor));
    add_mesh(scene, quad({0, 0.3f, -0.1f}, {0, 0.2f, 0}, {0, 0, 0.2f}, floor));
    PunctualLight sun;
    sun.name = "sun";
    sun.kind = LightKind::directional;
    sun.direction = {-1.0, 0.0, 0.0};
    sun.intensity = glm::vec3(static_cast<float>(100.0 * kPi));
    scene.lights = {sun};
    Camera camera = look_at_camera("camera", {0.6, 1.5, 0.0}, {0.6, 0.0, 0.0}, 0.8, {0, 0, -1});
    camera.projection = Projection::orthographic;
    camera.ymag = 0.59;
    scene.cameras = {camera};
    return scene;
}

void steep_gradient(CaseRun& run)
{
    const int size = 64;
    const std::vector<glm::dvec3> spot = {{0, 0.3, -0.1}, {0, 0.5, -0.1}, {0, 0.5, 0.1}, {0, 0.3, 0.1}};
    for (const float accuracy : {0.2f, 0.05f}) {
        RenderOptions options = small_options(size);
        settings_of(options).rays = 4096;
        settings_of(options).error_tolerance = accuracy;
        const LayeredImage image =
            run.render(bright_spot(), options, "accuracy " + text_of(static_cast<double>(accuracy))).image;
        double error = 0.0, sum = 0.0, peak = 0.0;
        std::vector<double> columns(size, 0.0);  // of the middle rows
        for (int y = 0; y < size; ++y) {
            for (int x = 0; x < size; ++x) {
                const glm::dvec3 p(0.6 + 0.59 * ((x + 0.5) / size * 2.0 - 1.0), 0.0,
                                   0.59 * ((y + 0.5) / size * 2.0 - 1.0));
                const double expected = 50.0 * polygon_irradiance(spot, p, {0, 1, 0});
                const double got = static_cast<double>(image.layers.at("irradiance").at(x, y)[0]);
                error += std::abs(got - expected);
                sum += expected;
                peak = std::max(peak, expected);
                if (std::abs(y - size / 2) <= 4) columns[static_cast<std::size_t>(x)] += got / 9.0;
            }
        }
        // Truth rises once and falls once; what goes up and down besides is a ring.
        double variation = 0.0;
        for (std::size_t x = 1; x < columns.size(); ++x) variation += std::abs(columns[x] - columns[x - 1]);
        const double highest = *std::max_element(columns.begin(), columns.end());
        const double rings = (variation - (2.0 * highest - columns.front() - columns.back())) / peak;
        const std::string words = ", accuracy " + text_of(static_cast<double>(accuracy));
        run.figure(rings, "rings, of the peak" + words);
        run.figure(highest / peak - 1.0, "above the peak" + words);
        if (accuracy < 0.1f) run.figure(error / sum, "mean error over the floor" + words);
    }
}

/// A closed room, seen from above through the ceiling's back, cut in two by a sheet; the lamp is in the left half.
Scene divided_room()
{
    Scene scene;
    const int wall = add_material(scene, glm::vec3(0.7f));
    const int sheet = add_material(scene, glm::vec3(0.7f), glm::vec3(0.0f), true);
    add_mesh(scene, box({-2, 0, -2}, {2, 2, 2}, wall, Facing::inwards));
    add_mesh(scene, quad({0, 0, -2}, {0, 2, 0}, {0, 0, 4}, sheet));
    scene.lights = {point_light({-1, 1, 0}, glm::vec3(2.0f))};
    Camera camera = look_at_camera("camera", {0, 6, 0}, {0, 0, 0}, 0.8, {0, 0, -1});
    camera.projection = Projection::orthographic;
    camera.ymag = 1.99;
    scene.cameras = {camera};
    return scene;
}

void light_through_sheet(CaseRun& run, int bounces)
{
    const int size = 96;
    RenderOptions options = small_options(size);
    options.bounces = bounces;
    const LayeredImage image = run.render(divided_room(), options).image;
    double lit = 0.0, dark = 0.0, near = 0.0;
    // Records are no closer than pixels allow, and reach twice as far: what they say across the sheet ends there.
    const int reach =
        static_cast<int>(std::ceil(2.0f * settings_or_default(options).error_tolerance * options.min_reach));
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x)
            // The sheet itself lies between two columns.
            (x < size / 2           ? lit
             : x < size / 2 + reach ? near
                                    : dark) += static_cast<double>(image.layers.at("irradiance").at(x, y)[0]);
    run.require(lit > 0.0, "the lit half is dark");
    run.figure(dark / lit, "dark half over lit half, beyond " + std::to_string(reach) + " px from the sheet");
    run.note("within them " + text_of(near / lit));
}

void thin_wall(CaseRun& run) { light_through_sheet(run, 1); }
void thin_wall_with_cells(CaseRun& run) { light_through_sheet(run, 4); }

/// Stairs of 1 cm, two floors 1 mm apart, and a folded sheet, in a room with a lamp.
Scene near_surfaces()
{
    Scene scene = furnished_room();
    const int paper = add_material(scene, glm::vec3(0.8f), glm::vec3(0.0f), true);
    for (int i = 0; i < 12; ++i)
        add_mesh(scene, box({0.5f + 0.01f * static_cast<float>(i), 0.0f, 0.3f},
                            {1.5f, 0.01f * static_cast<float>(i + 1), 0.9f}, paper));
    add_mesh(scene, quad({-1.9f, 0.001f, 0.5f}, {0, 0, 1}, {1, 0, 0}, paper));
    Mesh folded;
    folded.material = paper;
    for (int i = 0; i < 24; ++i) {
        const auto at = [](int k) {
            return glm::vec3(-1.2f + 0.04f * static_cast<float>(k), k % 2 == 0 ? 0.05f : 0.12f, 1.0f);
        };
        merge(folded, quad(at(i), {0, 0, 0.6f}, at(i + 1) - at(i), paper));
    }
    add_mesh(scene, folded);
    scene.cameras = {look_at_camera("camera", {0.5, 1.1, 1.9}, {0.2, 0.0, 0.7}, 0.9)};
    return scene;
}

void surfaces_close_to_each_other(CaseRun& run)
{
    const Scene scene = near_surfaces();
    const int size = 96;
    std::vector<LayeredImage> renders;
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        RenderOptions options = small_options(size);
        options.seed = seed;
        renders.push_back(run.render(scene, options, "seed " + std::to_string(seed)).image);
    }
    const RayScene rays = build_ray_scene(scene, run.pool());
    ReferenceOptions reference;
    reference.samples = 256;
    const LayeredImage truth = render_reference(rays, view_of(scene.cameras[0], size, size), reference, run.pool());
    // Wider than the 6 px that records reach at least (B6): light on the wrong surface shows in some block.
    constexpr int kBlock = 8;
    run.figure(worst_block(mean_over_seeds(renders), truth, kBlock), "worst block of 8 x 8 pixels, of its light");
    run.note("mean of the picture " + text_of(difference_of_means(renders[0], truth, "indirect")));
}

void quickly_curved_surface(CaseRun& run)
{
    Scene scene;
    add_mesh(scene, icosphere(glm::vec3(0.0f), 1.0f, 4, add_material(scene, glm::vec3(0.6f))));
    scene.sky_radiance = glm::vec3(1.0f);
    scene.cameras = {look_at_camera("camera", {0, 0, 12}, {0, 0, 0}, 0.5)};
    for (const SplatMethod method : kSplatMethods) {
        const RenderResult result = run.render(scene, small_options(74, method));
        int seen = 0, unserved = 0;
        for (int y = 0; y < 74; ++y)
            for (int x = 0; x < 74; ++x)
                if (result.image.layers.at("beauty").at(x, y)[3] == 1.0f) {
                    ++seen;
                    unserved += result.image.layers.at("records").at(x, y)[0] < 1.0f;
                }
        run.figure(static_cast<double>(unserved) / seen,
                   "pixels without a record, of " + std::to_string(seen) + ", " + name_of(method));
        run.require(seen > 300 && seen < 700, "the sphere has " + std::to_string(seen) + " pixels, not some 450");
    }
}

void leaning_normals(CaseRun& run)
{
    // Light that arrives where both normals see it: a lune of the sky, pi (1 + cos) / 2 of it. Normals are bent to
    // at least cos = 0.1 towards the face.
    for (const double degrees : {0.0, 30.0, 65.0, 89.0, 120.0}) {
        const double angle = glm::radians(degrees);
        Scene scene;
        Mesh plane = quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, add_material(scene, glm::vec3(0.5f)));
        plane.normals.assign(4, glm::normalize(glm::vec3(std::sin(angle), std::cos(angle), 0.0)));
        add_mesh(scene, plane);
        scene.sky_radiance = glm::vec3(1.0f);
        Camera camera = look_at_camera("camera", {0, 1, 0}, {0, 0, 0}, 0.8, {0, 0, -1});
        camera.projection = Projection::orthographic;
        camera.ymag = 0.9;
        scene.cameras = {camera};
        const LayeredImage image = run.render(scene, small_options(32)).image;
        const double expected = kPi * 0.5 * (1.0 + std::max(0.1, std::cos(angle)));
        run.figure(worst_deviation(image, "irradiance", expected),
                   "irradiance, worst pixel, normals lean by " + text_of(degrees) + " degrees");
    }
}

void tiny_bright_source(CaseRun& run)
{
    // 2 cm of a wall is lit a million times more than the rest of the room reflects on average: few rays find it.
    Scene scene = lit_corner();
    scene.meshes[1] = quad({0.0f, 1.0f, 0.0f}, {0.0f, 0.02f, 0.0f}, {0.0f, 0.0f, 0.02f}, 1);
    scene.lights[0].intensity *= 1e6f;
    scene.sky_radiance = glm::vec3(1.0f);
    const int size = 64;
    RenderOptions options = small_options(size);
    settings_of(options).rays = 16384;  // one or two of a record's rays find it
    const LayeredImage image = run.render(scene, options).image;
    const std::vector<glm::dvec3> spot = {{0, 1, 0}, {0, 1.02, 0}, {0, 1.02, 0.02}, {0, 1, 0.02}};
    double sum = 0.0, expected = 0.0, highest = 0.0, peak = 0.0;
    for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
            const glm::dvec3 p((x + 0.5) / size * 2.0, 0.0, (y + 0.5) / size * 2.0 - 1.0);
            const double truth = kPi + 1e6 * polygon_irradiance(spot, p, {0, 1, 0});
            const double got = static_cast<double>(image.layers.at("irradiance").at(x, y)[0]);
            sum += got;
            expected += truth;
            peak = std::max(peak, truth);
            highest = std::max(highest, got);
        }
    }
    run.figure(std::abs(sum / expected - 1.0), "energy over the floor against Lambert's formula");
    run.note("brightest pixel " + text_of(highest / peak) + " times the brightest there is");
    run.require(highest < 10.0 * peak, "a firefly");
}

void light_through_a_door(CaseRun& run)
{
    const Scene scene = load_scene("demo:ajar");
    const int size = 32;
    RenderOptions options = small_options(size);
    settings_of(options) = {.error_tolerance = 0.05f, .rays = 256};
    std::vector<LayeredImage> renders;
    ThreadPool one(1), three(3);
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        options.seed = seed;
        const std::string words = "seed " + std::to_string(seed);
        RenderResult result = run.render(scene, scene.cameras[0], options, words, one);
        run.require(result.stats.records.lit_points > 0 || seed > 1, "no lit points, " + words);
        renders.push_back(std::move(result.image));
    }
    std::string layer;
    options.seed = 1;
    const RenderResult again = run.render(scene, scene.cameras[0], options, "3 threads", three);
    run.require(same_bits(again.image, renders.front(), layer), "3 threads give other bits in layer " + layer);
    ReferenceOptions path_tracer;
    path_tracer.samples = 4096;
    const LayeredImage reference = render_reference(build_ray_scene(scene, run.pool()),
                                                    view_of(scene.cameras[0], size, size), path_tracer, run.pool());
    const SeedMeans got = mean_over_seeds(renders);
    const Image& truth = reference.layers.at("indirect");
    double sum = 0.0, expected = 0.0;
    for (std::size_t i = 0; i < got.mean.size(); ++i) {
        sum += got.mean[i];
        expected += luminance_at(truth, i);
    }
    run.figure(std::abs(sum / expected - 1.0), "mean over 4 seeds against the path tracer");
}

}  // namespace

std::vector<SuiteCase> record_scene_cases()
{
    const std::string group = "records";
    return {
        {{"B3", group, "A crease of two degrees", "radius 0, records without end",
          "radius at least that of pixels; few records a pixel", 0.5,
          "where R is 0 a record serves the 3 pixels around it", true},
         record_in_a_crease},
        {{"B4", group, "An open plane: no ray hits anything", "R infinite or NaN", "= pi x sky, finite radii", 1e-5,
          "a sum of equal floats", true},
         open_plane},
        {{"B5", group, "A floor next to a small bright patch of a wall", "extrapolation below 0 or far above: rings",
          "one rise and one fall as in Lambert's formula, its values where accuracy is 0.05", 0.10,
          "of the peak, and of the mean: records a few pixels apart, next to the wall where light falls to nothing",
          true},
         steep_gradient},
        {{"B6", group, "A room cut in two by a sheet, lamp on one side", "light leaks through the sheet",
          "dark side black beyond the 6 px that records reach at least", 1e-3, "of the lit side's light", true},
         thin_wall},
        {{"B6b", group, "The same with 4 bounces, beyond the first from world-space cells",
          "cells that the sheet cuts in two", "dark side nearly black", 0.03,
          "of the lit side's light: a cell of the floor that lies on both sides keeps their mean", true},
         thin_wall_with_cells},
        {{"B7", group, "Stairs of 1 cm, floors 1 mm apart, a folded sheet",
          "records serve the wrong one of two near surfaces", "same as the path tracer in every block of 8 x 8 pixels",
          0.2, "accuracy a: what Ward's error model lets a record be wrong by; noise is taken off", true},
         surfaces_close_to_each_other},
        {{"B8", group, "A sphere of 12 pixels radius", "no record serves a pixel, since normals turn quickly",
          "every pixel served", 0.0, "none may be missed", true},
         quickly_curved_surface},
        {{"B9", group, "Vertex normals that lean from the face by up to 120 degrees",
          "rays below the surface, black fringes", "= pi (1 + cos) / 2 of the sky, cos at least 0.1", 0.03,
          "strata of 128 rays cut by the horizon", true},
         leaning_normals},
        {{"B11", group, "A source of 10^6 times the mean that few rays find", "firefly, blotches",
          "= Lambert's formula on average, no pixel above 10 times the peak", 0.25,
          "some hundred of the picture's rays find it: the error of their number", true},
         tiny_bright_source},
        {{"B16", group, "A room lit through a door that stands ajar: records look at lit points",
          "light counted twice or lost between rays and looks; results that depend on who learned first",
          "same mean as the path tracer, same bits for any threads", 0.03,
          "records interpolate at contacts; noise of 4 seeds and of the reference", false},
         light_through_a_door},
    };
}

}  // namespace rcs::stability
