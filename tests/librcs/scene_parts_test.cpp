#include "scene/scene_parts.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <vector>

#include <glm/gtc/matrix_transform.hpp>

#include "support/scenes.h"

namespace rcs {
namespace {

TEST(ChangedInstances, AreThoseThatMovedOrAreMadeOtherwise)
{
    const Scene scene = test::furnished_room();
    const auto changed = [&](const Scene& other) { return changed_instances(scene, other); };
    const std::size_t count = scene.instances.size();
    EXPECT_EQ(changed(scene), std::vector<bool>(count));
    Scene lit = scene, moved = scene;
    lit.lights.push_back(test::point_light({-1.5, 2.0, 1.0}, {3.0f, 1.0f, 0.5f}));
    moved.instances[1].world_from_object = glm::translate(glm::dmat4(1.0), glm::dvec3(0.1, 0.0, 0.0));
    EXPECT_EQ(changed(lit), std::vector<bool>(count));
    std::vector<bool> only_block(count);
    only_block[1] = true;
    EXPECT_EQ(changed(moved), only_block);

    Scene painted = scene;
    const int mesh = scene.instances[1].mesh;
    painted.materials[static_cast<std::size_t>(scene.meshes[static_cast<std::size_t>(mesh)].material)].base_color *=
        0.5f;
    const auto of_paint = changed(painted);
    ASSERT_TRUE(of_paint.has_value());
    EXPECT_TRUE((*of_paint)[1]);
    Scene bent = scene;
    bent.meshes[static_cast<std::size_t>(mesh)].positions.front().x += 0.01f;
    ASSERT_TRUE(changed(bent).has_value());
    EXPECT_TRUE((*changed(bent))[1]);

    Scene more = scene;
    more.instances.push_back(more.instances.back());
    EXPECT_FALSE(changed(more).has_value());
}

}  // namespace
}  // namespace rcs
