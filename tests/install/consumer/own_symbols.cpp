// A program with a tinygltf and JSON of its own, as others that read glTF have: librcs calls neither, and both work.
#include <cstdio>
#include <exception>
#include <fstream>
#include <string>

#include <rcs/rcs.h>
#include <nlohmann/json.hpp>

// Members of another tinygltf, under the very names that the real one has to the linker.
namespace tinygltf {

class Model;

class TinyGLTF {
public:
    bool LoadASCIIFromString(Model*, std::string*, std::string*, const char*, unsigned int, const std::string&,
                             unsigned int);
    bool LoadBinaryFromMemory(Model*, std::string*, std::string*, const unsigned char*, unsigned int,
                              const std::string&, unsigned int);
};

int calls = 0;

bool TinyGLTF::LoadASCIIFromString(Model*, std::string*, std::string*, const char*, unsigned int, const std::string&,
                                   unsigned int)
{
    ++calls;
    return false;
}

bool TinyGLTF::LoadBinaryFromMemory(Model*, std::string*, std::string*, const unsigned char*, unsigned int,
                                    const std::string&, unsigned int)
{
    ++calls;
    return false;
}

}  // namespace tinygltf

namespace {

/// One triangle.
nlohmann::json document()
{
    return nlohmann::json::parse(R"({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                       "min": [0, 0, 0], "max": [1, 1, 0]}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri":
            "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})");
}

}  // namespace

int main(int, char** arguments)
try {
    const std::string file = std::string(arguments[0]) + ".gltf";
    std::ofstream(file) << document().dump();
    const rcs::Scene scene = rcs::load_scene(file);
    const int by_library = tinygltf::calls;
    tinygltf::TinyGLTF().LoadASCIIFromString(nullptr, nullptr, nullptr, "", 0, "", 0);
    std::printf("%zu meshes, %d calls by librcs, %d in all\n", scene.meshes.size(), by_library, tinygltf::calls);
    return scene.meshes.size() == 1 && by_library == 0 && tinygltf::calls == 1 ? 0 : 1;
} catch (const std::exception& e) {
    std::fprintf(stderr, "own_symbols: %s\n", e.what());
    return 1;
}
