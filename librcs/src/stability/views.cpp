// Group C: cameras, image sizes, and the bounds of what a record may touch.
#include <cmath>
#include <numbers>
#include <random>

#include <glm/gtc/matrix_transform.hpp>

#include "rcs/error.h"
#include "rcs/gbuffer.h"
#include "rcs/ray_scene.h"
#include "rcs/splat.h"
#include "splat/splat_choice.h"
#include "stability/case_run.h"
#include "stability/scenes.h"
#include "stability/splat_oracle.h"

namespace rcs::stability {
namespace {

/// Splats records gathered at the view's own pixels by both methods, and by a loop over all pixels without any bounds.
void compare_splats(CaseRun& run, const Scene& scene, const View& view, std::vector<Record> more,
                    const std::string& words)
{
    const RayScene rays = build_ray_scene(scene, run.pool());
    const GBuffer g = render_gbuffer(run.gl(), rays, view, 1.0f, run.pool());
    std::vector<Record> records = std::move(more);
    RecordSettings record_options;
    record_options.rays = 32;
    RecordStats stats;
    place_records(rays, g, view, record_options, run.pool(), records, stats);
    const SplatSettings options{0.2f, 3.0f};
    const std::vector<SplatSums> exact = double_loop(records, g, options);
    double light = 0.0;
    for (const Record& r : records)
        light = std::max(light, static_cast<double>(std::max({r.irradiance.r, r.irradiance.g, r.irradiance.b})));
    for (const SplatMethod method : kSplatMethods) {
        const SplatBuffer sums = splat_by(run, method, records, g, view, options);
        run.figure(largest_difference(sums, exact, glm::dvec3(light)), words + ", " + name_of(method));
    }
    run.require(!records.empty(), words + ": there are no records");
}

Record sphere_around(const glm::dvec3& centre, float radius)
{
    Record r;
    r.position = glm::vec3(centre);
    r.normal = {0.0f, 1.0f, 0.0f};
    r.irradiance = glm::vec3(1.0f);
    r.harmonic_mean_distance = 100.0f * radius;
    r.footprint = radius;
    r.spacing_radius = radius;
    return r;
}

void camera_inside_a_sphere(CaseRun& run)
{
    const Scene scene = furnished_room();
    const View view = view_of(scene.cameras[0], 48, 36);
    const glm::dvec3 eye = camera_position(view.camera);
    compare_splats(run, scene, view, {sphere_around(eye, 2.0f), sphere_around(eye + glm::dvec3(0.1, -0.2, 0.3), 1.0f)},
                   "room");
}

/// A view and a sphere, both at random: fields of view from 1 to 150 degrees, aspects up to 10, spheres that surround
/// the camera, cross the plane of the eye, or touch the horizon.
struct RandomSphere {
    View view;
    glm::dvec3 centre_view{0.0};
    double radius = 0.0;

