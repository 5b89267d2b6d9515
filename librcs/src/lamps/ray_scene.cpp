#include "rcs/ray_scene.h"

#include <memory>
#include <utility>

#include "lamps/lights.h"
#include "lamps/relight.h"
#include "rays/ray_scene_impl.h"

namespace rcs {

RayScene build_ray_scene(const Scene& scene, const ThreadPool& pool)
{
    return build_ray_scene(scene, pool, EffectChoice{});
}

RayScene build_ray_scene(const Scene& scene, const ThreadPool& pool, const EffectChoice& effects)
{
    std::unique_ptr<RayScene::Impl> impl = make_ray_scene(scene, pool, effects);
    RayScene::Impl& built = *impl;
    RayScene rays(std::move(impl));
    built.lights = std::make_shared<const Lights>(find_lights(rays));
    return rays;
}

void relight(RayScene& rays)
{
    RayScene::Impl& impl = rays.impl();
    impl.environment = Environment(rays.scene());
    impl.lights = std::make_shared<const Lights>(find_lights(rays));
}

}  // namespace rcs
