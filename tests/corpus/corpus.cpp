#include "corpus/corpus.h"

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

void Corpus::add(const std::string& name, std::optional<ErrorCode> error, const std::string& word,
                 const Change& change)
{
    Draft draft;
    change(draft);
    draft.complete();
    CorpusFile file{name, {}, draft.link, draft.time, error, word};
    if (draft.buffer_uri.empty()) file.files.emplace_back("scene.glb", draft.b.glb());
    else file.files.emplace_back("scene.gltf", draft.b.gltf(draft.buffer_uri));
    for (auto& [path, bytes] : draft.beside) {
        file.files.emplace_back(path, bytes == "BUFFER" ? draft.b.binary : bytes);
    }
    files.push_back(std::move(file));
}

}  // namespace rcs::test