    template <typename Engine>
    explicit RandomSphere(Engine& engine)
    {
        const auto uniform = [&](double a, double b) { return std::uniform_real_distribution(a, b)(engine); };
        const auto log_uniform = [&](double a, double b) { return std::exp(uniform(std::log(a), std::log(b))); };
        const double aspect = log_uniform(0.1, 10.0);
        view.height = static_cast<int>(log_uniform(1.0, 2000.0));
        view.width = std::max(1, static_cast<int>(view.height * aspect));
        view.pixel_offset = {uniform(0.0, 1.0), uniform(0.0, 1.0)};
        Camera& camera = view.camera;
        camera.projection = uniform(0.0, 1.0) < 0.2 ? Projection::orthographic : Projection::perspective;
        camera.yfov = uniform(1.0, 150.0) * kPi / 180.0;
        camera.ymag = log_uniform(0.01, 100.0);
        if (uniform(0.0, 1.0) < 0.3) camera.lens_shift = {uniform(-2.0, 2.0), uniform(-2.0, 2.0)};
        const double distance = log_uniform(1e-3, 1e3);
        camera.world_from_view = glm::rotate(glm::dmat4(1.0), uniform(0.0, 6.0),
                                             glm::normalize(glm::dvec3(uniform(-1, 1), uniform(-1, 1), 1.0)));
        const double half =
            camera.projection == Projection::perspective ? std::tan(0.5 * camera.yfov) * distance : camera.ymag;
        centre_view = {uniform(-1.5, 1.5) * half * aspect, uniform(-1.5, 1.5) * half, uniform(-1.0, 0.3) * distance};
        centre_view += glm::dvec3(2.0 * half * camera.lens_shift, 0.0);
        radius = log_uniform(1e-3, 10.0) * distance;
    }
};

void conservative_bounds(CaseRun& run)
{
    std::mt19937_64 engine(1);
    std::normal_distribution<double> normal;
    std::uint64_t seen = 0, missed = 0;
    for (int n = 0; n < 1'000'000; ++n) {
        const RandomSphere s(engine);
        const glm::dmat3 turn(s.view.camera.world_from_view);
        const PixelBounds bounds = sphere_bounds(s.view, turn * s.centre_view, s.radius);
        const bool perspective = s.view.camera.projection == Projection::perspective;
        for (int k = 0; k < 2; ++k) {
            const glm::dvec3 p =
                s.centre_view + s.radius * glm::normalize(glm::dvec3(normal(engine), normal(engine), normal(engine)));
            if (p.z >= 0.0) continue;
            const double half = perspective ? std::tan(s.view.camera.yfov / 2.0) * -p.z : s.view.camera.ymag;
            // The point's place in the image, and the sample next to it in the direction of the sphere's middle: that
            // one sees the sphere unless the sphere is smaller than a pixel, which the ray below decides.
            const glm::dvec2 beside = glm::dvec2(p) - 2.0 * half * s.view.camera.lens_shift;
            const double x =
                (beside.x / (half * s.view.width / s.view.height) + 1.0) / 2.0 * s.view.width - s.view.pixel_offset.x;
            const double y = (1.0 - beside.y / half) / 2.0 * s.view.height - s.view.pixel_offset.y;
            const int i = static_cast<int>(std::lround(std::clamp(x, -2.0, 1e6))),
                      j = static_cast<int>(std::lround(std::clamp(y, -2.0, 1e6)));
            if (i < 0 || j < 0 || i >= s.view.width || j >= s.view.height) continue;
            const CameraRay ray = camera_ray(s.view, i + s.view.pixel_offset.x, j + s.view.pixel_offset.y);
            const glm::dvec3 d = glm::normalize(ray.direction);
            const glm::dvec3 to = turn * s.centre_view - ray.origin;
            const double along = glm::dot(to, d);
            const double rest = s.radius * s.radius - (glm::dot(to, to) - along * along);
            if (rest < 0.0 || along + std::sqrt(rest) <= 0.0) continue;
            ++seen;
            missed += i < bounds.x0 || i >= bounds.x1 || j < bounds.y0 || j >= bounds.y1;
        }
    }
    run.figure(static_cast<double>(missed), "pixels missed, of " + std::to_string(seen) + " that see a sphere");
    run.require(seen > 100'000, "hardly any pixel sees a sphere");
}

void extreme_views(CaseRun& run)
{
    const Scene scene = furnished_room();
    const Camera& base = scene.cameras[0];
    const auto with = [&](double degrees, int width, int height, const std::string& words) {
        View view = view_of(base, width, height);
        view.camera.yfov = glm::radians(degrees);
        compare_splats(run, scene, view, {sphere_around(camera_position(base) + glm::dvec3(0.2, 0.0, -0.2), 0.5f)},
                       words);
    };
    with(1.0, 32, 32, "field of view 1 degree");
    with(150.0, 32, 32, "field of view 150 degrees");
    with(30.0, 100, 10, "aspect 10:1");
    with(110.0, 10, 100, "aspect 1:10");
    View shifted = view_of(base, 40, 30);
    shifted.camera.lens_shift = {0.6, -0.4};
    compare_splats(run, scene, shifted, {sphere_around(camera_position(base) + glm::dvec3(0.2, 0.0, -0.2), 0.5f)},
                   "shifted lens");
    View parallel = view_of(base, 40, 30);
    parallel.camera.projection = Projection::orthographic;
    parallel.camera.ymag = 1.5;
    compare_splats(run, scene, parallel, {}, "orthographic");
    View jittered = view_of(base, 40, 30);
    jittered.pixel_offset = {0.01, 0.99};
    compare_splats(run, scene, jittered, {}, "samples at the corners of pixels");
}

void odd_sizes(CaseRun& run)
{
    struct Size {
        int width, height;
    };
    for (const Size size : {Size{1, 1}, {1, 4096}, {8193, 3}, {17, 31}, {4096, 1}}) {
        for (const SplatMethod method : kSplatMethods) {
            const std::string words =
                std::to_string(size.width) + " x " + std::to_string(size.height) + ", " + name_of(method);
            RenderOptions options = small_options(1, method);
            options.width = size.width;
            options.height = size.height;
            settings_of(options).rays = 16;
            try {
                const RenderResult result = run.render(furnished_room(), options, words);
                const Image& beauty = result.image.layers.at("beauty");
                run.require(beauty.width == size.width && beauty.height == size.height,
                            words + ": the picture has another size");
                run.figure(0.0, "all sizes render");
            } catch (const Error& e) {
                run.require(e.code() == ErrorCode::unsupported || e.code() == ErrorCode::out_of_memory,
                            words + ": " + e.what());
            }
        }
    }
}

void depth_ratio(CaseRun& run)
{
    // Squares one behind the other from 1 mm to 1 km, each moved up so that part of it shows.
    Scene scene;
    const int paint = add_material(scene, glm::vec3(0.5f), glm::vec3(0.0f), true);
    std::vector<double> depths;
    for (double depth = 1e-3; depth < 1.5e3; depth *= 4.0) {
        depths.push_back(depth);
        const float size = static_cast<float>(depth);
        add_mesh(scene, quad({-size, size * (static_cast<float>(depths.size()) * 0.09f - 1.0f), -size},
                             {2 * size, 0, 0}, {0, 2 * size, 0}, paint));
    }
    scene.cameras = {look_at_camera("camera", {0, 0, 0}, {0, 0, -1}, 1.5)};
    const RayScene rays = build_ray_scene(scene, run.pool());
    const View view = view_of(scene.cameras[0], 101, 101);
    const GBuffer g = render_gbuffer(run.gl(), rays, view, 1.0f, run.pool());
    std::size_t wrong = 0, seen = 0;
    for (std::size_t i = 0; i < g.size(); ++i) {
        const glm::dvec3 d =
            camera_ray(view, static_cast<double>(i % 101) + 0.5, static_cast<double>(i / 101) + 0.5).direction;
        // The nearest square whose lower edge lies below the ray.
        std::size_t expected = depths.size();
        for (std::size_t k = 0; k < depths.size() && expected == depths.size(); ++k) {
            const double low = static_cast<double>(k + 1) * 0.09 - 1.0;
            if (std::abs(d.x) < 0.999 && d.y > low + 1e-3 && d.y < low + 1.999) expected = k;
        }
        const bool at_edge = std::abs(std::remainder((d.y + 1.0) / 0.09, 1.0)) < 0.02;
        if (at_edge || expected == depths.size() || std::abs(d.x) > 0.99) continue;
        ++seen;
        wrong += !g.covered(i) || g.instance[i] != expected;
        if (g.covered(i))
            run.figure(glm::length(glm::dvec3(g.position(i)) - d * depths[g.instance[i]]) /
                           (depths[g.instance[i]] * glm::length(d)),
                       "of the distance");
    }
    run.require(wrong == 0, std::to_string(wrong) + " of " + std::to_string(seen) + " pixels show the wrong square");
    run.require(seen > 3000, "too few pixels show a square: " + std::to_string(seen));
}

void silhouette(CaseRun& run)
{
    // Sphere and sky: a pixel on the silhouette is a mix of 1.4 and 2, never outside of the two.
    for (const SplatMethod method : kSplatMethods) {
        RenderOptions options = small_options(96, method);
        options.aa = 4;
        const LayeredImage image = run.render(furnace(0.7f, 2.0f), options).image;
        const Image& beauty = image.layers.at("beauty");
        for (std::size_t i = 0; i < beauty.pixels.size(); i += 4) {
            const double value = static_cast<double>(beauty.pixels[i]);
            run.figure(std::max(1.4 - value, value - 2.0) / 1.4, "beyond sphere and sky, " + name_of(method));
        }
    }
}

}  // namespace

std::vector<SuiteCase> view_cases()
{
    const std::string group = "views";
    return {
        {{"C1", group, "Camera inside spheres of influence", "a quad that does not cover the picture",
          "same as a loop over all pixels in double precision", 1e-4, "what quads and tiles may differ by anywhere",
          true},
         camera_inside_a_sphere},
        {{"C2", group, "A million random spheres: around the camera, across its plane, at the horizon",
          "a bound that is too small: holes", "no pixel that sees a sphere lies outside its bound", 0.0,
          "none may be missed", true},
         conservative_bounds},
        {{"C3", group, "Fields of view of 1 and 150 degrees, aspects 10:1 and 1:10, orthographic, shifted lens",
          "bounds and footprints at the edge of their range", "same as a loop over all pixels in double precision",
          1e-4, "what quads and tiles may differ by anywhere", true},
         extreme_views},
        {{"C4", group, "Pictures of 1 x 1, 1 x 4096, 8193 x 3, 17 x 31", "tiles, bands and grids at the picture's edge",
          "a picture, or one clear error", 0.0, "nothing is measured", true},
         odd_sizes},
        {{"C5", group, "Squares from 1 mm to 1 km away in one view", "banding of positions, wrong one in front",
          "= positions by geometry", 1e-6, "of the distance: floats relative to the camera", true},
         depth_ratio},
        {{"C6", group, "Silhouette against the sky, anti-aliased", "halo of another surface's light",
          "between sphere and sky at every pixel", 0.01, "as the furnace itself (A1)", true},
         silhouette},
    };
}

}  // namespace rcs::stability
