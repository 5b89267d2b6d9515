#include "cli/shutter.h"

#include "cli/number.h"

namespace rcs::service {

void add_shutter(CLI::App& command, Shutter& shutter, const std::string& help)
{
    add_number(
        command, "--shutter", shutter.open, {0, 1},
        !help.empty()
            ? help
            : "Motion blur: part of the time from frame to frame that is seen, around the frame's own, such as 0.5; "
              "each of the --aa samples shows another moment");
}

MomentFunction moments_of(const SceneArguments& arguments, const CameraSource& camera, const Session& session,
                          const Shutter& shutter, double time)
{
    return [&arguments, &camera, &session, shutter, time, moves = is_animated(arguments.scene)](double part) {
        const double now = shutter.time(time, part);
        Moment moment;
        if (moves) {
            SceneChoice choice = scene_choice(arguments);
            choice.time = now;
            moment.scene = load_scene(choice, {}, &session.scene());  // warned of when the picture's own was loaded
        }
        moment.camera = choose_camera(moment.scene ? *moment.scene : session.scene(), camera.at(now));
        return moment;
    };
}

}  // namespace rcs::service
