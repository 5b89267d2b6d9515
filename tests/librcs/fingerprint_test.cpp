#include "rcs/fingerprint.h"

#include <functional>
#include <set>

#include <gtest/gtest.h>

#include "support/scenes.h"

namespace rcs {
namespace {

std::string print_of(const Scene& scene)
{
    Fingerprint print;
    add(print, scene);
    return print.text();
}

TEST(Fingerprint, IsTheSameForTheSameSceneLoadedTwice)
{
    EXPECT_EQ(print_of(load_scene("demo:cornell")), print_of(load_scene("demo:cornell")));
    EXPECT_NE(print_of(load_scene("demo:cornell")), print_of(load_scene("demo:atrium")));
}

TEST(Fingerprint, ChangesWithAllThatLightDependsOn)
{
    Scene scene = test::furnished_room();
    scene.textures.push_back({"grey", {{1, 1, {{1, 2, 3, 4}}}}});
    scene.lights.push_back({});
    scene.environment = {"sky", 1, 1, {glm::vec3(1.0f)}, 0.0};
    const std::vector<std::function<void(Scene&)>> changes{
        [](Scene& s) { s.textures.back().levels = {{1, 1, {{1, 2, 3, 5}}}}; },
        [](Scene& s) { s.materials[0].base_color.g *= 0.999f; },
        [](Scene& s) { s.materials[0].double_sided = !s.materials[0].double_sided; },
        [](Scene& s) { s.materials[0].clearcoat_texture.wrap_v = Wrap::clamp_to_edge; },
        [](Scene& s) { s.meshes[0].positions[0].x += 1e-3f; },
        [](Scene& s) { std::swap(s.meshes[0].triangles[0].x, s.meshes[0].triangles[0].y); },
        [](Scene& s) { s.instances[0].world_from_object[3].x += 1e-9; },
        [](Scene& s) { s.lights.back().inner_cone = 0.1f; },
        [](Scene& s) { s.lights.pop_back(); },
        [](Scene& s) { s.environment.radiance[0].b = 2.0f; },
        [](Scene& s) { s.environment.rotation = 1.0; },
        [](Scene& s) { s.sky_radiance.r += 0.5f; },
        [](Scene& s) { s.meshes.emplace_back(); }};
    std::set<std::string> prints{print_of(scene)};
    for (std::size_t i = 0; i < changes.size(); ++i) {
        Scene changed = scene;
        changes[i](changed);
        EXPECT_TRUE(prints.insert(print_of(changed)).second) << "change " << i << " goes unseen";
    }
}

TEST(Fingerprint, DoesNotChangeWithNames)
{
    const Scene scene = test::furnished_room();
    Scene renamed = scene;
    renamed.name = "renamed";
    for (Material& material : renamed.materials) material.name = "renamed";
    for (Mesh& mesh : renamed.meshes) mesh.name = "renamed";
    for (Instance& instance : renamed.instances) instance.name = "renamed";
    EXPECT_EQ(print_of(renamed), print_of(scene));
}

TEST(Fingerprint, KnowsCamerasByTheirView)
{
    const Camera camera = look_at_camera("a", {0.0, 1.0, 3.0}, {0.0, 0.0, 0.0}, 0.8);
    const auto print = [](const Camera& of) {
        Fingerprint result;
        add(result, of);
        return result.text();
    };
    Camera other = camera;
    other.name = "b";
    EXPECT_EQ(print(other), print(camera));
    other.yfov = 0.81;
    EXPECT_NE(print(other), print(camera));
    EXPECT_NE(print(look_at_camera("a", {0.0, 1.0, 3.001}, {0.0, 0.0, 0.0}, 0.8)), print(camera));
}

TEST(Fingerprint, TellsWhereOneTextEndsAndTheNextBegins)
{
    Fingerprint a, b, c;
    for (const char* text : {"ab", "c"}) a.add(std::string_view(text));
    for (const char* text : {"a", "bc"}) b.add(std::string_view(text));
    for (const char* text : {"ab", "c"}) c.add(std::string_view(text));
    EXPECT_NE(a.text(), b.text());
    EXPECT_EQ(a.text(), c.text());
    EXPECT_EQ(a.text().size(), 16u);
}

}  // namespace
}  // namespace rcs
