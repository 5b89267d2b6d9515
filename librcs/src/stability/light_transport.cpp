// Group A: scenes whose light is known by formula.
#include <cmath>
#include <numbers>

#include "rcs/reference.h"
#include "splat/splat_choice.h"
#include "stability/case_run.h"
#include "stability/metamorphic.h"
#include "stability/scenes.h"

namespace rcs::stability {
namespace {

/// Shares of n reflections: rho + rho^2 + ... + rho^n.
double series(double rho, int n) { return rho * (1.0 - std::pow(rho, n)) / (1.0 - rho); }

void white_furnace(CaseRun& run)
{
    for (const SplatMethod method : kSplatMethods) {
        for (const int bounces : {0, 1}) {
            RenderOptions options = small_options(96, method);
            options.bounces = bounces;
            const LayeredImage image = run.render(furnace(0.7f, 2.0f), options).image;
            run.figure(worst_deviation(image, "indirect", 0.7 * 2.0), "radiance, worst pixel, " + name_of(method));
            run.figure(worst_deviation(image, "irradiance", kPi * 2.0), "irradiance, worst pixel, " + name_of(method));
            run.require(spread_of(image, "direct").high == 0.0, "the sky is no lamp, yet there is direct light");
            const float* corner = image.layers.at("beauty").at(0, 0);
            run.require(corner[0] == 2.0f && corner[3] == 0.0f, "the corner does not show the sky itself");
        }
    }
}

void closed_emissive_box(CaseRun& run)
{
    for (const float albedo : {0.5f, 0.95f}) {
        const double rho = static_cast<double>(albedo);
        for (const int bounces : {0, 1, 2, 8}) {
            RenderOptions options = small_options(32);
            options.bounces = bounces;
            const LayeredImage image = run.render(emissive_box(albedo, 3.0f), options).image;
            const double expected = 3.0 * (1.0 - std::pow(rho, bounces + 2)) / (1.0 - rho);
            run.figure(std::abs(spread_of(image, "beauty").mean / expected - 1.0),
                       "mean radiance, albedo " + text_of(rho) + ", " + std::to_string(bounces) + " bounces");
        }
    }
}

void closed_sphere(CaseRun& run)
{
    const double rho = 0.6, direct = 1.0 / 4.0;  // I / r^2 at r = 2
    for (const int bounces : {1, 4}) {
        for (const SplatMethod method : kSplatMethods) {
            if (bounces > 1 && method != SplatMethod::tiles) continue;
            RenderOptions options = small_options(48, method);
            options.bounces = bounces;
            const LayeredImage image = run.render(lit_sphere(0.6f), options).image;
            const double expected = direct * series(rho, bounces);
            run.figure(std::abs(spread_of(image, "irradiance").mean / expected - 1.0),
                       "mean irradiance, " + std::to_string(bounces) + " bounces, " + name_of(method));
            if (bounces == 1)
                run.figure(worst_deviation(image, "irradiance", expected),
                           "irradiance, worst pixel, " + name_of(method));
            run.figure(worst_deviation(image, "direct", rho / kPi * direct), "direct light, worst pixel");
        }
    }
}

/// Calls visit(x, y, ground point) for every pixel of an orthographic view of [-1, 1]^2.
template <typename Visit>
void for_each_point(int size, const Visit& visit)
{
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x)
            visit(x, y, glm::dvec2((x + 0.5) / size * 2.0 - 1.0, (y + 0.5) / size * 2.0 - 1.0));
}

std::vector<glm::dvec3> level_rectangle(double x0, double x1, double z0, double z1, double y)
{
    return {{x0, y, z0}, {x1, y, z0}, {x1, y, z1}, {x0, y, z1}};
}

void parallel_square_lamp(CaseRun& run)
{
    const int size = 64;
    RenderOptions options = small_options(size);
    options.bounces = 0;
    const LayeredImage image = run.render(square_lamp(), options).image;
    double error = 0.0;
    for_each_point(size, [&](int x, int y, glm::dvec2 p) {
        const double expected =
            polygon_irradiance(level_rectangle(-1, 1, -1, 1, 1.0), {p.x, 0.0, p.y}, {0, 1, 0}) / kPi;
        error += std::abs(image.layers.at("direct").at(x, y)[0] / expected - 1.0) / (size * size);
    });
    run.figure(error, "mean relative error over the floor");
}

void corner_of_floor_and_wall(CaseRun& run)
{
    const int size = 64;
    const std::vector<glm::dvec3> wall = {{0, 0, -200}, {0, 0, 200}, {0, 2, 200}, {0, 2, -200}};
    for (const SplatMethod method : kSplatMethods) {
        const LayeredImage image = run.render(lit_corner(), small_options(size, method)).image;
        for (int x = 0; x < size; ++x) {
            // Each row is the same: their mean takes the records' noise out of a measure of bias.
            double mean = 0.0;
            for (int y = 0; y < size; ++y)
                mean += static_cast<double>(image.layers.at("irradiance").at(x, y)[0]) / size;
            const double d = (x + 0.5) / size * 2.0;
            run.figure(std::abs(mean - polygon_irradiance(wall, {d, 0, 0}, {0, 1, 0})) / (0.5 * kPi),
                       "of the peak, " + text_of(d) + " m from the corner, " + name_of(method));
        }
    }
}

/// A floor patch of radiance 1 by a low sun, below a dark ceiling that an orthographic camera looks up at.
Scene lit_patch_below_ceiling(bool with_board)
{
    Scene scene;
    const int patch = add_material(scene, glm::vec3(0.5f));
    const int ceiling = add_material(scene, glm::vec3(0.5f));
    add_mesh(scene, quad({-2, 0, -2}, {0, 0, 4}, {4, 0, 0}, patch));
    add_mesh(scene, quad({-1.2f, 3, -1.2f}, {2.4f, 0, 0}, {0, 0, 2.4f}, ceiling));
    if (with_board) {  // black, and its shadow falls 30 m away
        const int board = add_material(scene, glm::vec3(0.0f), glm::vec3(0.0f), true);
        add_mesh(scene, quad({-0.5f, 1.5f, -0.5f}, {1, 0, 0}, {0, 0, 1}, board));
    }
    PunctualLight sun;
    sun.name = "sun";
    sun.kind = LightKind::directional;
    sun.direction = glm::normalize(glm::dvec3(-1.0, -0.05, 0.0));
    sun.intensity = glm::vec3(static_cast<float>(2.0 * kPi / -sun.direction.y));  // albedo / pi * E = 1
    scene.lights = {sun};
    // Under the board's plane nothing hides the ceiling from an orthographic view that starts above it.
    Camera camera = look_at_camera("camera", {0, 2.0, 0}, {0, 3, 0}, 0.8, {0, 0, -1});
    camera.projection = Projection::orthographic;
    camera.ymag = 1.0;
    scene.cameras = {camera};
    return scene;
}

void diffuse_reflection_with_obstruction(CaseRun& run)
{
    const int size = 48;
    for (const bool with_board : {false, true}) {
        const LayeredImage image = run.render(lit_patch_below_ceiling(with_board), small_options(size)).image;
        double error = 0.0, sum = 0.0;
        for_each_point(size, [&](int x, int y, glm::dvec2) {
            // Looking up with up = -z, the image's right is -x.
            const double px = -((x + 0.5) / size * 2.0 - 1.0), pz = (y + 0.5) / size * 2.0 - 1.0;
            double expected = polygon_irradiance(level_rectangle(-2, 2, -2, 2, 0), {px, 3, pz}, {0, -1, 0});
            if (with_board) {
                // Seen from there the board hides the part of the patch that lies twice as far behind it.
                const auto shadow = [](double p, double edge) { return std::clamp(p + 2.0 * (edge - p), -2.0, 2.0); };
                expected -= polygon_irradiance(
                    level_rectangle(shadow(px, -0.5), shadow(px, 0.5), shadow(pz, -0.5), shadow(pz, 0.5), 0),
                    {px, 3, pz}, {0, -1, 0});
            }
            error += std::abs(image.layers.at("irradiance").at(x, y)[0] - expected);
            sum += expected;
        });
        run.figure(error / sum, with_board ? "mean error, board between" : "mean error, free");
    }
}

/// A closed cube with a lamp in its middle: all light that enters surface area S is shared by it.
void internally_reflected_component(CaseRun& run)
{
    const double flux = 4.0 * kPi, area = 6 * 16.0;
    for (const float albedo : {0.3f, 0.8f}) {
        Scene scene;
        add_mesh(scene, box({-2, -2, -2}, {2, 2, 2}, add_material(scene, glm::vec3(albedo)), Facing::inwards));
        scene.lights = {point_light({0, 0, 0}, glm::vec3(1.0f))};
        Camera camera = look_at_camera("camera", {0, 1.9, 0}, {0, -2, 0}, 0.8, {0, 0, -1});
        camera.projection = Projection::orthographic;
        camera.ymag = 2.0;  // one whole side: by symmetry its mean is that of all
        scene.cameras = {camera};
        RenderOptions options = small_options(64);
        options.bounces = 8;
        const LayeredImage image = run.render(scene, options).image;
        const double expected = flux / area * series(static_cast<double>(albedo), 8);
        run.figure(std::abs(spread_of(image, "irradiance").mean / expected - 1.0),
                   "mean irradiance, albedo " + text_of(static_cast<double>(albedo)));
    }
}

/// GGX with height-correlated masking and Schlick's Fresnel f0 .. 1, integrated over the reflected directions by the
/// midpoint rule over visible half vectors' slopes: independent of the renderer's tables.
double ggx_albedo(double alpha, double f0, double cosine)
{
    const glm::dvec3 out(std::sqrt(1.0 - cosine * cosine), 0.0, cosine);
    const auto lambda = [&](double c) { return 0.5 * (std::sqrt(1.0 + alpha * alpha * (1.0 / (c * c) - 1.0)) - 1.0); };
    const int n = 400;
    double sum = 0.0;
    for (int i = 0; i < n; ++i) {
        // cos^2 of the half vector such that D cos is uniform.
        const double u = (i + 0.5) / n;
        const double cos2 = (1.0 - u) / (1.0 + (alpha * alpha - 1.0) * u);
        const double ch = std::sqrt(cos2), sh = std::sqrt(1.0 - cos2);
        for (int k = 0; k < n; ++k) {
            const double phi = 2.0 * kPi * (k + 0.5) / n;
            const glm::dvec3 h(sh * std::cos(phi), sh * std::sin(phi), ch);
            const double oh = glm::dot(out, h);
            const glm::dvec3 in = 2.0 * oh * h - out;
            if (!(oh > 0.0) || !(in.z > 0.0)) continue;
            const double fresnel = f0 + (1.0 - f0) * std::pow(1.0 - oh, 5.0);
            const double masking = 1.0 / (1.0 + lambda(cosine) + lambda(in.z));
            sum += fresnel * masking * oh / (cosine * ch);
        }
    }
    return sum / (n * n);
}

void glossy_plane_in_a_furnace(CaseRun& run)
{
    for (const double alpha : {0.02, 0.1, 0.25, 0.35, 0.6, 1.0}) {
        for (const double f0 : {0.4, 1.0}) {
            Scene scene;
            Material metal;
            metal.name = "metal";
            metal.base_color = glm::vec3(static_cast<float>(f0));
            metal.metallic = 1.0f;
            metal.roughness = static_cast<float>(std::sqrt(alpha));
            add_mesh(scene, quad({-5, 0, -5}, {0, 0, 10}, {10, 0, 0}, add_material(scene, metal)));
            scene.sky_radiance = glm::vec3(1.0f);
            Camera camera = look_at_camera("camera", {0, 3, 3}, {0, 0, 0}, 0.8);
            camera.projection = Projection::orthographic;
            camera.ymag = 1.0;
            scene.cameras = {camera};
            const LayeredImage image = run.render(scene, small_options(32)).image;
            const double cosine = std::sqrt(0.5);
            // What single scattering loses is given back by Turquin's factor (2019).
            const double whole = ggx_albedo(alpha, 1.0, cosine);
            const double expected = ggx_albedo(alpha, f0, cosine) * (1.0 + f0 * (1.0 - whole) / whole);
            run.figure(std::abs(spread_of(image, "beauty").mean / expected - 1.0),
                       "mean radiance, alpha " + text_of(alpha) + ", f0 " + text_of(f0));
        }
    }
}

/// A lamp below the ceiling of a room 2 m high, which it is parallel to or leans from by 20 degrees, its nearest edge
/// so far away; an orthographic camera below looks up at the ceiling around it.
struct LampBelowCeiling {
    Scene scene;
    std::vector<glm::dvec3> lamp;
    glm::dvec3 normal;  // of its front
    bool double_sided;
};
LampBelowCeiling lamp_below_ceiling(double distance, bool leans, bool double_sided)
{
    LampBelowCeiling s;
    s.double_sided = double_sided;
    const int white = add_material(s.scene, glm::vec3(0.5f), glm::vec3(0.0f), true);
    const int lamp = add_material(s.scene, glm::vec3(0.0f), glm::vec3(1.0f), double_sided);
    add_mesh(s.scene, quad({-1, 2, -1}, {2, 0, 0}, {0, 0, 2}, white));
    // Its front looks up.
    const double angle = leans ? glm::radians(20.0) : 0.0;
    const glm::dvec3 corner(-0.2, 2.0 - distance, -0.15), u(0, 0, 0.3),
        v(0.4 * std::cos(angle), -0.4 * std::sin(angle), 0);
    add_mesh(s.scene, quad(glm::vec3(corner), glm::vec3(u), glm::vec3(v), lamp));
    for (const glm::vec3& p : s.scene.meshes.back().positions) s.lamp.emplace_back(p);
    s.normal = glm::normalize(glm::cross(s.lamp[1] - s.lamp[0], s.lamp[2] - s.lamp[0]));
    Camera camera = look_at_camera("camera", {0, 0, 0}, {0, 2, 0}, 0.8, {0, 0, -1});
    camera.projection = Projection::orthographic;
    camera.ymag = 1.0;
    s.scene.cameras = {camera};
    return s;
}

void lamp_close_to_a_wall(CaseRun& run)
{
    const int size = 32;
    RenderOptions options = small_options(size);
    options.bounces = 0;
    const auto look_at = [&](double distance, bool leans, bool double_sided, double scale) {
        const LampBelowCeiling s = lamp_below_ceiling(distance, leans, double_sided);
        const Scene scene = scale == 1.0 ? s.scene : scaled(s.scene, scale);
        const LayeredImage image = run.render(scene, options).image;
        ReferenceOptions path_tracer;
        path_tracer.samples = 64;
        const LayeredImage traced = render_reference(build_ray_scene(scene, run.pool()),
                                                     view_of(scene.cameras[0], size, size), path_tracer, run.pool());
        double worst = 0.0, sum = 0.0, sum_traced = 0.0;
        for_each_point(size, [&](int x, int y, glm::dvec2 at) {
            const glm::dvec3 p(-at.x, 2.0, at.y);  // looking up with up = -z, the image's right is -x
            if (std::abs(p.x) < 0.25 && std::abs(p.z) < 0.2) return;  // behind the lamp
            const double expected = double_sided || glm::dot(p - s.lamp[0], s.normal) > 0.0
                                        ? 0.5 / kPi * polygon_irradiance(s.lamp, p, {0, -1, 0})
                                        : 0.0;
            const double got = static_cast<double>(image.layers.at("direct").at(x, y)[0]);
            worst = std::max(worst, expected > 0.0 ? std::abs(got / expected - 1.0) : got);
            sum += expected;
            sum_traced += static_cast<double>(traced.layers.at("direct").at(x, y)[0]);
        });
        const std::string words = text_of(distance) + " m off, times " + text_of(scale) + (leans ? ", leaning" : "") +
                                  (double_sided ? ", two-sided" : "");
        run.figure(worst, "worst pixel, " + words);
        run.figure(std::abs(sum_traced / sum - 1.0), "mean of the path tracer, " + words);
    };
    for (const bool leans : {false, true})
        for (const bool double_sided : {false, true})
            for (const double distance : {0.002, 0.02, 0.11, 1.0}) look_at(distance, leans, double_sided, 1.0);
    for (const double scale : {1e-3, 1e3})
        for (const double distance : {0.002, 0.05}) look_at(distance, false, true, scale);
}

/// What the ceiling gets from a lamp close below it reaches the rest of the room by records, or by cells as well.
void lamp_close_to_a_ceiling(CaseRun& run)
{
    Scene room = furnished_room();
    room.lights.clear();
    room.materials[2].double_sided = true;
    for (glm::vec3& p : room.meshes[2].positions) p.y = 2.99f;
    const int size = 64;
    for (const int bounces : {1, 3}) {
        RenderOptions options = small_options(size);
        settings_of(options).rays = 512;
        options.area_samples = options.penumbra_samples = 64;
        options.bounces = bounces;
        const LayeredImage image = run.render(room, options).image;
        ReferenceOptions path_tracer;
        path_tracer.samples = 256;
        path_tracer.bounces = bounces;
        const LayeredImage truth = render_reference(build_ray_scene(room, run.pool()),
                                                    view_of(room.cameras[0], size, size), path_tracer, run.pool());
        for (const char* layer : {"direct", "indirect"})
            run.figure(difference_of_means(image, truth, layer),
                       std::string("mean of ") + layer + " light, " + std::to_string(bounces) + " bounces");
    }
}

}  // namespace

