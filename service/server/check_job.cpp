#include "server/check_job.h"

#include <algorithm>
#include <cmath>

#include "process/printable.h"
#include "rcs/layers.h"
#include "rcs/scene.h"
#include "server/deliverer.h"
#include "server/sockets.h"
#include "wire/errors.h"
#include "wire/framing.h"
#include "wire/limits.h"
#include "wire/options.h"
#include "wire/outputs.h"
#include "wire/scene.h"

namespace rcs::service {
namespace {

constexpr int kMostFrames = 10'000, kMostKeys = 10'000, kMostFiles = 10'000, kMostOutputs = 16, kMostLabels = 32,
              kMostPriority = 100, kMostAfter = 16;
constexpr std::size_t kLongestLabel = 200, kLongestName = 100, kLongestText = 1000;  // [bytes]

[[noreturn]] void refuse(const std::string& what) { throw ServiceError(v1::ERROR_CODE_BAD_ARGUMENT, what); }

void check_length(const char* field, const std::string& text, std::size_t most)
{
    if (text.size() > most) {
        refuse(std::string(field) + " has " + std::to_string(text.size()) + " bytes, expected at most " +
               std::to_string(most));
    }
}

void check_count(const char* field, int count, int least, int most)
{
    if (count < least || count > most) {
        refuse(std::string(field) + " has " + std::to_string(count) + " entries, expected [" + std::to_string(least) +
               ", " + std::to_string(most) + "]");
    }
}

void need(const v1::Blob& blob, CheckedJob& checked)
{
    check_digest(blob);
    checked.blobs.insert(blob.sha256());
}

void check_scene(const ServerConfig& config, CheckedJob& checked)
{
    v1::Scene& scene = *checked.job.mutable_scene();
    check_length("scene.label", scene.label(), kLongestText);
    check_length("scene.animation", scene.animation(), kLongestText);
    switch (scene.source_case()) {
        case v1::Scene::kBuiltin: {
            const auto names = demo_scene_names();
            if (std::find(names.begin(), names.end(), scene.builtin()) == names.end()) {
                throw ServiceError(v1::ERROR_CODE_NOT_FOUND,
                                   "there is no built-in scene " + scene.builtin().substr(0, kLongestName));
            }
            checked.scene_key = scene.builtin();
            if (scene.label().empty()) scene.set_label(scene.builtin());
            break;
        }
        case v1::Scene::kPath:
            checked.scene_key = "path:" + confined_file(scene.path(), config.roots);
            if (scene.label().empty()) scene.set_label(scene.path());
            break;
        case v1::Scene::kFiles: {
            check_count("scene.files", scene.files().files_size(), 1, kMostFiles);
            std::set<std::string> paths;
            for (const v1::SceneFile& file : scene.files().files()) {
                check_scene_path(file.path());
                need(file.content(), checked);
                if (!paths.insert(file.path()).second) refuse("scene.files has '" + file.path() + "' twice");
            }
            // A file cannot be a folder as well: "a" sorts before "a/b", with nothing but such in between.
            for (const std::string& path : paths) {
                for (std::size_t slash = path.find('/'); slash != path.npos; slash = path.find('/', slash + 1)) {
                    if (paths.contains(path.substr(0, slash))) refuse("scene.files has '" + path + "' within a file");
                }
            }
            checked.scene_key = BlobStore::scene_key(scene.files());
            if (scene.label().empty()) scene.set_label(scene.files().files(0).path());
            break;
        }
        case v1::Scene::SOURCE_NOT_SET:
            refuse("scene has no source");
    }
}

void check_environment(CheckedJob& checked)
{
    v1::Environment& environment = *checked.job.mutable_environment();
    check_length("environment.label", environment.label(), kLongestText);
    if (environment.label().empty()) environment.set_label("scene");
    check_number("environment.rotation_degrees", environment.rotation_degrees(), kRotations);
    if (environment.has_constant()) {
        for (const float value :
             {environment.constant().red(), environment.constant().green(), environment.constant().blue()}) {
            if (!(value >= 0.0f && std::isfinite(value)))
                refuse("environment.constant has a value that is not finite or below 0");
        }
    }
    const std::string& ending = environment.image_ending();
    if (ending.size() > 8 || ending.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789.") != ending.npos) {
        refuse("environment.image_ending is no [a-z0-9.] of at most 8 characters");
    }
    if (environment.has_image()) need(environment.image(), checked);
}

void check_outputs(const v1::Job& job)
{
    check_count("outputs", job.outputs_size(), 1, kMostOutputs);
    std::set<std::string> names;
    for (const v1::Output& output : job.outputs()) {
        const std::string& name = output.name();
        const std::string plain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-";
        if (name.empty() || name.size() > kLongestName || name.front() == '.' ||
            name.find_first_not_of(plain) != name.npos) {
            refuse("outputs.name '" + name.substr(0, kLongestName) +
                   "' is no [A-Za-z0-9._-] of 1 to 100 characters that does not begin with a dot");
        }
        const auto has = [&](const char* ending) { return name.ends_with(ending); };
        const bool exr = has(".exr"), png = has(".png"), jpeg = has(".jpg") || has(".jpeg");
        if (!exr && !png && !jpeg) refuse("outputs.name '" + name + "' does not end in .exr, .png, .jpg or .jpeg");
        const std::string& shown = output.file_name();
        check_length("outputs.file_name", shown, 255);
        if (shown.find('/') != shown.npos || shown.starts_with('.') || printable(shown) != shown)
            refuse("outputs.file_name of '" + name + "' begins with a dot or has a '/' or control character");
        if (!names.insert(name).second) refuse("outputs has '" + name + "' twice");
        const OutputFile file = from_message(output);
        const PixelFormat format = file.options.format;
        const bool fits = format == PixelFormat::automatic ||
                          (exr ? format == PixelFormat::half_float || format == PixelFormat::full_float
                               : format == PixelFormat::uint8 || (png && format == PixelFormat::uint16));
        if (!fits) refuse("outputs.pixel_format of '" + name + "' is none that such a file has");
        check_number("outputs.jpeg_quality", file.options.jpeg_quality, kJpegQualities);
        for (const std::string& layer : output.layers()) {
            const LayerKind* const known = look_up_layer(layer);
            if (!exr || !known || !known->of_render)
                refuse("outputs.layers of '" + name + "' has " + layer.substr(0, kLongestName) + ", which it cannot");
        }
    }
}

void check_frames(const v1::Job& job)
{
    check_count("frames", job.frames_size(), 0, kMostFrames);
    std::set<int> numbers;
    for (const v1::Frame& frame : job.frames()) {
        if (!numbers.insert(frame.number()).second)
            refuse("frames has number " + std::to_string(frame.number()) + " twice");
        check_length("frames.camera_name", frame.camera_name(), kLongestText);
        if (frame.has_camera_given()) from_message(frame.camera_given());
        from_message(frame.lens_shift());
        if (frame.has_time() && !std::isfinite(frame.time())) refuse("frames.time is not finite");
        check_length("frames.motion.camera_name", frame.motion().camera_name(), kLongestText);
        motion_choice(frame);
    }
    const bool told = job.frames_size() > 0 && std::all_of(job.frames().begin(), job.frames().end(),
                                                           [](const v1::Frame& frame) { return frame.has_motion(); });
    for (const v1::Output& output : job.outputs()) {
        const bool kept = std::find(output.layers().begin(), output.layers().end(), "motion") != output.layers().end();
        if (kept && !told) refuse("outputs.layers has motion, but not every frame says from what");
    }
}

/// Those of the window that is rendered count: nothing is kept of what lies around it.
void check_pixels(const RenderOptions& options, const ServerConfig& config)
{
    const int width = options.crop ? options.crop->width : options.width;
    const int height = options.crop ? options.crop->height : options.height;
    if (1e-6 * width * height <= config.max_pixels_millions) return;
    const std::string name = options.crop ? "a crop of " : "a frame of ";
    throw ServiceError(v1::ERROR_CODE_LIMIT, name + std::to_string(width) + "x" + std::to_string(height) +
                                                 " has more than the " + std::to_string(config.max_pixels_millions) +
                                                 " million pixels that this server renders");
}

/// What a job says of cameras that move and of the shutter.
void check_exposed(const v1::Job& job, const RenderOptions& options)
{
    check_count("camera_path.keys", job.camera_path().keys_size(), 0, kMostKeys);
    for (const v1::CameraKey& key : job.camera_path().keys())
        check_length("camera_path.keys.camera", key.camera(), kLongestText);
    if (job.camera_path().keys_size() > 0) from_message(job.camera_path());
    check_number("shutter_seconds", job.shutter_seconds(), kShutters);
    if (job.shutter_seconds() == 0.0) return;
    if (options.aa < 2) refuse("options.aa is 1, expected at least 2 with shutter_seconds: each shows a moment");
    if (job.frames_size() == 0 ||
        !std::all_of(job.frames().begin(), job.frames().end(), [](const v1::Frame& f) { return f.has_time(); }))
        refuse("shutter_seconds needs a time of every frame");
    for (const v1::Output& output : job.outputs())
        if (std::find(output.layers().begin(), output.layers().end(), "motion") != output.layers().end())
            refuse("outputs.layers has motion, which is of one moment, but shutter_seconds is not 0");
}

/// What is accepted can be told to a worker: all of the job but its other frames and its list of files.
void check_task(const v1::Job& job)
{
    v1::Job told = job;
    told.clear_frames();
    told.mutable_scene()->clear_files();
    std::size_t largest = 0;
    for (const v1::Frame& frame : job.frames()) largest = std::max(largest, frame.ByteSizeLong());
    constexpr std::size_t kPaths = 32 << 10;  // the server adds [bytes]
    const std::size_t size = told.ByteSizeLong() + largest + kPaths;
    if (size > kMaxMessage) {
        throw ServiceError(v1::ERROR_CODE_LIMIT, "a frame's description has " + std::to_string(size) +
                                                     " bytes with all that the job says, more than the " +
                                                     std::to_string(kMaxMessage) + " that a worker is told");
    }
}

void check_rest(const v1::Job& job, const ServerConfig& config)
{
    check_task(job);
    check_priority(job.priority());
    check_length("deliver", job.deliver(), kLongestText);
    if (!job.deliver().empty()) {
        if (config.deliver_root.empty())
            throw ServiceError(v1::ERROR_CODE_FORBIDDEN, "this server delivers nothing (--deliver-root)");
        folder_beneath(config.deliver_root, job.deliver());
    }
    check_count("after", job.after_size(), 0, kMostAfter);
    if (std::set<std::uint64_t>(job.after().begin(), job.after().end()).size() !=
        static_cast<std::size_t>(job.after_size()))
        refuse("after has a job twice");
    check_length("idempotency_key", job.idempotency_key(), kLongestLabel);
    check_count("labels", static_cast<int>(job.labels().size()), 0, kMostLabels);
    for (const auto& [name, value] : job.labels()) {
        check_length("labels", name, kLongestLabel);
        check_length("labels", value, kLongestLabel);
    }
    if (!(job.time_limit_seconds() >= 0.0 && job.time_limit_seconds() <= config.time_limit)) {
        refuse("time_limit_seconds is " + std::to_string(job.time_limit_seconds()) + ", expected a value in [0, " +
               std::to_string(config.time_limit) + "]");
    }
}

}  // namespace

void check_priority(int priority)
{
    if (std::abs(static_cast<double>(priority)) > kMostPriority)
        refuse("priority is " + std::to_string(priority) + ", expected a value in [-100, 100]");
}

v1::SceneFiles single_file(const std::string& name, const v1::Blob& blob)
{
    v1::SceneFiles files;
    v1::SceneFile& file = *files.add_files();
    file.set_path(name);
    *file.mutable_content() = blob;
    return files;
}

CheckedJob check_job(const v1::Job& job, const ServerConfig& config, const BlobStore& blobs)
{
    CheckedJob checked{job, {}, {}};
    check_scene(config, checked);
    check_environment(checked);
    const RenderOptions options = from_message(job.options());
    check_pixels(options, config);
    check_exposed(job, options);
    from_message(job.tone_map());
    check_length("tone_map.display", job.tone_map().display(), kLongestText);
    check_length("tone_map.view", job.tone_map().view(), kLongestText);
    if (job.tone_map().has_ocio_config()) need(job.tone_map().ocio_config(), checked);
    check_outputs(job);
    check_frames(job);
    check_rest(job, config);
    const auto missing =
        std::count_if(checked.blobs.begin(), checked.blobs.end(), [&](const std::string& d) { return !blobs.has(d); });
    if (missing > 0) {
        throw ServiceError(v1::ERROR_CODE_MISSING_BLOBS,
                           std::to_string(missing) + " of the job's files are not here; upload them first");
    }
    return checked;
}

}  // namespace rcs::service
