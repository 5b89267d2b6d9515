#include "cli/batch_scene.h"

#include <filesystem>
#include <fstream>
#include <iterator>

#include <sys/stat.h>

#include "rcs/error.h"
#include "rcs/fingerprint.h"
#include "rcs/version.h"

namespace rcs::service {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> files_of(const SceneArguments& arguments)
{
    std::vector<std::string> files;
    if (!arguments.scene.starts_with("demo:")) {
        const fs::path folder = fs::path(arguments.scene).parent_path();
        for (const std::string& name : scene_files(scene_choice(arguments))) files.push_back((folder / name).string());
    }
    const EnvironmentChoice environment = scene_choice(arguments).environment;
    if (!environment.image.empty()) files.push_back(environment.image);
    return files;
}

/// Of the bytes of all files, in their order.
std::string hash_of(const std::vector<std::string>& files, const SceneArguments& arguments)
{
    Fingerprint print;
    if (files.empty()) print.add(arguments.scene + " " + kVersion);
    for (const std::string& name : files) {
        std::ifstream file(name, std::ios::binary);
        const std::string bytes{std::istreambuf_iterator<char>(file), {}};
        if (!file && !file.eof()) throw Error(ErrorCode::io, name + ": cannot be read");
        print.add(bytes);
    }
    return print.text();
}

}  // namespace

BatchScene::BatchScene(const SceneArguments& arguments)
    : arguments_(arguments),
      camera_(arguments),
      files_(files_of(arguments)),
      content_(hash_of(files_, arguments)),
      stamps_(stamps()),
      is_animated_(rcs::is_animated(arguments.scene))
{
}

std::string BatchScene::source_at(double time) const
{
    Fingerprint print;
    print.add(content_);
    const SceneChoice scene = scene_choice(arguments_);
    print.add(scene.environment.radiance.has_value());
    for (int i = 0; i < 3; ++i) print.add(scene.environment.radiance.value_or(glm::vec3(0.0f))[i]);
    print.add(scene.environment.image.empty());
    print.add(scene.environment.rotation_degrees);
    if (is_animated_) print.add(time);
    print.add(scene.animation == kAllAnimations ? std::string() : scene.animation);
    const CameraChoice camera = camera_at(time);
    print.add(camera.name);
    add(print, camera.given.value_or(Camera{}));
    const glm::dvec2 shift = camera.lens_shift.value_or(glm::dvec2(0.0));
    print.add(camera.lens_shift.has_value());
    print.add(shift.x);
    print.add(shift.y);
    return print.text();
}

void BatchScene::show(Session& session, double time, const LogFunction& log)
{
    if (shown_ && (*shown_ == time || !is_animated_)) return;
    shown_.reset();
    SceneChoice choice = scene_choice(arguments_);
    choice.time = time;
    session.show(load_scene(choice, log, session.has_scene() ? &session.scene() : nullptr));
    shown_ = time;
}

Camera BatchScene::camera(const Session& session, double time, const LogFunction& log) const
{
    const CameraChoice asked = camera_at(time);
    if (!is_animated_ || asked.given || shown_ == time) return choose_camera(session.scene(), asked);
    SceneChoice choice = scene_choice(arguments_);
    choice.time = time;
    const Scene then = load_scene(choice, log, &session.scene());
    Camera camera = choose_camera(then, asked);
    camera.world_from_view[3] += glm::dvec4(then.origin - session.scene().origin, 0.0);
    return camera;
}

MomentFunction BatchScene::moments(const Session& session, const Shutter& shutter, double time)
{
    shown_.reset();
    return moments_of(arguments_, camera_, session, shutter, time);
}

std::string BatchScene::stamps() const
{
    std::string text;
    for (const std::string& name : files_) {
        struct stat status{};
        if (::stat(name.c_str(), &status) != 0) return name + " is gone";
        for (const auto number : {static_cast<long>(status.st_size), static_cast<long>(status.st_mtim.tv_sec),
                                  static_cast<long>(status.st_mtim.tv_nsec)})
            text += std::to_string(number) + " ";
    }
    return text;
}

void BatchScene::check_unchanged() const
{
    if (stamps() != stamps_)
        throw Error(ErrorCode::io, arguments_.scene +
                                       ", or a file of it, has changed while its frames were rendered; those done show "
                                       "what it was before, and the same command renders them again");
}

}  // namespace rcs::service