std::vector<SuiteCase> light_transport_cases()
{
    const std::string group = "light transport";
    return {
        {{"A1", group, "White furnace: a diffuse sphere under a constant sky", "energy gained or lost, halos",
          "= albedo x sky at every pixel, irradiance pi x sky", 0.01,
          "the sphere is made of facets, whose horizon differs", true},
         white_furnace},
        {{"A2", group, "Closed box that emits and reflects, 0 to 8 bounces, albedo up to 0.95",
          "bounces missing or counted twice", "= Le (1 - rho^(N+2)) / (1 - rho)", 0.01,
          "noise of the mean of 1,024 pixels and of cells", true},
         closed_emissive_box},
        {{"A3", group, "Closed sphere, point light in its middle, 1 and 4 bounces",
          "spacing at walls that all look alike", "= rho E + ... + rho^n E with E = I / r^2, the same all over", 0.01,
          "facets are 0.1 % nearer than the sphere; records' noise", true},
         closed_sphere},
        {{"A4", group, "Square lamp parallel to a floor", "lamps with area near their edges",
          "= Lambert's polygon formula", 0.005, "nothing hides the lamp: no noise but rounding is expected", true},
         parallel_square_lamp},
        {{"A4b", group, "Lamp 2 mm to 1 m below a ceiling, level and leaning, one- and two-sided, times 1e-3 and 1e3",
          "shadow rays that end behind the lamp they graze", "= Lambert's polygon formula at every pixel", 0.01,
          "nothing hides the lamp; formulas in floats of a lamp seen nearly edge-on", true},
         lamp_close_to_a_wall},
        {{"A4c", group, "A room lit by a lamp on both sides, 1 cm below its ceiling, 1 and 3 bounces",
          "light of a ceiling that only hits of rays see", "same means as the path tracer", 0.01,
          "noise of the means of 64 x 64 pixels at 512 rays a record", true},
         lamp_close_to_a_ceiling},
        {{"A5", group, "Floor lit by a wall at a right angle, into the corner",
          "irradiance lost or doubled at contacts", "= form factor of the wall at every column of pixels", 0.02,
          "of the peak; records lie a pixel apart in the corner", true},
         corner_of_floor_and_wall},
        {{"A6", group, "Ceiling lit by a floor patch, free and with a board between (after CIE 171:2006, 5.6 and 5.7)",
          "interpolation across the edge of an indirect shadow", "= form factors of the visible part", 0.05,
          "mean error of single pixels at 128 rays a record", true},
         diffuse_reflection_with_obstruction},
        {{"A6b", group, "Closed cube, point light in its middle, 8 bounces (after CIE 171:2006, 5.8)",
          "energy lost in edges and corners", "= flux / area x (rho + ... + rho^8), mean of a side", 0.01,
          "noise of the mean; cells average near edges", true},
         internally_reflected_component},
        {{"A7", group, "Metal plane of alpha 0.02 to 1 under a constant sky",
          "lobes that gain or lose light, steps between techniques", "= directional albedo by quadrature", 0.02,
          "tables of 32 entries, harmonics up to band 5", true},
         glossy_plane_in_a_furnace},
    };
}

}  // namespace rcs::stability
