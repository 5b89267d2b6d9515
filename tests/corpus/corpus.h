#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "rcs/error.h"
#include "support/gltf_builder.h"
#include "support/pictures.h"

/// Small scene files, each with one feature or one fault, and what the loader owes to each.
namespace rcs::test {

/// A file of the corpus that is being made: a quad of 2 x 2 m in front of a camera, lit by a point light.
struct Draft {
    GltfBuilder b;
    int positions = b.add_vec3({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}});  ///< accessor 0, view 0
    int uvs = b.add_vec2({{0, 1}, {1, 1}, {1, 0}, {0, 0}});                        ///< accessor 1, view 1
    int indices = b.add_indices<std::uint16_t>({0, 1, 2, 0, 2, 3});                ///< accessor 2, view 2
    Json primitive = {{"attributes", {{"POSITION", 0}, {"TEXCOORD_0", 1}}}, {"indices", 2}};
    Json material = {{"name", "paint"}, {"pbrMetallicRoughness", {{"metallicFactor", 0}}}};
    Json node = {{"name", "quad"}, {"mesh", 0}};  ///< node 0; 1 is the camera's, 2 the light's
    Json mesh = {{"name", "quad"}};
    std::vector<std::pair<std::string, std::string>> beside;  ///< other files: path, contents
    std::optional<double> time;
    std::string link;        ///< "name:target" of a symbolic link to make
    std::string buffer_uri;  ///< not empty: a .gltf whose only buffer is there

    Draft()
    {
        root()["cameras"] = Json::array({{{"type", "perspective"}, {"perspective", {{"yfov", 0.9}, {"znear", 0.1}}}}});
    }
    Json& root() { return b.root; }
    Json& attributes() { return primitive["attributes"]; }
    Json& pbr() { return material["pbrMetallicRoughness"]; }
    Json& accessor(int index) { return root()["accessors"][static_cast<std::size_t>(index)]; }
    Json& view(int index) { return root()["bufferViews"][static_cast<std::size_t>(index)]; }
    Json& light() { return root()["extensions"]["KHR_lights_punctual"]["lights"][0]; }
    Json& extension(const char* name) { return material["extensions"][name]; }
    /// A texture of its own with that picture. @return {"index": n}
    Json texture(const std::string& picture = kPicture, Json more = Json::object());
    /// The document with everything in its place; complete() is called once, by Corpus.
    void complete();
};

struct CorpusFile {
    std::string name;
    std::vector<std::pair<std::string, std::string>> files;  ///< path and contents; the scene is the first
    std::string link;
    std::optional<double> time;
    std::optional<ErrorCode> error;  ///< none: it renders
    std::string word;                ///< in the error, or in a line of the log; "" asks for none
};

class Corpus {
public:
    std::vector<CorpusFile> files;

    using Change = std::function<void(Draft&)>;
    void renders(const std::string& name, const Change& change) { add(name, {}, "", change); }
    void notes(const std::string& name, const std::string& word, const Change& change) { add(name, {}, word, change); }
    void fails(const std::string& name, const std::string& word, const Change& change,
               ErrorCode code = ErrorCode::bad_file)
    {
        add(name, code, word, change);
    }
    /// Bytes that are no draft.
    void fails_as_is(const std::string& name, const std::string& word, const std::string& bytes,
                     ErrorCode code = ErrorCode::bad_file)
    {
        files.push_back({name, {{"scene.glb", bytes}}, "", {}, code, word});
    }

private:
    void add(const std::string& name, std::optional<ErrorCode> error, const std::string& word, const Change& change);
};

void add_container_files(Corpus& corpus);
void add_geometry_files(Corpus& corpus);
void add_packed_files(Corpus& corpus);
void add_material_files(Corpus& corpus);
void add_texture_files(Corpus& corpus);
void add_node_files(Corpus& corpus);
void add_pose_files(Corpus& corpus);

std::vector<CorpusFile> whole_corpus();
/// The scene and what lies beside it, into a folder that is made.
void write_files(const CorpusFile& file, const std::string& folder);

}  // namespace rcs::test
