#include "rcs/scene_choice.h"

#include <memory>
#include <numbers>
#include <utility>

#include "scene/load_within.h"

namespace rcs {

void set_environment(Scene& scene, const EnvironmentChoice& choice, const LogFunction& log)
{
    if (choice.radiance || !choice.image.empty()) {
        scene.sky_radiance = choice.radiance.value_or(glm::vec3(0.0f));
        scene.environment = choice.radiance ? EnvironmentImage{} : load_environment(choice.image, log);
    }
    scene.environment.rotation += choice.rotation_degrees * std::numbers::pi / 180.0;
}

Scene load_scene(const SceneChoice& choice, const LogFunction& log, const Scene* like)
{
    Scene scene = load_scene_within(choice.source, choice.asset_root, log, {choice.time, choice.animation, like});
    set_environment(scene, choice.environment, log);
    return scene;
}

Camera choose_camera(const Scene& scene, const CameraChoice& choice)
{
    Camera camera = choice.given ? *choice.given : find_camera(scene, choice.name);
    if (choice.given) camera.world_from_view[3] -= glm::dvec4(scene.origin, 0.0);
    if (choice.lens_shift) camera.lens_shift = *choice.lens_shift;
    return camera;
}

MotionFrom load_motion(const MotionChoice& choice, const Scene& scene, const SceneChoice& picture,
                       const CameraChoice& camera)
{
    std::shared_ptr<Scene> pose;
    if (choice.time && choice.time != picture.time && is_animated(picture.source)) {
        pose = std::make_shared<Scene>(
            load_scene_within(picture.source, picture.asset_root, {}, {choice.time, picture.animation, &scene}));
        pose->textures.clear();
    }
    const Camera then = choose_camera(pose ? *pose : scene, choice.camera.value_or(camera));
    return {std::move(pose), then};
}

}  // namespace rcs
