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

/// Times of the last keyframes of an animation's samplers, as their accessors tell them [s].
std::vector<double> ends_of(const nlohmann::json& animation, const nlohmann::json& document)
{
    std::vector<double> ends;
    const auto member = [](const nlohmann::json& of, const char* name) -> nlohmann::json {
        return of.is_object() && of.contains(name) ? of[name] : nlohmann::json();
    };
    const nlohmann::json accessors = member(document, "accessors");
    for (const auto& sampler : member(animation, "samplers")) {
        const nlohmann::json input = member(sampler, "input");
        if (!input.is_number_unsigned() || input.get<std::size_t>() >= accessors.size()) continue;
        const nlohmann::json most = member(accessors[input.get<std::size_t>()], "max");
        if (most.is_array() && most.size() == 1 && most[0].is_number()) ends.push_back(most[0]);
    }
    return ends;
}

}  // namespace

bool is_animated(const std::string& source) { return !list_animations(source).empty(); }

std::vector<AnimationInfo> list_animations(const std::string& source)
{
    std::vector<AnimationInfo> list;
    if (source.starts_with("demo:")) {
        if (is_animated_demo(source)) list.push_back({"", kDemoSeconds});
        return list;
    }
    const auto document = document_of({source, {}, nullptr});
    const auto animations = document.find("animations");
    if (animations == document.end() || !animations->is_array()) return list;
    for (const auto& animation : *animations) {
        AnimationInfo& info = list.emplace_back();
        if (!animation.is_object()) continue;
        if (const auto name = animation.find("name"); name != animation.end() && name->is_string()) info.name = *name;
        for (const double end : ends_of(animation, document)) info.seconds = std::max(info.seconds, end);
    }
    return list;
}

std::vector<std::string> scene_files(const std::string& path) { return scene_files(SceneChoice{path, {}, {}, {}, {}}); }

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
