// Group E: lights and materials at the ends of their ranges.
#include <cmath>
#include <numbers>

#include "material/bsdf.h"
#include "rcs/error.h"
#include "rcs/image_io.h"
#include "rcs/tone_map.h"
#include "stability/case_run.h"
#include "stability/export_glb.h"
#include "stability/metamorphic.h"
#include "stability/scenes.h"

namespace rcs::stability {
namespace {

void nothing_there(CaseRun& run)
{
    const auto black = [&](const Scene& scene, const std::string& words) {
        const RenderResult result = run.render(scene, small_options(24), words);
        double most = 0.0;
        const std::vector<float>& beauty = result.image.layers.at("beauty").pixels;
        for (std::size_t i = 0; i < beauty.size(); ++i)
            if (i % 4 != 3) most = std::max(most, static_cast<double>(beauty[i]));
        run.figure(most, "radiance, " + words);
        run.require(!result.stats.plan[Effect::indirect_diffuse].needed &&
                        !result.stats.plan[Effect::indirect_diffuse].reason.empty(),
                    words + ": the plan does not say why there is no indirect light");
    };
    black(emissive_box(0.5f, 0.0f), "no light");
    Scene empty;
    empty.cameras = {look_at_camera("camera", {0, 0, 0}, {0, 0, -1}, 0.8)};
    black(empty, "no geometry");
    Scene away = furnished_room();
    away.cameras = {look_at_camera("camera", {0, 0, 50}, {0, 0, 99}, 0.8)};
    black(away, "camera sees nothing");
    Scene dark = furnished_room();
    dark.meshes.resize(2);  // without the lamp's own glow
    dark.instances.resize(2);
    for (Material& material : dark.materials) material.base_color = glm::vec3(0.0f);
    black(dark, "all black");
    // Nothing but the sky: its radiance, and no cover.
    empty.sky_radiance = glm::vec3(0.5f);
    const LayeredImage sky = run.render(empty, small_options(16), "sky alone").image;
    run.require(sky.layers.at("beauty").at(8, 8)[0] == 0.5f && sky.layers.at("beauty").at(8, 8)[3] == 0.0f,
                "an empty scene does not show the sky");
}

void awkward_lights(CaseRun& run)
{
    const Scene base = furnished_room();
    const auto with_light = [&](glm::dvec3 position, const std::string& words) {
        Scene scene = base;
        scene.lights = {point_light(position, glm::vec3(1.0f))};
        run.render(scene, small_options(48), words);
    };
    with_light({0.0, 0.0, 0.0}, "light on the floor's plane, inside the block");
    with_light({-0.8, 0.6, 0.0}, "light on the block's side");
    with_light({-2.0, 0.0, -2.0}, "light in a corner");
    with_light(camera_position(base.cameras[0]), "light at the camera");
    Scene lamp = base;
    lamp.meshes[2] = quad({-0.5f, 2.9f, -0.5f}, {1, 0, 0}, {0, 0, 0}, 2);
    run.render(lamp, small_options(48), "emitter without area");
    lamp.meshes[2] = quad({-0.5f, 3.0f, -0.5f}, {1, 0, 0}, {0, 0, 1}, 2);
    run.render(lamp, small_options(48), "emitter in the ceiling's plane");
    lamp.meshes[2] = quad({-0.5f, -0.1f, -0.7f}, {1, 0, 0}, {0, 1, 0}, 2);
    run.render(lamp, small_options(48), "emitter through the floor and the block");
    run.figure(0.0, "all pictures finite");
}

void strong_and_near_lights(CaseRun& run)
{
    // A point light at height h over a plane: E = I h / (h^2 + r^2)^(3/2).
    const int size = 64;
    const double strong = 1e9, weak = 1e-9;
    for (const double height : {1e-3, 0.5}) {
        Scene scene;
        add_mesh(scene, quad({-50, 0, -50}, {0, 0, 100}, {100, 0, 0}, add_material(scene, glm::vec3(1.0f))));
        // The weak one lights what the strong one, below the plane, does not reach.
        scene.lights = {point_light({0.1, height, 0.0}, glm::vec3(static_cast<float>(height < 0.1 ? strong : weak))),
                        point_light({0.0, -0.5, 0.0}, glm::vec3(static_cast<float>(strong)))};
        Camera camera = look_at_camera("camera", {0, 2, 0}, {0, 0, 0}, 0.8, {0, 0, -1});
        camera.projection = Projection::orthographic;
        camera.ymag = 0.3;
        scene.cameras = {camera};
        const LayeredImage image = run.render(scene, small_options(size), "lights of 1e9 and 1e-9 cd").image;
        double got = 0.0, expected = 0.0;
        for (int y = 0; y < size; ++y) {
            for (int x = 0; x < size; ++x) {
                const double px = 0.3 * ((x + 0.5) / size * 2.0 - 1.0) - 0.1, pz = 0.3 * ((y + 0.5) / size * 2.0 - 1.0);
                const double intensity = height < 0.1 ? strong : weak;
                expected += intensity * height / std::pow(height * height + px * px + pz * pz, 1.5) / kPi;
                got += static_cast<double>(image.layers.at("direct").at(x, y)[0]);
            }
        }
        run.figure(std::abs(got / expected - 1.0), "mean direct light, lamp at " + text_of(height) + " m");
    }
}

/// A panel of this roughness that shows a room.
Scene glossy_panel(float metallic, float roughness, float color)
{
    Scene scene;
    const int wall = add_material(scene, {0.7f, 0.5f, 0.3f});
    add_mesh(scene, box({-2, 0, -2}, {2, 3, 2}, wall, Facing::inwards));
    add_mesh(scene, quad({-1.5f, 0.5f, -1.5f}, {3, 0, 0}, {0, 2, 0},
                         add_material(scene, glossy(metallic, roughness, glm::vec3(color)))));
    scene.lights = {point_light({1.2, 2.2, 1.2}, glm::vec3(2.0f))};
    scene.cameras = {look_at_camera("camera", {0.8, 1.4, 0.8}, {-0.2, 1.5, -1.5}, 0.7)};
    return scene;
}

void ends_of_materials(CaseRun& run)
{
    for (const float metallic : {0.0f, 1.0f})
        for (const float roughness : {0.0f, 1e-4f, 1.0f})
            for (const float color : {0.0f, 1.0f})
                run.render(glossy_panel(metallic, roughness, color), small_options(32),
                           "metallic " + text_of(static_cast<double>(metallic)) + ", roughness " +
                               text_of(static_cast<double>(roughness)));
    run.figure(0.0, "all pictures finite");
    // Factors beyond their range are moved into it by the loader.
    Scene bright = glossy_panel(0.0f, 0.5f, 1.0f);
    bright.materials[0].base_color = glm::vec3(1.5f);
    const std::string path = run.folder() + "/bright.glb";
    export_glb(bright, path);
    std::string said;
    const Scene clamped = load_scene(path, [&](LogLevel, std::string_view line) { said += std::string(line) + "\n"; });
    run.require(clamped.materials[0].base_color.r <= 1.0f && !said.empty(),
                "a base colour of 1.5 is not moved into [0, 1] with a warning");
}

void continuous_in_roughness(CaseRun& run)
{
    // Where one technique ends and the next begins: lobes by rays, by records; a mirror's end.
    RenderOptions options = small_options(192);
    options.lobe_rays = 64;
    for (const float edge : {std::sqrt(0.3f), std::sqrt(1e-3f)}) {
        for (const float metallic : {0.0f, 1.0f}) {
            const LayeredImage below =
                run.render(glossy_panel(metallic, edge - 0.002f, 0.8f), options, "below the switch").image;
            const LayeredImage above =
                run.render(glossy_panel(metallic, edge + 0.002f, 0.8f), options, "above the switch").image;
            run.figure(difference_of_means(above, below, "beauty"),
                       "mean step at roughness " + text_of(static_cast<double>(edge)) + ", metallic " +
                           text_of(static_cast<double>(metallic)));
        }
    }
}

void grazing_view(CaseRun& run)
{
    Scene scene = furnished_room();
    const double slope = std::tan(glm::radians(0.1));
    scene.cameras = {look_at_camera("camera", {1.9, 0.01 + 3.8 * slope, 1.0}, {-1.9, 0.01, 1.0}, 0.02)};
    run.render(scene, small_options(48), "floor seen at 89.9 degrees");
    // Single lobes are reciprocal; layers over each other are so only nearly (material/bsdf.h).
    for (const float roughness : {0.05f, 0.3f, 0.9f}) {
        Bsdf metal;
        metal.add(make_lobe<Specular>(glm::vec3(0.7f), 1.0f, roughness * roughness));
        for (const double degrees : {60.0, 89.0, 89.9}) {
            const glm::vec3 a(static_cast<float>(std::sin(glm::radians(degrees))), 0.0f,
                              static_cast<float>(std::cos(glm::radians(degrees))));
            const glm::vec3 b = glm::normalize(glm::vec3(-0.6f, 0.2f, 0.5f));
            const double there = static_cast<double>(evaluate(metal, a, b).g),
                         back = static_cast<double>(evaluate(metal, b, a).g);
            run.require(std::isfinite(there) && std::isfinite(back), "not finite at " + text_of(degrees) + " degrees");
            // Turquin's compensation depends on the viewer's angle alone.
            if (roughness < 0.5f && there + back > 0.0)
                run.figure(std::abs(there - back) / (there + back),
                           "difference of both ways at " + text_of(degrees) + " degrees");
        }
    }
}

void narrow_spots(CaseRun& run)
{
    struct Cone {
        const char* inner;
        const char* outer;
    };
    for (const Cone cone :
         {Cone{"0", "0"}, {"0.5", "0.5"}, {"0", "1e-9"}, {"1.5707964", "1.5707964"}, {"0.7", "0.3"}}) {
        Scene scene = furnished_room();
        scene.lights.clear();
        scene.materials[2].emission = glm::vec3(0.0f);
        const std::string path = run.folder() + "/spot.glb";
        PunctualLight spot = point_light({1.0, 2.5, 1.0}, glm::vec3(5.0f));
        spot.kind = LightKind::spot;
        spot.direction = {0, -1, 0};
        scene.lights = {spot};
        export_glb(scene, path);
        // The cone as written by hand: export would refuse nothing, but the scene's own check does.
        const auto text = [&](std::string file) {
            const auto replace = [&](const std::string& key, const std::string& value) {
                const std::size_t at = file.find(key) + key.size();
                const std::size_t end = file.find_first_of(",}", at);
                std::string padded = value;
                padded.resize(end - at, ' ');
                file.replace(at, end - at, value.size() <= end - at ? padded : value.substr(0, end - at));
            };
            replace("\"innerConeAngle\":", cone.inner);
            replace("\"outerConeAngle\":", cone.outer);
            return file;
        };
        rewrite_glb(path, text);
        const Scene loaded = load_scene(path);
        run.render(loaded, small_options(32), std::string("cones ") + cone.inner + " and " + cone.outer);
    }
    run.figure(0.0, "all pictures finite");
}

void white_room(CaseRun& run)
{
    Scene scene = furnished_room();
    for (Material& material : scene.materials) material.base_color = glm::vec3(1.0f);
    double first = 0.0, before = 0.0;
    for (const int bounces : {1, 2, 4, 16, 64}) {
        RenderOptions options = small_options(48);
        options.bounces = bounces;
        const double mean =
            spread_of(run.render(scene, options, std::to_string(bounces) + " bounces").image, "indirect").mean;
        if (bounces == 1) first = mean;
        run.require(mean > before, std::to_string(bounces) + " bounces are darker than fewer");
        // No bounce has more power than the one before; the first one's share of what is in view may be small.
        run.figure(mean / (bounces * first),
                   "light of " + std::to_string(bounces) + " bounces over that of as many first ones");
        before = mean;
    }
}

void sun_and_candle(CaseRun& run)
{
    Scene scene;
    const int wall = add_material(scene, glm::vec3(0.5f));
    // An open half under the sun, and a closed box with a candle, both in view from above.
    add_mesh(scene, quad({-4, 0, -2}, {0, 0, 4}, {4, 0, 0}, wall));
    add_mesh(scene, box({0.01f, 0, -2}, {4, 1, 2}, wall, Facing::inwards));
    PunctualLight sun;
    sun.name = "sun";
    sun.kind = LightKind::directional;
    sun.direction = glm::normalize(glm::dvec3(0.0, -1.0, -0.2));
    sun.intensity = glm::vec3(1e5f);
    scene.lights = {sun, point_light({2, 0.5, 0}, glm::vec3(1.0f))};
    Camera camera = look_at_camera("camera", {0, 5, 0}, {0, 0, 0}, 0.8, {0, 0, -1});
    camera.projection = Projection::orthographic;
    camera.ymag = 1.9;
    scene.cameras = {camera};
    const int size = 48;
    const LayeredImage image = run.render(scene, small_options(size)).image;
    const float exposure = automatic_exposure(image.layers.at("beauty"));
    run.require(std::isfinite(exposure), "the automatic exposure is not finite");
    const std::string path = run.folder() + "/both.exr";
    write_exr(path, image);  // as half floats
    const LayeredImage back = read_image(path);
    // The candle's light on the floor, by formula; the ceiling keeps the sun out.
    double worst = 0.0;
    int lit = 0;
    for (int y = 0; y < size; ++y) {
        for (int x = size / 2 + 2; x < size; ++x) {
            const double px = 1.9 * ((x + 0.5) / size * 2.0 - 1.0), pz = 1.9 * ((y + 0.5) / size * 2.0 - 1.0);
            const double d2 = (px - 2) * (px - 2) + pz * pz + 0.25;
            const double expected = 0.5 / kPi * 0.5 / std::pow(d2, 1.5);
            worst = std::max(worst, std::abs(back.layers.at("direct").at(x, y)[0] / expected - 1.0));
            lit += back.layers.at("direct").at(x, y)[0] > 0.0f;
        }
    }
    run.figure(worst, "candle's light in the EXR, worst pixel");
    const double sunlit = static_cast<double>(back.layers.at("direct").at(2, size / 2)[0]),
                 expected = 1e5 * -sun.direction.y * 0.5 / kPi;
    run.figure(std::abs(sunlit / expected - 1.0), "the sun's light in the EXR");
    run.note("exposure " + text_of(static_cast<double>(exposure)) + " EV");
}

}  // namespace

std::vector<SuiteCase> light_and_material_cases()
{
    const std::string group = "lights and materials";
    return {
        {{"E1", group, "No light; no geometry; nothing in view; all black", "division by a sum of nothing",
          "= black, and the plan says why", 0.0, "black is black", true},
         nothing_there},
        {{"E2", group, "Lights in and on surfaces, at the camera; emitters without area", "1/0 at the light", "finite",
          0.0, "nothing is measured", true},
         awkward_lights},
        {{"E3", group, "A light 1 mm above a floor; 1e9 cd beside 1e-9 cd", "overflow, the weak one lost",
          "= I h / r^3", 0.01, "the peak below the lamp is a tenth of a pixel wide", true},
         strong_and_near_lights},
        {{"E4", group, "Roughness 0, 1e-4, 1; metallic 0, 1; base colour 0, 1, 1.5", "division by alpha",
          "finite; factors moved into their range with a warning", 0.0, "nothing is measured", true},
         ends_of_materials},
        {{"E4b", group, "Roughness just below and above the switch between mirrors, traced lobes and records",
          "a step where one technique ends", "no step of the mean", 0.03,
          "records hold a lobe's light with six bands: 3 % rms at hard edges (docs/method.md)", false},
         continuous_in_roughness},
        {{"E5", group, "A floor seen at 89.9 degrees; lobes at grazing angles", "1/cos",
          "finite; a narrow lobe is the same both ways", 0.05,
          "multiple scattering is given back by the viewer's angle alone", true},
         grazing_view},
        {{"E6", group, "Spots with no cone, equal cones, cones out of order", "division by their difference", "finite",
          0.0, "nothing is measured", true},
         narrow_spots},
        {{"E7", group, "A white room, 1 to 64 bounces", "energy that grows",
          "finite, rising with bounces, no faster than them", 1.5,
          "the part of the room in view may get less of the first bounce than of later ones", false},
         white_room},
        {{"E8", group, "A sun of 1e5 lux and a candle of 1 cd in one picture",
          "one of them lost in exposure or half floats", "= both in the EXR", 0.01,
          "half floats have 11 bits: 0.05 %; a point lamp has no noise", true},
         sun_and_candle},
    };
}

}  // namespace rcs::stability
