#include "stability/metamorphic.h"

#include <algorithm>
#include <cmath>

#include <glm/gtc/matrix_transform.hpp>

#include "rcs/error.h"
#include "splat/splat_choice.h"
#include "stability/scenes.h"

namespace rcs::stability {

Scene transformed(Scene scene, const glm::dmat4& world)
{
    const double determinant = glm::determinant(glm::dmat3(world));
    const double scale = std::cbrt(std::abs(determinant));
    const glm::dmat3 turn = glm::dmat3(world) / scale;
    for (Instance& instance : scene.instances) instance.world_from_object = world * instance.world_from_object;
    for (Camera& camera : scene.cameras) {
        const glm::dvec3 eye = world * glm::dvec4(glm::dvec3(camera.world_from_view[3]), 1.0);
        glm::dmat3 axes = turn * glm::dmat3(camera.world_from_view);
        if (determinant < 0.0) {  // stays rigid; the picture is turned round
            axes[0] = -axes[0];
            camera.lens_shift.x = -camera.lens_shift.x;
        }
        camera.world_from_view = glm::dmat4(axes);
        camera.world_from_view[3] = glm::dvec4(eye, 1.0);
        camera.ymag *= scale;
    }
    for (PunctualLight& light : scene.lights) {
        light.position = world * glm::dvec4(light.position, 1.0);
        light.direction = glm::normalize(turn * light.direction);
        light.range *= static_cast<float>(scale);
        if (light.kind != LightKind::directional) light.intensity *= static_cast<float>(scale * scale);
    }
    return scene;
}

Scene scaled(const Scene& scene, double factor)
{
    return transformed(scene, glm::scale(glm::dmat4(1.0), glm::dvec3(factor)));
}

Scene translated(const Scene& scene, glm::dvec3 by)
{
    Scene moved = transformed(scene, glm::translate(glm::dmat4(1.0), by));
    move_origin(moved);
    return moved;
}

Scene relit(Scene scene, float factor)
{
    for (Material& material : scene.materials) {
        material.emission *= factor;
        if (material.unlit) material.base_color *= factor;
    }
    for (PunctualLight& light : scene.lights) light.intensity *= factor;
    scene.sky_radiance *= factor;
    for (glm::vec3& radiance : scene.environment.radiance) radiance *= factor;
    return scene;
}

Scene reordered(Scene scene)
{
    std::reverse(scene.instances.begin(), scene.instances.end());
    std::reverse(scene.lights.begin(), scene.lights.end());
    for (Mesh& mesh : scene.meshes) std::reverse(mesh.triangles.begin(), mesh.triangles.end());
    return scene;
}

LayeredImage mirrored(LayeredImage image)
{
    for (auto& [name, layer] : image.layers)
        for (int y = 0; y < layer.height; ++y)
            for (int x = 0; x < layer.width / 2; ++x)
                std::swap_ranges(layer.at(x, y), layer.at(x, y) + layer.channels, layer.at(layer.width - 1 - x, y));
    return image;
}

LayeredImage dimmed(LayeredImage image, float factor)
{
    for (auto& [name, layer] : image.layers) {
        if (name == "normal" || name == "depth" || name == "albedo" || name == "records") continue;
        for (std::size_t i = 0; i < layer.pixels.size(); ++i)
            if (layer.channels != 4 || i % 4 != 3)  // beauty's alpha is no light
                layer.pixels[i] *= factor;
    }
    return image;
}

namespace {

// Pixels of two pictures with other random numbers differ by the root of two times the error of each, as far as their
// noise is what the estimate says; three times that is a difference of another kind.
constexpr double kMostDifference = 3.0 * 1.41421356;

double mean_of(const LayeredImage& image, const std::string& layer)
{
    double sum = 0.0;
    for (const float value : image.layers.at(layer).pixels) sum += static_cast<double>(value);
    return sum;
}

}  // namespace

void compare_pictures(CaseRun& run, const RenderResult& got, const RenderResult& expected, const std::string& words)
{
    const LayeredImage &a = got.image, &b = expected.image;
    const double all = mean_of(b, "beauty");
    for (const char* layer : {"emission", "direct", "indirect"}) {
        // A part that hardly shows is not worth its noise.
        const double share = 4.0 / 3.0 * mean_of(b, layer) / std::max(all, 1e-300);
        if (share > 0.0 || mean_of(a, layer) > 0.0)
            run.figure(difference_of_means(a, b, layer) * std::min(1.0, share),
                       words + ", mean of " + layer + " light, of the picture");
    }
    const double pixels = mean_difference(a, b, "indirect"),
                 most = kMostDifference * expected.stats.errors.indirect.mean_relative + 1e-4;
    run.require(pixels <= most, words + ": pixels of indirect light differ by " + text_of(pixels) +
                                    ", noise explains " + text_of(most));
}

namespace {

/// The scene with the camera of interest as its only one.
Scene with_one_camera(const Subject& subject)
{
    Scene scene = subject.scene;
    scene.cameras = {subject.camera};
    return scene;
}

RenderResult render_subject(CaseRun& run, const Subject& subject, const Scene& scene, const std::string& label)
{
    return run.render(scene, scene.cameras[0], subject.options, label, run.pool());
}

/// Renders the scene as it is and changed.
template <typename Change>
void compare_changed(CaseRun& run, const Subject& subject, const Change& change, const std::string& words,
                     bool mirror = false)
{
    const Scene plain = with_one_camera(subject);
    const RenderResult expected = render_subject(run, subject, plain, "as it is");
    const Scene other = change(plain);
    RenderResult got = render_subject(run, subject, other, words);
    if (mirror) got.image = mirrored(std::move(got.image));
    compare_pictures(run, got, expected, words);
}

void scale_scene(CaseRun& run, const Subject& subject)
{
    for (const double factor : {1e-4, 1e-2, 1e3, 1e5})
        compare_changed(run, subject, [&](const Scene& s) { return scaled(s, factor); }, "times " + text_of(factor));
}

void translate_scene(CaseRun& run, const Subject& subject)
{
    for (const double by : {1e3, 1e5, 1e6})
        compare_changed(
            run, subject, [&](const Scene& s) { return translated(s, {by, 0.5 * by, -by}); }, text_of(by) + " m away");
}

void rotate_scene(CaseRun& run, const Subject& subject)
{
    const glm::dmat4 one(1.0);
    if (!subject.scene.environment.empty()) {
        compare_changed(
            run, subject,
            [&](Scene s) {
                s = transformed(std::move(s), glm::rotate(one, 0.7, glm::dvec3(0, 1, 0)));
                s.environment.rotation += 0.7;
                return s;
            },
            "about the vertical");
        return;
    }
    compare_changed(
        run, subject,
        [&](const Scene& s) { return transformed(s, glm::rotate(one, 1.1, glm::normalize(glm::dvec3(1, 2, -0.5)))); },
        "rotated");
    compare_changed(
        run, subject,
        [&](const Scene& s) { return transformed(s, glm::rotate(one, glm::radians(-90.0), glm::dvec3(1, 0, 0))); },
        "z up");
    compare_changed(
        run, subject, [&](const Scene& s) { return transformed(s, glm::scale(one, glm::dvec3(-1, 1, 1))); }, "mirrored",
        true);
}

void relight_scene(CaseRun& run, const Subject& subject)
{
    const Scene plain = with_one_camera(subject);
    const RenderResult expected = render_subject(run, subject, plain, "as it is");
    for (const int exponent : {-20, 20}) {
        const float factor = std::ldexp(1.0f, exponent);
        const RenderResult got =
            render_subject(run, subject, relit(plain, factor), "light times 2^" + std::to_string(exponent));
        run.figure(worst_difference(dimmed(got.image, 1.0f / factor), expected.image, "beauty"),
                   "worst pixel, light times 2^" + std::to_string(exponent));
    }
}

void reorder_scene(CaseRun& run, const Subject& subject) { compare_changed(run, subject, reordered, "reversed"); }

void rethread_scene(CaseRun& run, const Subject& subject)
{
    ThreadPool one(1);
    const RenderResult expected = run.render(subject.scene, subject.camera, subject.options, "one thread", one);
    for (const int threads : {2, 3}) {
        ThreadPool pool(threads);
        const RenderResult got =
            run.render(subject.scene, subject.camera, subject.options, std::to_string(threads) + " threads", pool);
        std::string layer;
        run.figure(same_bits(got.image, expected.image, layer) ? 0.0 : 1.0,
                   "pictures with other bits" + (layer.empty() ? "" : ", in layer " + layer));
    }
}

void splats_against_tiles(CaseRun& run, const Subject& subject)
{
    RenderOptions options = subject.options;
    options.splat = SplatMethod::tiles;
    const RenderResult tiles = run.render(subject.scene, subject.camera, options, "tiles", run.pool());
    for (const SplatMethod method : {SplatMethod::quads, SplatMethod::gpu_tiles}) {
        options.splat = method;
        const RenderResult other = run.render(subject.scene, subject.camera, options, name_of(method), run.pool());
        for (const char* layer : {"beauty", "indirect"})
            run.figure(worst_difference(other.image, tiles.image, layer),
                       std::string("worst pixel of ") + layer + ", " + name_of(method));
    }
}

/// Reordering changes which random number meets which lamp, so its rows compare means, like the others.
constexpr double kSameMean = 0.005;

}  // namespace

std::vector<SuiteCase> metamorphic_rows(const Subject* subject)
{
    const auto with = [subject](void (*run_on)(CaseRun&, const Subject&)) {
        return [subject, run_on](CaseRun& run) { run_on(run, *subject); };
    };
    const std::string group = "this scene";
    const std::string noise = "other random numbers: records' noise in the mean of the picture";
    return {
        {{"scale", group, "Scaled by 1e-4, 1e-2, 1e3, 1e5", "constants in metres", "same picture", kSameMean, noise,
          true},
         with(scale_scene)},
        {{"translate", group, "Moved by 1e3, 1e5, 1e6 m", "coarse floats far from zero", "same picture", kSameMean,
          noise, true},
         with(translate_scene)},
        {{"rotate", group, "Rotated, z up, mirrored", "axes treated differently, winding", "same picture", kSameMean,
          noise, true},
         with(rotate_scene)},
        {{"relight", group, "All light times 2^-20 and 2^20", "thresholds in radiance", "same picture", 1e-4,
          "only scaling by a power of two: equal but for what is below the least normal float", true},
         with(relight_scene)},
        {{"reorder", group, "Instances, triangles and lamps in reverse order", "results that depend on order",
          "same picture", kSameMean, noise, true},
         with(reorder_scene)},
        {{"rethread", group, "1, 2 and 3 threads", "results that depend on timing", "same bits", 0.0,
          "nothing may depend on threads", true},
         with(rethread_scene)},
        {{"splatters", group, "Quads, tiles and tiles on the device", "three implementations of one definition",
          "same picture", 1e-4, "sums in another order", true},
         with(splats_against_tiles)},
    };
}

}  // namespace rcs::stability
