// Group D: files whose numbers or nodes make no geometry.
#include <cmath>
#include <cstring>
#include <limits>

#include "rcs/error.h"
#include "stability/case_run.h"
#include "stability/export_glb.h"
#include "stability/scenes.h"

namespace rcs::stability {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// A file of one triangle with these positions and normals. @param more  attributes, in JSON
std::string one_triangle(const std::vector<glm::vec3>& positions, const std::vector<glm::vec3>& normals)
{
    std::string binary(12 * (positions.size() + normals.size()), '\0');
    std::memcpy(binary.data(), positions.data(), 12 * positions.size());
    if (!normals.empty()) std::memcpy(binary.data() + 12 * positions.size(), normals.data(), 12 * normals.size());
    return binary;
}

void write_triangle(const std::string& path, const std::vector<glm::vec3>& positions,
                    const std::vector<glm::vec3>& normals = {})
{
    const std::string split = std::to_string(12 * positions.size()), count = std::to_string(positions.size());
    std::string json = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
                       R"("meshes":[{"name":"hull","primitives":[{"attributes":{"POSITION":0)";
    if (!normals.empty()) json += R"(,"NORMAL":1)";
    json += R"(}}]}],"bufferViews":[{"buffer":0,"byteLength":)" + split + "}";
    if (!normals.empty())
        json +=
            R"(,{"buffer":0,"byteOffset":)" + split + R"(,"byteLength":)" + std::to_string(12 * normals.size()) + "}";
    json += R"(],"accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":)" + count + "}";
    if (!normals.empty()) json += R"(,{"bufferView":1,"componentType":5126,"type":"VEC3","count":)" + count + "}";
    const std::string binary = one_triangle(positions, normals);
    json += R"(],"buffers":[{"byteLength":)" + std::to_string(binary.size()) + "}]}";
    write_glb(json, binary, path);
}

/// The file is refused with one line that names it and the part, or it renders. Nothing else.
void refused_or_rendered(CaseRun& run, const std::string& path, const std::string& part, const std::string& words,
                         bool must_render)
{
    try {
        Scene scene = load_scene(path);
        run.render(scene, small_options(24), words);
        run.figure(0.0, "each file renders or is one clear error");
    } catch (const Error& e) {
        const std::string message = e.what();
        run.require(!must_render, words + " is refused: " + message);
        run.require(message.find(part) != std::string::npos && message.find('\n') == std::string::npos,
                    words + ": the message does not name '" + part + "': " + message);
    }
}

void odd_numbers(CaseRun& run)
{
    const std::string path = run.folder() + "/odd.glb";
    const std::vector<glm::vec3> good = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    for (const float value : {kNaN, kInfinity, -kInfinity, 1e38f, 3.4e38f}) {
        std::vector<glm::vec3> bad = good;
        bad[1].x = value;
        write_triangle(path, bad);
        refused_or_rendered(run, path, "hull", "a coordinate of " + text_of(static_cast<double>(value)), false);
        write_triangle(path, good, {{0, 0, 1}, {0, 0, value}, {0, 0, 1}});
        refused_or_rendered(run, path, "hull", "a normal of " + text_of(static_cast<double>(value)), false);
    }
    write_triangle(path, good, {{0, 0, 0}, {0, 0, 0}, {0, 0, 1}});
    refused_or_rendered(run, path, "hull", "zero normals", false);
    write_triangle(path, good);
    refused_or_rendered(run, path, "hull", "missing normals", true);
    Scene scene = furnished_room();
    scene.meshes[1].positions[3].y = kNaN;
    try {
        validate(scene);
        run.require(false, "validate() takes a NaN");
    } catch (const Error& e) {
        run.require(std::string(e.what()).find("mesh 1") != std::string::npos,
                    std::string("validate() does not name the mesh: ") + e.what());
    }
}

void odd_nodes(CaseRun& run)
{
    const std::string path = run.folder() + "/nodes.glb";
    const std::string head = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],)"
                             R"("meshes":[{"name":"hull","primitives":[{"attributes":{"POSITION":0}}]}],)"
                             R"("bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36}],)"
                             R"("accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":3}],"nodes":[)";
    const std::string binary = one_triangle({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {});
    write_glb(head + R"({"mesh":0,"scale":[1,0,1]}]})", binary, path);
    refused_or_rendered(run, path, "node", "a scale of 0 on an axis", false);
    write_glb(head + R"({"children":[1]},{"children":[2]},{"mesh":0,"children":[1]}]})", binary, path);
    refused_or_rendered(run, path, "node", "a cycle of nodes", false);
    std::string deep = head;
    for (int i = 1; i < 10'000; ++i)
        deep += R"({"children":[)" + std::to_string(i) + R"(],"translation":[0,0,0.0001]},)";
    write_glb(deep + R"({"mesh":0}]})", binary, path);
    refused_or_rendered(run, path, "node", "a hierarchy 10,000 deep", true);
    write_glb(head + R"({"mesh":0,"scale":[1e300,1e300,1e300]}]})", binary, path);
    refused_or_rendered(run, path, "node", "a scale of 1e300", false);
}

}  // namespace

std::vector<SuiteCase> geometry_file_cases()
{
    const std::string group = "geometry";
    return {
        {{"D5", group, "NaN, Inf and 1e38 as coordinates and normals, zero and missing normals", "crash, black holes",
          "one error that names the mesh, or a picture", 0.0, "nothing is measured", true},
         odd_numbers},
        {{"D7", group, "Singular node matrix, hierarchy 10,000 deep, cycle, scale 1e300",
          "stack overflow, endless loop", "one error that names the node, or a picture", 0.0, "nothing is measured",
          true},
         odd_nodes},
    };
}

}  // namespace rcs::stability
