// Bytes as a Draco mesh in an otherwise sound file: the decoder and what takes its arrays over.
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>

#include "fuzz_file.h"
#include "rcs/error.h"
#include "rcs/scene.h"

namespace {

void append(std::string& bytes, std::size_t value)
{
    const auto number = static_cast<std::uint32_t>(value);
    char raw[4];
    std::memcpy(raw, &number, 4);
    bytes.append(raw, 4);
}

/// As large as fits the first bytes of the input: vertices and indices that the accessors promise.
std::string file_with_mesh(const std::uint8_t* data, std::size_t size)
{
    const std::size_t vertices = data[0] + 1u, indices = 3u * (data[1] + 1u);
    std::string json =
        R"({"asset":{"version":"2.0"},"extensionsUsed":["KHR_draco_mesh_compression"],)"
        R"("extensionsRequired":["KHR_draco_mesh_compression"],)"
        R"("scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
        R"("meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":1},"indices":2,"extensions":)"
        R"({"KHR_draco_mesh_compression":{"bufferView":0,"attributes":{"POSITION":0,"NORMAL":1}}}}]}],"accessors":[)"
        R"({"componentType":5126,"type":"VEC3","count":)" +
        std::to_string(vertices) + R"(},{"componentType":5126,"type":"VEC3","count":)" + std::to_string(vertices) +
        R"(},{"componentType":5125,"type":"SCALAR","count":)" + std::to_string(indices) +
        R"(}],"bufferViews":[{"buffer":0,"byteLength":)" + std::to_string(size - 2) +
        R"(}],"buffers":[{"byteLength":)" + std::to_string(size - 2) + "}]}";
    json.resize((json.size() + 3) / 4 * 4, ' ');
    std::string chunk(reinterpret_cast<const char*>(data) + 2, size - 2);
    chunk.resize((chunk.size() + 3) / 4 * 4);
    std::string file = "glTF";
    append(file, 2);
    append(file, 12 + 8 + json.size() + 8 + chunk.size());
    append(file, json.size());
    file += "JSON" + json;
    append(file, chunk.size());
    file.append("BIN\0", 4);
    return file + chunk;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    if (size < 3) return -1;
    const std::string file = file_with_mesh(data, size);
    try {
        rcs::validate(rcs::load_scene(
            rcs::fuzz::write_input(reinterpret_cast<const std::uint8_t*>(file.data()), file.size(), "glb")));
    } catch (const rcs::Error& e) {
        if (e.code() == rcs::ErrorCode::internal) std::abort();
    }
    return 0;
}
