#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <limits>
#include <new>
#include <string>
#include <system_error>
#include <vector>

#include <glm/glm.hpp>

#include "rcs/error.h"
#include "rcs/scene.h"
#include "scene/demo_scenes.h"
#include "scene/gltf_check.h"
#include "scene/gltf_file.h"
#include "scene/gltf_material.h"
#include "scene/gltf_scene.h"
#include "scene/tinygltf.h"

namespace rcs {
namespace {

/// tinygltf asks for buffers by a path below its base directory ".", which stands for the scene's folder.
std::filesystem::path path_of(const std::string& asked, void* user)
{
    const GltfFile& file = *static_cast<const GltfFile*>(user);
    const std::string relative = asked.rfind("./", 0) == 0 ? asked.substr(2) : asked;
    return file.folder / relative;
}

bool buffer_exists(const std::string& asked, void* user)
{
    std::error_code ignored;
    return std::filesystem::exists(path_of(asked, user), ignored);
}

std::string unchanged_path(const std::string& path, void*) { return path; }

bool read_buffer(std::vector<unsigned char>* bytes, std::string* error, const std::string& asked, void* user)
{
    try {
        *bytes = read_file(path_of(asked, user), "buffer");
        return true;
    } catch (const Error& e) {
        *error = e.what();
        return false;
    }
}

bool refuse_to_write(std::string*, const std::string&, const std::vector<unsigned char>&, void*) { return false; }

/// tinygltf 2.9 asks for sizes by a callback that 2.7 does not have yet.
template <class Callbacks>
void set_size_callback(Callbacks& access)
{
    if constexpr (requires { access.GetFileSizeInBytes; }) {
        access.GetFileSizeInBytes = [](std::size_t* size, std::string*, const std::string& asked, void* user) {
            std::error_code problem;
            *size = std::filesystem::file_size(path_of(asked, user), problem);
            return !problem;
        };
    }
}

/// check_gltf has refused all URIs that leave the scene's folder.
tinygltf::FsCallbacks file_access(GltfFile& file)
{
    tinygltf::FsCallbacks access{};
    access.FileExists = buffer_exists;
    access.ExpandFilePath = unchanged_path;
    access.ReadWholeFile = read_buffer;
    access.WriteWholeFile = refuse_to_write;
    access.user_data = &file;
    set_size_callback(access);
    return access;
}

tinygltf::Model read_model(GltfFile& file, const LogFunction& log)
{
    std::vector<unsigned char> bytes = read_file(file.path, "scene file");
    if (bytes.size() > std::numeric_limits<std::uint32_t>::max()) {
        fail(file, ErrorCode::unsupported, "is larger than the 4 GiB that a .glb file can have");
    }
    check_gltf(file, bytes);

    tinygltf::TinyGLTF reader;
    reader.SetFsCallbacks(file_access(file));
    reader.SetImageLoader(keep_encoded_image, nullptr);
    tinygltf::Model model;
    std::string error;
    std::string warning;
    const auto size = static_cast<unsigned int>(bytes.size());
    const bool read =
        is_glb(bytes)
            ? reader.LoadBinaryFromMemory(&model, &error, &warning, bytes.data(), size, ".")
            : reader.LoadASCIIFromString(&model, &error, &warning, reinterpret_cast<const char*>(bytes.data()), size,
                                         ".");
    if (!read) bad_file(file, error.empty() ? "cannot be read" : on_one_line(error));
    const std::string remarks = on_one_line(error + warning);
    if (log && !remarks.empty()) log(LogLevel::warning, file.path + ": " + remarks);
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

Scene load_gltf(const std::string& path, const LogFunction& log)
{
    GltfNotes notes;
    GltfFile file{path, std::filesystem::path(path).parent_path(), &notes};
    Scene scene = build_scene(file, read_model(file, log));
    const std::string short_path = std::filesystem::path(path).filename().string();
    notes.write(short_path, log);
    if (scene.cameras.empty()) {
        scene.cameras.push_back(framing_camera(scene));
        if (log) log(LogLevel::info, short_path + ": has no camera; 'framed' shows all of it");
    }
    return scene;
}

}  // namespace

Scene load_scene(const std::string& source, const LogFunction& log)
{
    if (source.rfind("demo:", 0) == 0) return make_demo_scene(source);
    try {
        Scene scene = load_gltf(source, log);
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
