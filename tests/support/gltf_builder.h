#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <glm/glm.hpp>
#include <nlohmann/json.hpp>

#include "rcs/error.h"
#include "rcs/scene.h"
#include "support/temporary_folder.h"

/// Small glTF files, built in memory. Component types and modes are glTF's own numbers.
namespace rcs::test {

using Json = nlohmann::json;

constexpr int kByte = 5120, kUnsignedByte = 5121, kShort = 5122, kUnsignedShort = 5123, kUnsignedInt = 5125,
              kFloat = 5126;
constexpr int kPoints = 0, kTriangles = 4, kTriangleStrip = 5, kTriangleFan = 6;

/// The values as they lie in memory; glTF and every machine this runs on are little-endian.
template <class T>
std::string raw(const std::vector<T>& values)
{
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

class GltfBuilder {
public:
    Json root = {{"asset", {{"version", "2.0"}}}};
    std::string binary;
    Json more_buffers = Json::array();  ///< beside the one that holds `binary`

    int add(const char* array, Json element)
    {
        root[array].push_back(std::move(element));
        return static_cast<int>(root[array].size()) - 1;
    }

    /// Each view starts at a multiple of 4.
    int add_view(const std::string& bytes, std::size_t stride = 0)
    {
        binary.resize((binary.size() + 3) / 4 * 4);
        Json view = {{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", bytes.size()}};
        if (stride > 0) view["byteStride"] = stride;
        binary += bytes;
        return add("bufferViews", view);
    }

    int add_accessor(int view, int component_type, const char* type, std::size_t count, std::size_t offset = 0)
    {
        return add("accessors", {{"bufferView", view},
                                 {"componentType", component_type},
                                 {"type", type},
                                 {"count", count},
                                 {"byteOffset", offset}});
    }

    int add_vec3(const std::vector<glm::vec3>& values)
    {
        return add_accessor(add_view(raw(values)), kFloat, "VEC3", values.size());
    }
    int add_vec2(const std::vector<glm::vec2>& values)
    {
        return add_accessor(add_view(raw(values)), kFloat, "VEC2", values.size());
    }
    template <class T>
    int add_indices(const std::vector<T>& values)
    {
        const int type = sizeof(T) == 1 ? kUnsignedByte : sizeof(T) == 2 ? kUnsignedShort : kUnsignedInt;
        return add_accessor(add_view(raw(values)), type, "SCALAR", values.size());
    }

    int add_mesh(const std::string& name, Json primitive)
    {
        return add("meshes", {{"name", name}, {"primitives", Json::array({std::move(primitive)})}});
    }
    int add_node(Json node) { return add("nodes", std::move(node)); }

    /// A triangle with corners (0,0,0), (1,0,0), (0,1,0) in a mesh of its own.
    int add_triangle_mesh(const std::string& name = "triangle")
    {
        return add_mesh(name, {{"attributes", {{"POSITION", add_vec3({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}})}}}});
    }

    std::string glb() const
    {
        Json document = root;
        std::string chunk = binary;
        chunk.resize((chunk.size() + 3) / 4 * 4);
        if (!chunk.empty()) document["buffers"] = buffers({{"byteLength", chunk.size()}});
        std::string text = document.dump();
        text.resize((text.size() + 3) / 4 * 4, ' ');
        const auto u32 = [](std::size_t value) {
            const auto number = static_cast<std::uint32_t>(value);
            return std::string(reinterpret_cast<const char*>(&number), 4);
        };
        std::string body = u32(text.size()) + "JSON" + text;
        if (!chunk.empty()) body += u32(chunk.size()) + std::string("BIN\0", 4) + chunk;
        return "glTF" + u32(2) + u32(12 + body.size()) + body;
    }

    /// The document alone; its buffer is the file `uri`.
    std::string gltf(const std::string& uri) const
    {
        Json document = root;
        document["buffers"] = buffers({{"byteLength", binary.size()}, {"uri", uri}});
        return document.dump();
    }

private:
    Json buffers(Json first) const
    {
        Json all = Json::array({std::move(first)});
        for (const Json& more : more_buffers) all.push_back(more);
        return all;
    }
};

/// What the library said while loading.
struct Log {
    std::vector<std::string> lines;
    LogFunction function()
    {
        return [this](LogLevel, std::string_view line) { lines.emplace_back(line); };
    }
    int count(const std::string& part) const
    {
        int found = 0;
        for (const std::string& line : lines) found += line.find(part) != std::string::npos;
        return found;
    }
};

inline Scene load(const std::string& bytes, Log* log = nullptr)
{
    const TemporaryFolder folder;
    write_bytes(folder / "test.glb", bytes);
    return load_scene(folder / "test.glb", log ? log->function() : LogFunction{});
}
inline Scene load(const GltfBuilder& builder, Log* log = nullptr) { return load(builder.glb(), log); }

/// Expects an rcs::Error with this code whose message has all the parts.
inline void expect_error(ErrorCode code, const std::vector<std::string>& parts, const std::function<void()>& action)
{
    try {
        action();
        ADD_FAILURE() << "no error; expected one about " << (parts.empty() ? "" : parts.front());
    } catch (const Error& e) {
        const std::string message = e.what();
        EXPECT_EQ(static_cast<int>(e.code()), static_cast<int>(code)) << message;
        for (const std::string& part : parts) {
            EXPECT_NE(message.find(part), std::string::npos) << "'" << part << "' is missing in: " << message;
        }
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    }
}

}  // namespace rcs::test
