#include "output/moments.h"

namespace rcs::service {

MomentFunction moments_of(const SceneChoice& scene, const std::function<CameraChoice(double)>& camera,
                          const Session& session, Exposed exposed)
{
    return [scene, camera, &session, exposed, moves = is_animated(scene.source)](double part) {
        const double now = exposed.at(part);
        Moment moment;
        if (moves) {
            SceneChoice choice = scene;
            choice.time = now;
            moment.scene = load_scene(choice, {}, &session.scene());  // warned of when the picture's own was loaded
        }
        moment.camera = choose_camera(moment.scene ? *moment.scene : session.scene(), camera(now));
        return moment;
    };
}

}  // namespace rcs::service
