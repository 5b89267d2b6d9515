#include "corpus/corpus.h"

#include <filesystem>

namespace rcs::test {

Json Draft::texture(const std::string& picture, Json more)
{
    const int image = b.add("images", {{"bufferView", b.add_view(picture)}, {"mimeType", "image/png"}});
    more["source"] = image;
    return {{"index", b.add("textures", std::move(more))}};
}

void Draft::complete()
{
    if (!material.is_null()) {
        primitive["material"] = 0;
        root()["materials"] = Json::array({material});
    }
    if (!mesh.contains("primitives")) mesh["primitives"] = Json::array({primitive});
    Json lamp = {{"translation", {0.5, 0.5, 2}}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}};
    if (!root().contains("extensions")) light() = {{"type", "point"}, {"intensity", 10}};
    const Json camera = {{"camera", 0}, {"translation", {0, 0, 3}}};
    Json nodes = Json::array({node, camera, lamp});
    for (const Json& more : root().value("nodes", Json::array())) nodes.push_back(more);
    root()["nodes"] = nodes;
    Json meshes = Json::array({mesh});
    for (const Json& more : root().value("meshes", Json::array())) meshes.push_back(more);
    root()["meshes"] = meshes;
}

void Corpus::add(const std::string& name, std::optional<ErrorCode> error, const std::string& word, const Change& change)
{
    Draft draft;
    change(draft);
    draft.complete();
    CorpusFile file{name, {}, draft.link, draft.time, error, word};
    if (draft.buffer_uri.empty())
        file.files.emplace_back("scene.glb", draft.b.glb());
    else
        file.files.emplace_back("scene.gltf", draft.b.gltf(draft.buffer_uri));
    for (auto& [path, bytes] : draft.beside) {
        file.files.emplace_back(path, bytes == "BUFFER" ? draft.b.binary : bytes);
    }
    files.push_back(std::move(file));
}

std::vector<CorpusFile> whole_corpus()
{
    Corpus corpus;
    add_container_files(corpus);
    add_geometry_files(corpus);
    add_packed_files(corpus);
    add_material_files(corpus);
    add_texture_files(corpus);
    add_node_files(corpus);
    add_pose_files(corpus);
    return corpus.files;
}

void write_files(const CorpusFile& file, const std::string& folder)
{
    const std::filesystem::path inside = folder;
    std::filesystem::create_directories(inside);
    for (const auto& [path, bytes] : file.files) {
        std::filesystem::create_directories((inside / path).parent_path());
        write_bytes((inside / path).string(), bytes);
    }
    if (!file.link.empty()) {
        const std::size_t colon = file.link.find(':');
        std::filesystem::create_symlink(file.link.substr(colon + 1), inside / file.link.substr(0, colon));
    }
}

}  // namespace rcs::test
