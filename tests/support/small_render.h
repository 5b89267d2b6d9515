#pragma once

#include <cstdint>
#include <string>
#include <vector>

/// What quick renders need.
namespace rcs::test {

inline void append_u32(std::string& bytes, std::uint32_t value)
{
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// A .glb of one triangle and one camera that looks at it. @param last_z  z of the third vertex [m]
inline std::string triangle_glb(float last_z)
{
    const float positions[9] = {-1.0f, -1.0f, 0.0f, 1.0f, -1.0f, 0.0f, 0.0f, 1.0f, last_z};
    std::string json = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1]}],)"
                       R"("nodes":[{"mesh":0},{"camera":0,"translation":[0,0,3]}],)"
                       R"("cameras":[{"type":"perspective","name":"front","perspective":{"yfov":0.8,"znear":0.1}}],)"
                       R"("meshes":[{"name":"triangle","primitives":[{"attributes":{"POSITION":0}}]}],)"
                       R"("buffers":[{"byteLength":36}],"bufferViews":[{"buffer":0,"byteLength":36}],)"
                       R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3",)"
                       R"("min":[-1,-1,0],"max":[1,1,0]}]})";
    json.resize((json.size() + 3) / 4 * 4, ' ');
    std::string glb = "glTF";
    append_u32(glb, 2);
    append_u32(glb, static_cast<std::uint32_t>(12 + 8 + json.size() + 8 + sizeof positions));
    append_u32(glb, static_cast<std::uint32_t>(json.size()));
    glb += "JSON" + json;
    append_u32(glb, sizeof positions);
    glb.append("BIN\0", 4);
    glb.append(reinterpret_cast<const char*>(positions), sizeof positions);
    return glb;
}

inline std::vector<std::string> small_render(const std::string& scene, const std::vector<std::string>& more)
{
    std::vector<std::string> arguments{"render", scene, "--size", "24x24", "--aa", "1", "--rays", "16"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
}

}  // namespace rcs::test
