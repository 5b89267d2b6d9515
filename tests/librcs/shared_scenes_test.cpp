#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "rcs/scene.h"
#include "support/temporary_folder.h"

// The scene files that the project is judged by, against the descriptions beside them.

namespace rcs::test {
namespace {

using Json = nlohmann::json;

struct SharedFile {
    const char* name;
    std::size_t triangles;
    std::vector<std::string> cameras;
    std::size_t lights;
    std::size_t textures;
};

std::size_t triangle_count(const Scene& scene)
{
    std::size_t count = 0;
    for (const Instance& instance : scene.instances) {
        count += scene.meshes.at(static_cast<std::size_t>(instance.mesh)).triangles.size();
    }
    return count;
}

TEST(SharedScenes, HoldWhatTheirDescriptionSays)
{
    const SharedFile files[] = {{"sponza", 66453, {"atrium", "arcade", "gallery"}, 1, 11},
                                {"sibenik", 75283, {"nave", "choir", "aisle"}, 6, 0},
                                {"castle", 60706, {"arcade", "courtyard", "gate"}, 1, 0},
                                {"cornell-box", 36, {"camera"}, 0, 0},
                                {"cornell-box-draco", 4004, {"camera"}, 0, 0},
                                {"cornell-animated", 4004, {"camera"}, 0, 0}};
    for (const SharedFile& file : files) {
        const std::string path = std::string(RCS_SCENES_DIR "/") + file.name + ".glb";
        if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is missing";
        const Scene scene = load_scene(path);
        EXPECT_NO_THROW(validate(scene));
        EXPECT_EQ(triangle_count(scene), file.triangles) << file.name;
        ASSERT_EQ(scene.cameras.size(), file.cameras.size()) << file.name;
        for (std::size_t i = 0; i < file.cameras.size(); ++i) EXPECT_EQ(scene.cameras[i].name, file.cameras[i]);
        EXPECT_EQ(scene.lights.size(), file.lights) << file.name;
        EXPECT_EQ(scene.textures.size(), file.textures) << file.name;
        const Json description = Json::parse(bytes_of(std::string(RCS_SCENES_DIR "/") + file.name + ".json"));
        const Bounds bounds = bounds_of(scene);
        for (int axis = 0; axis < 3; ++axis) {
            const auto a = static_cast<std::size_t>(axis);
            // The description has four decimals; Draco's 14 bits of 5.6 m are 0.34 mm.
            EXPECT_NEAR(bounds.min[axis], description["bounding_box"]["min"][a].get<double>(), 4e-4) << file.name;
            EXPECT_NEAR(bounds.max[axis], description["bounding_box"]["max"][a].get<double>(), 4e-4) << file.name;
        }
    }
}

TEST(SharedScenes, DracoGeometryEqualsThePlainOneWithinQuantisation)
{
    const std::string folder = RCS_SCENES_DIR;
    if (!std::filesystem::exists(folder + "/cornell-box-draco.glb")) GTEST_SKIP() << folder << " is missing";
    const Scene plain = load_scene(folder + "/cornell-box.glb");
    const Scene packed = load_scene(folder + "/cornell-box-draco.glb");
    for (const Instance& instance : plain.instances) {
        const auto twin = std::find_if(packed.instances.begin(), packed.instances.end(),
                                       [&](const Instance& i) { return i.name == instance.name; });
        ASSERT_NE(twin, packed.instances.end()) << instance.name;
        EXPECT_EQ(instance.world_from_object, twin->world_from_object);
        const Mesh& a = plain.meshes.at(static_cast<std::size_t>(instance.mesh));
        const Mesh& b = packed.meshes.at(static_cast<std::size_t>(twin->mesh));
        ASSERT_EQ(a.triangles.size(), b.triangles.size());
        EXPECT_EQ(plain.materials[static_cast<std::size_t>(a.material)].base_color,
                  packed.materials[static_cast<std::size_t>(b.material)].base_color);
        // Draco reorders: every corner must have a twin with its normal. 14 bits of 5.6 m are 0.34 mm; 10
        // bits of an octahedral normal are about 0.002.
        for (std::size_t i = 0; i < a.positions.size(); ++i) {
            float nearest = 1e9f;
            for (std::size_t j = 0; j < b.positions.size(); ++j) {
                const float turned = glm::distance(a.normals.at(i), b.normals.at(j));
                if (turned < 0.01f) nearest = std::min(nearest, glm::distance(a.positions[i], b.positions[j]));
            }
            EXPECT_LT(nearest, 4e-4f) << instance.name << " vertex " << i;
        }
    }
}

}  // namespace
}  // namespace rcs::test
