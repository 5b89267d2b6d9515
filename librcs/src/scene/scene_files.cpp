#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string_view>

#include <nlohmann/json.hpp>

#include "rcs/scene_choice.h"
#include "scene/demo_scenes.h"
#include "scene/gltf_file.h"
#include "scene/gltf_uri.h"

namespace rcs {
namespace {

/// The JSON of a .gltf file, or that of a .glb file's first chunk (glTF 2.0, section 4.4).
std::string_view json_of(const GltfFile& file, const std::vector<unsigned char>& bytes)
{
    const std::string_view all(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (!all.starts_with("glTF")) return all;
    constexpr std::size_t kHeader = 12, kChunkHeader = 8;
    std::uint32_t length = 0;
    if (all.size() >= kHeader + kChunkHeader) std::memcpy(&length, all.data() + kHeader, sizeof length);
    if (all.size() < kHeader + kChunkHeader || length > all.size() - kHeader - kChunkHeader) {
        bad_file(file, "the first chunk goes beyond the end of the file");
    }
    return all.substr(kHeader + kChunkHeader, length);
}

nlohmann::json document_of(const GltfFile& file)
{
    const std::vector<unsigned char> bytes = read_file(file.path, "scene file");
    auto document = nlohmann::json::parse(json_of(file, bytes), nullptr, false);
    if (!document.is_object()) bad_file(file, "no JSON object");
    return document;
}

}  // namespace

bool is_animated(const std::string& source)
{
    if (source.starts_with("demo:")) return is_animated_demo(source);
    const GltfFile file{source, {}, nullptr};
    const auto document = document_of(file);
    const auto animations = document.find("animations");
    return animations != document.end() && !animations->empty();
}

std::vector<std::string> scene_files(const std::string& path) { return scene_files(SceneChoice{path, {}, {}, {}}); }

std::vector<std::string> scene_files(const SceneChoice& choice)
{
    const std::string& path = choice.source;
    const std::filesystem::path folder = std::filesystem::path(path).parent_path();
    const GltfFile file{path, folder, nullptr, choice.asset_root};
    const auto document = document_of(file);
    std::vector<std::string> files = {std::filesystem::path(path).filename().string()};
    for (const char* kind : {"buffers", "images"}) {
        const auto list = document.find(kind);
        if (list == document.end() || !list->is_array()) continue;
        for (std::size_t i = 0; i < list->size(); ++i) {
            const auto uri = (*list)[i].is_object() ? (*list)[i].find("uri") : (*list)[i].end();
            if (!(*list)[i].is_object() || uri == (*list)[i].end() || !uri->is_string()) continue;
            const auto text = uri->get<std::string>();
            if (text.starts_with("data:")) continue;
            const std::string name = external_path(file, text, element_name(kind, i, ""))
                                         .lexically_relative(folder.empty() ? "." : folder)
                                         .string();
            if (std::find(files.begin(), files.end(), name) == files.end()) files.push_back(name);
        }
    }
    return files;
}

}  // namespace rcs
