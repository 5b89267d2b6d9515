#include "cli/job_of_arguments.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <set>

#include "cli/outputs.h"
#include "process/printable.h"
#include "rcs/error.h"
#include "rcs/scene.h"
#include "wire/errors.h"
#include "wire/options.h"
#include "wire/outputs.h"
#include "wire/scene.h"

namespace rcs::service {
namespace {

namespace fs = std::filesystem;

std::string lower(std::string text)
{
    std::transform(text.begin(), text.end(), text.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return text;
}

/// A file's name as outputs may have it, unlike those in `taken`.
std::string output_name(const std::string& path, std::set<std::string>& taken)
{
    std::string stem = fs::path(path).stem().string();
    for (char& c : stem) {
        if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '-' && c != '_') c = '_';
    }
    constexpr std::size_t kLongest = 80;
    stem.resize(std::min(stem.size(), kLongest));
    const std::string ending = lower(fs::path(path).extension().string());
    std::string name = stem + ending;
    for (int i = 2; !taken.insert(name).second; ++i) name = stem + "-" + std::to_string(i) + ending;
    return name;
}

const v1::Blob& add_upload(const std::string& path, RequestedJob& requested)
{
    requested.uploads.push_back(local_file(path));
    return requested.uploads.back().blob;
}

void request_scene(const RenderArguments& arguments, bool on_server, RequestedJob& requested)
{
    const std::string& source = arguments.scene.scene;
    v1::Scene& scene = *requested.job.mutable_scene();
    scene.set_label(utf8_text(source));
    scene.set_animation(utf8_text(arguments.scene.animation));
    if (source.starts_with("demo:")) {
        scene.set_builtin(utf8_text(source));
    } else if (on_server) {
        scene.set_path(source);
    } else {
        const fs::path folder = fs::path(source).parent_path();
        for (const std::string& name : scene_files(source)) {
            v1::SceneFile& file = *scene.mutable_files()->add_files();
            file.set_path(name);
            *file.mutable_content() = add_upload((folder / name).string(), requested);
        }
    }
}

void request_environment(const SceneArguments& arguments, RequestedJob& requested)
{
    const EnvironmentChoice choice = scene_choice(arguments).environment;
    v1::Environment& environment = *requested.job.mutable_environment();
    environment = to_message(choice, utf8_text(arguments.environment));
    if (!choice.image.empty()) {
        *environment.mutable_image() = add_upload(choice.image, requested);
        environment.set_image_ending(lower(fs::path(choice.image).extension().string()));
    }
}

}  // namespace

RequestedJob request_job(const RenderArguments& arguments, const Shutter& shutter, bool on_server)
{
    RequestedJob requested;
    *requested.job.mutable_options() = to_message(final_options(arguments));
    requested.job.set_shutter_seconds(shutter.exposed(0.0).open);
    if (!arguments.scene.camera_path.empty())
        *requested.job.mutable_camera_path() = to_message(*CameraSource(arguments.scene).path());
    std::set<std::string> names;
    for (OutputFile& file : parse_outputs(arguments.output, PixelFormat::half_float)) {
        requested.paths.push_back(file.path);
        const std::string shown = fs::path(file.path).filename().string();
        file.path = output_name(file.path, names);
        v1::Output& output = *requested.job.add_outputs();
        output = to_message(file);
        if (utf8_text(printable(shown)) == shown && !shown.starts_with('.')) output.set_file_name(shown);
    }
    ToneMapOptions tone_map = parse_tone_map(arguments.output);
    *requested.job.mutable_tone_map() = to_message(tone_map);
    const char* ocio = std::getenv("OCIO");
    if (tone_map.ocio_config.empty() && ocio != nullptr) tone_map.ocio_config = ocio;
    if (!tone_map.ocio_config.empty())
        *requested.job.mutable_tone_map()->mutable_ocio_config() = add_upload(tone_map.ocio_config, requested);
    request_environment(arguments.scene, requested);
    request_scene(arguments, on_server, requested);
    return requested;
}

v1::Frame request_frame(const RenderArguments& arguments, int number, std::optional<double> time)
{
    v1::Frame frame;
    frame.set_number(number);
    const bool is_moved = !arguments.scene.camera_path.empty();
    const CameraChoice camera = camera_choice(arguments.scene, time);
    if (!is_moved && !camera.name.empty()) frame.set_camera_name(utf8_text(camera.name));
    if (!is_moved && camera.given) *frame.mutable_camera_given() = to_message(*camera.given);
    if (camera.lens_shift) *frame.mutable_lens_shift() = to_message(*camera.lens_shift);
    if (time) frame.set_time(*time);
    if (const auto motion = motion_choice(arguments, time)) *frame.mutable_motion() = to_message(*motion);
    return frame;
}

}  // namespace rcs::service
