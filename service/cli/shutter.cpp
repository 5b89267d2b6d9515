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
    return moments_of(
        scene_choice(arguments), [&camera](double now) { return camera.at(now); }, session, shutter.exposed(time));
}

}  // namespace rcs::service
