#include "rcs/effect_plan.h"

#include <set>
#include <string>

#include <gtest/gtest.h>

#include "support/effect_scenes.h"
#include "support/plans.h"

namespace rcs {
namespace {

using test::add_halves;
using test::add_material;
using test::add_mesh;
using test::add_surface;
using test::lit_room;
using test::metal;
using test::panel;
using test::panel_room;
using test::plan_of;
using test::small;
using test::switched_on;
using test::with;

struct Case {
    const char* name;
    Scene scene;
    std::set<std::string> on;  // beside layers
    const char* effect;        // whose reason
    const char* reason;        // contains this
    RenderOptions options = {};
};

const std::set<std::string> kPlain = {"punctual-light", "indirect-diffuse", "error-estimate", "anti-aliasing"};
std::set<std::string> plain_and(std::initializer_list<std::string> more)
{
    std::set<std::string> names = kPlain;
    names.insert(more);
    return names;
}

Scene with_sky(bool sun)
{
    Scene scene = test::furnace(0.5f, sun ? 0.0f : 1.0f);
    if (sun) {
        scene.environment.width = 64;
        scene.environment.height = 32;
        scene.environment.radiance.assign(64 * 32, glm::vec3(0.5f));
        scene.environment.radiance[64 * 4 + 10] = glm::vec3(1e4f);
    }
    return scene;
}

Scene black_walls_that_shine()
{
    Scene scene;
    add_mesh(scene, test::box({-2, 0, -2}, {2, 3, 2}, add_material(scene, glm::vec3(0.0f), glm::vec3(1.0f)),
                              test::Facing::inwards));
    scene.cameras = test::room(0.0f).cameras;
    return scene;
}

Scene unlit_room()
{
    Scene scene = lit_room();
    scene.materials[0].unlit = true;
    return scene;
}

Scene lamp_room()
{
    Scene scene = test::room(0.5f);
    add_mesh(scene, test::quad({-0.5f, 2.9f, -1.5f}, {1, 0, 0}, {0, 0, 1},
                               add_material(scene, glm::vec3(0.0f), glm::vec3(5.0f))));
    return scene;
}

Scene nothing()
{
    Scene scene;
    scene.cameras = test::room(0.0f).cameras;
    return scene;
}

Scene turned_away(Scene scene, glm::dvec3 target)
{
    scene.cameras[0] = look_at_camera("camera", {0.0, 1.5, 1.8}, target, 0.9);
    return scene;
}

Scene mirror_behind_a_screen()
{
    Scene scene = panel_room(metal(0.0f), -1.5f);
    add_mesh(scene, test::quad({-0.8f, 0.7f, -1.0f}, {1.6f, 0, 0}, {0, 1.6f, 0}, add_material(scene, glm::vec3(0.5f))));
    return scene;
}

Scene rough_texture(float left, float right)
{
    Scene scene = lit_room();
    Material material = metal(1.0f);
    material.metallic_roughness_texture = add_halves(scene, {0, left, 1, 1}, {0, right, 1, 1});
    add_mesh(scene, panel(add_surface(scene, material)));
    return scene;
}

/// Brushed by strengths of a texture.
Scene brushed(float left, float right)
{
    Scene scene = lit_room();
    Material material = metal(0.8f);
    material.anisotropy = 0.5f;
    material.anisotropy_texture = add_halves(scene, {1, 0.5f, left, 1}, {1, 0.5f, right, 1});
    add_mesh(scene, panel(add_surface(scene, material)));
    return scene;
}

Scene with_alpha(AlphaMode mode, float left, float right, float z = -1.0f)
{
    Scene scene = lit_room();
    Material material;
    material.base_color = glm::vec3(0.5f);
    material.alpha_mode = mode;
    material.double_sided = true;
    material.base_color_texture = add_halves(scene, {1, 1, 1, left}, {1, 1, 1, right});
    add_mesh(scene, panel(add_surface(scene, material), z));
    return scene;
}

Scene vertex_alpha(float alpha)
{
    Material material;
    material.alpha_mode = AlphaMode::blend;
    Scene scene = panel_room(material);
    scene.meshes.back().colors.assign(4, {1, 1, 1, alpha});
    return scene;
}

Scene with_normals(glm::vec3 left, glm::vec3 right, float scale)
{
    Scene scene = lit_room();
    Material material;
    material.normal_texture = add_halves(scene, glm::vec4(left, 1), glm::vec4(right, 1));
    material.normal_scale = scale;
    add_mesh(scene, panel(add_surface(scene, material)));
    return scene;
}

Scene with_texture(glm::vec3 left, glm::vec3 right)
{
    Scene scene = lit_room();
    Material material;
    material.base_color_texture = add_halves(scene, glm::vec4(left, 1), glm::vec4(right, 1));
    add_mesh(scene, panel(add_surface(scene, material)));
    return scene;
}

Scene twice_the_panel()
{
    Scene scene = panel_room(Material{});
    Instance more = scene.instances.back();
    more.world_from_object[3] = {0.0, 0.0, -0.5, 1.0};
    scene.instances.push_back(more);
    return scene;
}

Material coat()
{
    Material material;
    material.clearcoat = 1.0f;
    return material;
}

Material glass()
{
    Material material;
    material.specular = 1.0f;
    material.transmission = 1.0f;
    material.roughness = 0.0f;
    material.double_sided = true;
    return material;
}

std::vector<Case> cases()
{
    Scene dark_lamp = lit_room();
    dark_lamp.lights[0].intensity = glm::vec3(0.0f);
    Scene mirror_in_the_dark = panel_room(metal(0.0f));
    mirror_in_the_dark.lights.clear();
    return {
        {"nothing", nothing(), {}, "anti-aliasing", "nothing lies in the view"},
        {"no light", test::room(0.5f), {"anti-aliasing"}, "indirect-diffuse", "nothing shines"},
        {"a lamp of intensity 0", dark_lamp, {"anti-aliasing"}, "punctual-light", "no lamp without size shines"},
        {"unlit",
         unlit_room(),
         {"emission", "anti-aliasing"},
         "punctual-light",
         "the scene has no surface that reflects"},
        {"black and shining",
         black_walls_that_shine(),
         {"emission", "anti-aliasing"},
         "area-light",
         "the scene has no surface that reflects"},
        {"point light", lit_room(), kPlain, "punctual-light", "1 lamp without size shines"},
        {"no bounce",
         lit_room(),
         {"punctual-light", "anti-aliasing"},
         "indirect-diffuse",
         "no bounce is asked for and the sky's radiance is 0",
         with(small(), 0)},
        {"one sample",
         lit_room(),
         {"punctual-light", "indirect-diffuse", "error-estimate"},
         "anti-aliasing",
         "one sample a pixel",
         with(small(), 1, 1)},
        {"area light",
         lamp_room(),
         {"emission", "area-light", "indirect-diffuse", "error-estimate", "anti-aliasing"},
         "area-light",
         "2 triangles shine"},
        {"a lamp behind the camera",
         turned_away(lamp_room(), {0.0, 0.0, 1.7}),
         {"area-light", "indirect-diffuse", "error-estimate", "anti-aliasing"},
         "emission",
         "no surface that shines lies in the view"},
        {"constant sky",
         with_sky(false),
         {"emission", "environment", "indirect-diffuse", "error-estimate", "anti-aliasing"},
         "environment-peaks",
         "no part of the sky"},
        {"sky, no bounce",
         with_sky(false),
         {"emission", "environment", "indirect-diffuse", "error-estimate", "anti-aliasing"},
         "environment",
         "the sky is not black",
         with(small(), 0)},
        {"sky with a sun",
         with_sky(true),
         {"emission", "environment", "environment-peaks", "indirect-diffuse", "error-estimate", "anti-aliasing"},
         "environment-peaks",
         "brighter than 8 times its mean"},
        {"many bounces", lit_room(0.5f), plain_and({"more-bounces"}), "more-bounces", "8 bounces asked for",
         with(small(), 8)},
        {"dark walls", lit_room(0.1f), plain_and({"more-bounces"}), "more-bounces", "beyond 4 of the 64 bounces",
         with(small(), 64)},
        {"nearly black walls", lit_room(0.0009f), kPlain, "more-bounces", "beyond 1 of the 8 bounces",
         with(small(), 8)},
        {"wide lobe", panel_room(metal(0.8f)), plain_and({"highlights", "glossy-records"}), "traced-lobes",
         "the scene has no coat"},
        {"mirror", panel_room(metal(0.0f)), plain_and({"highlights", "traced-lobes"}), "traced-lobes",
         "% of the picture shows a coat"},
        {"mirror in the dark", mirror_in_the_dark, {"anti-aliasing"}, "traced-lobes", "there is no indirect light"},
        {"mirror beside the view", turned_away(panel_room(metal(0.0f)), {0.0, 1.5, 3.0}), kPlain, "traced-lobes",
         "lies in the view"},
        {"mirror behind a screen", mirror_behind_a_screen(), kPlain, "traced-lobes",
         "none of the picture's samples meets"},
        {"coat", panel_room(coat()), plain_and({"highlights", "traced-lobes"}), "glossy-records",
         "the scene has no surface with a lobe of roughness 0.55"},
        {"roughness 0.2 to 0.9", rough_texture(0.2f, 0.9f),
         plain_and({"highlights", "glossy-records", "traced-lobes", "hit-textures"}), "glossy-records",
         "% of the picture"},
        {"roughness 0.7 to 0.9", rough_texture(0.7f, 0.9f), plain_and({"highlights", "glossy-records", "hit-textures"}),
         "traced-lobes", "lobes of the scene have roughness 0.7 to 0.9"},
        {"roughness 0.2 to 0.4", rough_texture(0.2f, 0.4f), plain_and({"highlights", "traced-lobes", "hit-textures"}),
         "glossy-records", "the scene has no surface"},
        {"brushed by 0 to 0.5", brushed(0.0f, 1.0f),
         plain_and({"highlights", "glossy-records", "traced-lobes", "hit-textures"}), "glossy-records",
         "% of the picture"},
        {"brushed by 0.2 to 0.5", brushed(0.4f, 1.0f), plain_and({"highlights", "traced-lobes", "hit-textures"}),
         "glossy-records", "the scene has no surface"},
        {"glass", panel_room(glass()), plain_and({"highlights", "traced-lobes", "transmission", "peeling"}),
         "transmission", "1 mesh lets light through"},
        {"mask with holes", with_alpha(AlphaMode::mask, 1.0f, 0.0f),
         plain_and({"alpha-mask", "peeling", "hit-textures"}), "alpha-mask", "1 mesh has alpha below the cutoff"},
        {"mask without holes", with_alpha(AlphaMode::mask, 1.0f, 0.6f), plain_and({"hit-textures"}), "alpha-mask",
         "materials are masked, but no texel"},
        {"mask behind the camera", with_alpha(AlphaMode::mask, 1.0f, 0.0f, 1.95f),
         plain_and({"alpha-mask", "hit-textures"}), "peeling", "lies in the view"},
        {"blend", with_alpha(AlphaMode::blend, 1.0f, 0.5f), plain_and({"alpha-blend", "peeling", "hit-textures"}),
         "alpha-blend", "1 mesh has alpha below 1"},
        {"blend of alpha 1", with_alpha(AlphaMode::blend, 1.0f, 1.0f), kPlain, "alpha-blend",
         "materials are blended, but no texel"},
        {"vertex alpha", vertex_alpha(0.5f), plain_and({"alpha-blend", "peeling"}), "peeling", "% of the picture"},
        {"vertex alpha of 1", vertex_alpha(1.0f), kPlain, "alpha-blend", "no texel or vertex"},
        {"normal map", with_normals({0.5f, 0.5f, 1.0f}, {0.8f, 0.5f, 0.8f}, 1.0f), plain_and({"normal-maps"}),
         "normal-maps", "% of the picture"},
        {"normal map of strength 0", with_normals({0.5f, 0.5f, 1.0f}, {0.8f, 0.5f, 0.8f}, 0.0f), kPlain, "normal-maps",
         "no normal texture turns a normal"},
        {"flat normal map", with_normals({0.5f, 0.5f, 1.0f}, {0.5f, 0.5f, 1.0f}, 1.0f), kPlain, "normal-maps",
         "no normal texture turns a normal"},
        {"texture", with_texture({1, 0, 0}, {0, 1, 0}), plain_and({"hit-textures"}), "hit-textures",
         "1 mesh reflects by textures that vary"},
        {"texture of one colour", with_texture({1, 0, 0}, {1, 0, 0}), kPlain, "hit-textures",
         "no mesh reflects by a texture that varies"},
        {"texture, no bounce",
         with_texture({1, 0, 0}, {0, 1, 0}),
         {"punctual-light", "anti-aliasing"},
         "hit-textures",
         "no ray's hit is lit",
         with(small(), 0)},
        {"a mesh used twice", twice_the_panel(), plain_and({"instancing"}), "instancing",
         "1 mesh is used more than once"},
    };
}

TEST(EffectPlan, IsWhatEachSceneCallsFor)
{
    for (const Case& c : cases()) {
        SCOPED_TRACE(c.name);
        RenderOptions options = c.options;
        options.width = options.height = 64;
        const EffectPlan plan = plan_of(c.scene, options);
        EXPECT_EQ(switched_on(plan), c.on);
        EXPECT_NE(plan[find_effect(c.effect)].reason.find(c.reason), std::string::npos)
            << plan[find_effect(c.effect)].reason;
        for (const PlannedEffect& e : plan.effects) {
            EXPECT_FALSE(e.reason.empty()) << name_of(e.effect);
            EXPECT_FALSE(e.chosen) << name_of(e.effect);
        }
    }
}

}  // namespace
}  // namespace rcs
