#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <limits>
#include <new>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <glm/glm.hpp>

#include "rcs/error.h"
#include "rcs/scene.h"
#include "scene/demo_scenes.h"
#include "scene/gltf_check.h"
#include "scene/gltf_file.h"
#include "scene/gltf_material.h"
#include "scene/gltf_scene.h"
#include "scene/load_within.h"
#include "scene/tinygltf.h"

namespace rcs {
namespace {

/// What tinygltf's callbacks work on.
struct BufferAccess {
    const GltfFile& file;
    const GltfSource& source;
};

/// tinygltf asks for buffers by a path that ends in kBufferUri and their number; see gltf_check.h.
std::size_t buffer_number(const std::string& asked)
{
    const std::size_t at = asked.rfind(kBufferUri);
    return at == asked.npos ? 0 : std::stoul(asked.substr(at + std::string_view(kBufferUri).size()));
}

bool buffer_exists(const std::string&, void*) { return true; }

std::string unchanged_path(const std::string& path, void*) { return path; }

bool read_buffer(std::vector<unsigned char>* bytes, std::string*, const std::string& asked, void* user)
{
    const BufferAccess& access = *static_cast<const BufferAccess*>(user);
    const std::size_t number = buffer_number(asked);
    *bytes = buffer_bytes(access.file, access.source.buffers.at(number), {}, element_name("buffer", number, ""));
    return true;
}

bool refuse_to_write(std::string*, const std::string&, const std::vector<unsigned char>&, void*) { return false; }

/// tinygltf 2.9 asks for sizes by a callback that 2.7 does not have yet. It compares them with a limit only.
template <class Callbacks>
void set_size_callback(Callbacks& access)
{
    if constexpr (requires { access.GetFileSizeInBytes; }) {
        access.GetFileSizeInBytes = [](std::size_t* size, std::string*, const std::string& asked, void* user) {
            const GltfSource& source = static_cast<const BufferAccess*>(user)->source;
            *size = source.buffers.at(buffer_number(asked)).size;
            return true;
        };
    }
}

tinygltf::FsCallbacks file_access(BufferAccess& user)
{
    tinygltf::FsCallbacks access{};
    access.FileExists = buffer_exists;
    access.ExpandFilePath = unchanged_path;
    access.ReadWholeFile = read_buffer;
    access.WriteWholeFile = refuse_to_write;
    access.user_data = &user;
    set_size_callback(access);
    return access;
}

tinygltf::Model read_model(const GltfFile& file, const std::vector<PosedProperty>& properties = {})
{
    std::vector<unsigned char> bytes = read_file(file.path, "scene file");
    if (bytes.size() > std::numeric_limits<std::uint32_t>::max()) {
        fail(file, ErrorCode::unsupported, "is larger than the 4 GiB that a .glb file can have");
    }
    GltfSource source = check_gltf(file, std::move(bytes), properties);
    bytes = std::move(source.bytes);

    BufferAccess access{file, source};
    tinygltf::TinyGLTF reader;
    reader.SetFsCallbacks(file_access(access));
    // Images are left where they are until they are known to be needed.
    reader.SetImageLoader([](auto...) { return true; }, nullptr);
    tinygltf::Model model;
    std::string error;
    std::string warning;
    const auto size = static_cast<unsigned int>(bytes.size());
    const bool read = is_glb(bytes)
                          ? reader.LoadBinaryFromMemory(&model, &error, &warning, bytes.data(), size, ".")
                          : reader.LoadASCIIFromString(&model, &error, &warning,
                                                       reinterpret_cast<const char*>(bytes.data()), size, ".");
    if (!read) bad_file(file, error.empty() ? "cannot be read" : on_one_line(error));
    // What it remarks on a file that it has read is known from check_gltf, or is no fault.
    unpack_views(file, source.packed_views, model);
    for (std::size_t i = 0; i < model.images.size(); ++i) model.images[i].uri = std::move(source.image_uris[i]);
    return model;
}

/// A camera that sees all of the scene, for files that have none.
Camera framing_camera(const Scene& scene)
{
    constexpr double kFov = 0.8;  // about 46 degrees, as a normal lens on film
    const Bounds bounds = bounds_of(scene);
    const bool empty = bounds.min.x > bounds.max.x;
    const glm::dvec3 centre = empty ? glm::dvec3(0.0) : 0.5 * (bounds.min + bounds.max);
    const double radius = empty ? 1.0 : std::max(0.5 * glm::length(bounds.max - bounds.min), 1e-9);
    const glm::dvec3 from = glm::normalize(glm::dvec3(0.5, 0.4, 1.0));  // from the front, right and above
    return look_at_camera("framed", centre + from * (radius / std::sin(0.5 * kFov)), centre, kFov);
}

/// What a file without any light is lit by.
constexpr glm::vec3 kNeutralSky{1.0f};

bool has_light(const Scene& scene)
{
    // Materials that no mesh uses keep their default, which emits nothing.
    const bool emits = std::any_of(scene.materials.begin(), scene.materials.end(),
                                   [](const Material& material) { return material.emission != glm::vec3(0.0f); });
    return emits || !scene.lights.empty();
}

Scene load_gltf(const std::string& path, const LoadOptions& options, const std::string& root, const LogFunction& log)
{
    GltfNotes notes;
    const GltfFile file{path, std::filesystem::path(path).parent_path(), &notes, root, options.like};
    tinygltf::Model model = read_model(file);
    const GltfPose pose = pose_at(file, model, options);
    if (!pose.properties.empty()) {
        GltfNotes said;  // by the first reading
        model = read_model({path, file.folder, &said, root, options.like}, pose.properties);
    }
    Scene scene = build_scene(file, model, pose.nodes);
    const std::string name = std::filesystem::path(path).filename().string();
    notes.write(name, log);
    const auto inform = [&](const std::string& what) {
        if (log) log(LogLevel::info, name + ": " + what);
    };
    if (options.time && model.animations.empty()) inform("has no animation; it looks the same at any time");
    if (!options.time && !options.animation.empty() && log)
        log(LogLevel::warning, name + ": an animation is chosen, but no time: it is shown in its rest pose");
    else if (!options.time && !model.animations.empty())
        inform("has animations; it is shown in its rest pose");
    if (log && bounds_of(scene).min.x > bounds_of(scene).max.x) {
        log(LogLevel::warning,
            name + ": has nothing that can be drawn: no node of its scene shows a mesh with triangles");
    }
    if (scene.cameras.empty()) {
        scene.cameras.push_back(framing_camera(scene));
        inform("has no camera; 'framed' shows all of it");
    }
    if (!has_light(scene)) {
        scene.sky_radiance = kNeutralSky;
        inform("has no light; a neutral sky of radiance 1 lights it unless another environment is asked for");
    }
    return scene;
}

}  // namespace

Scene load_scene(const std::string& source, const LogFunction& log, const LoadOptions& options)
{
    return load_scene_within(source, {}, log, options);
}

Scene load_scene_within(const std::string& source, const std::string& root, const LogFunction& log,
                        const LoadOptions& options)
{
    if (options.time && !std::isfinite(*options.time)) {
        throw Error(ErrorCode::bad_argument, "time is " + std::to_string(*options.time) + ", expected a finite number");
    }
    if (source.rfind("demo:", 0) == 0) {
        if (!options.animation.empty() && options.animation != kAllAnimations)
            throw Error(ErrorCode::not_found, source + " has no animation '" + options.animation +
                                                  "': all that moves in a built-in scene moves together");
        return make_demo_scene(source, options.time);
    }
    try {
        Scene scene = load_gltf(source, options, root, log);
        validate(scene);
        return scene;
    } catch (const Error&) {
        throw;
    } catch (const std::bad_alloc&) {
        throw Error(ErrorCode::out_of_memory, source + ": not enough memory to load it");
    } catch (const std::exception& e) {
        // What tinygltf, Draco and their helpers throw about contents they do not expect.
        throw Error(ErrorCode::bad_file, source + ": " + on_one_line(e.what()));
    }
}

}  // namespace rcs
