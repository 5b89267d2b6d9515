#include "scene/gltf_schema.h"

#include <map>
#include <span>
#include <string>
#include <vector>

#include "scene/material_fields.h"

namespace rcs {
namespace {

enum class Kind { number, whole, text, flag, numbers, wholes, object, objects };

struct Member {
    const char* key;
    Kind kind;
    std::size_t length = 0;  ///< of an array; 0: any
    bool required = false;
};

// glTF 2.0, section 5, as far as the library reads it.
constexpr Member kNode[] = {{"mesh", Kind::whole},          {"skin", Kind::whole},
                            {"camera", Kind::whole},        {"children", Kind::wholes},
                            {"matrix", Kind::numbers, 16},  {"translation", Kind::numbers, 3},
                            {"rotation", Kind::numbers, 4}, {"scale", Kind::numbers, 3},
                            {"weights", Kind::numbers},     {"name", Kind::text}};
constexpr Member kMesh[] = {{"weights", Kind::numbers}, {"name", Kind::text}};
constexpr Member kPrimitive[] = {
    {"indices", Kind::whole}, {"material", Kind::whole}, {"mode", Kind::whole}, {"targets", Kind::objects}};
constexpr Member kMaterial[] = {
    {"pbrMetallicRoughness", Kind::object}, {"normalTexture", Kind::object},      {"occlusionTexture", Kind::object},
    {"emissiveTexture", Kind::object},      {"emissiveFactor", Kind::numbers, 3}, {"alphaMode", Kind::text},
    {"alphaCutoff", Kind::number},          {"doubleSided", Kind::flag},          {"name", Kind::text}};
constexpr Member kPbr[] = {{"baseColorFactor", Kind::numbers, 4},
                           {"metallicFactor", Kind::number},
                           {"roughnessFactor", Kind::number},
                           {"baseColorTexture", Kind::object},
                           {"metallicRoughnessTexture", Kind::object}};
constexpr Member kTextureInfo[] = {{"index", Kind::whole, 0, true}, {"texCoord", Kind::whole}, {"scale", Kind::number}};
constexpr Member kTextureTransform[] = {
    {"offset", Kind::numbers, 2}, {"rotation", Kind::number}, {"scale", Kind::numbers, 2}, {"texCoord", Kind::whole}};
constexpr Member kTexture[] = {{"source", Kind::whole}, {"sampler", Kind::whole}};
constexpr Member kWebp[] = {{"source", Kind::whole}};
constexpr Member kSampler[] = {
    {"wrapS", Kind::whole}, {"wrapT", Kind::whole}, {"magFilter", Kind::whole}, {"minFilter", Kind::whole}};
constexpr Member kImage[] = {{"uri", Kind::text}, {"bufferView", Kind::whole}, {"mimeType", Kind::text}};
constexpr Member kAccessor[] = {{"bufferView", Kind::whole},     {"byteOffset", Kind::whole},
                                {"normalized", Kind::flag},      {"componentType", Kind::whole, 0, true},
                                {"count", Kind::whole, 0, true}, {"type", Kind::text, 0, true},
                                {"sparse", Kind::object}};
constexpr Member kSparse[] = {
    {"count", Kind::whole, 0, true}, {"indices", Kind::object, 0, true}, {"values", Kind::object, 0, true}};
constexpr Member kSkin[] = {{"joints", Kind::wholes, 0, true}, {"inverseBindMatrices", Kind::whole}};
constexpr Member kAnimation[] = {{"channels", Kind::objects, 0, true}, {"samplers", Kind::objects, 0, true}};
constexpr Member kChannel[] = {{"sampler", Kind::whole, 0, true}, {"target", Kind::object, 0, true}};
constexpr Member kTarget[] = {{"node", Kind::whole}, {"path", Kind::text, 0, true}};
constexpr Member kAnimationSampler[] = {
    {"input", Kind::whole, 0, true}, {"output", Kind::whole, 0, true}, {"interpolation", Kind::text}};
constexpr Member kCamera[] = {
    {"type", Kind::text, 0, true}, {"perspective", Kind::object}, {"orthographic", Kind::object}};
constexpr Member kPerspective[] = {
    {"yfov", Kind::number, 0, true}, {"aspectRatio", Kind::number}, {"znear", Kind::number}, {"zfar", Kind::number}};
constexpr Member kOrthographic[] = {{"xmag", Kind::number}, {"ymag", Kind::number, 0, true}};
constexpr Member kLight[] = {{"type", Kind::text, 0, true},
                             {"color", Kind::numbers, 3},
                             {"intensity", Kind::number},
                             {"range", Kind::number},
                             {"spot", Kind::object}};
constexpr Member kSpot[] = {{"innerConeAngle", Kind::number}, {"outerConeAngle", Kind::number}};
constexpr Member kScene[] = {{"nodes", Kind::wholes}};

using ExtensionMembers = std::map<std::string, std::vector<Member>>;

/// What the library reads of material extensions.
ExtensionMembers make_material_extensions()
{
    ExtensionMembers extensions;
    for_each_material_key([&](const char* extension, const char* key, MaterialKey::Kind kind) {
        std::vector<Member>& members = extensions[extension];
        if (!key) return;
        switch (kind) {
            case MaterialKey::Kind::number:
                members.push_back({key, Kind::number});
                break;
            case MaterialKey::Kind::color:
                members.push_back({key, Kind::numbers, 3});
                break;
            case MaterialKey::Kind::color_and_alpha:
                members.push_back({key, Kind::numbers, 4});
                break;
            case MaterialKey::Kind::texture:
            case MaterialKey::Kind::unread_texture:
                members.push_back({key, Kind::object});
                break;
        }
    });
    return extensions;
}

const ExtensionMembers& material_extensions()
{
    static const ExtensionMembers extensions = make_material_extensions();
    return extensions;
}

bool all_are(const Json& array, bool (*is_kind)(const Json&))
{
    if (!array.is_array()) return false;
    for (const Json& element : array) {
        if (!is_kind(element)) return false;
    }
    return true;
}

bool has_kind(const Json& value, Kind kind)
{
    switch (kind) {
        case Kind::number:
            return value.is_number();
        case Kind::whole:
            return value.is_number_unsigned();
        case Kind::text:
            return value.is_string();
        case Kind::flag:
            return value.is_boolean();
        case Kind::object:
            return value.is_object();
        case Kind::numbers:
            return all_are(value, [](const Json& e) { return e.is_number(); });
        case Kind::wholes:
            return all_are(value, [](const Json& e) { return e.is_number_unsigned(); });
        case Kind::objects:
            return all_are(value, [](const Json& e) { return e.is_object(); });
    }
    return false;
}

const char* name_of(Kind kind)
{
    switch (kind) {
        case Kind::number:
            return "a number";
        case Kind::whole:
            return "a whole number >= 0";
        case Kind::text:
            return "a string";
        case Kind::flag:
            return "true or false";
        case Kind::object:
            return "an object";
        case Kind::numbers:
            return "an array of numbers";
        case Kind::wholes:
            return "an array of whole numbers >= 0";
        case Kind::objects:
            return "an array of objects";
    }
    return "";
}

struct Checker {
    const GltfDocument& document;

    void members(const Json& object, std::span<const Member> members, const std::string& what) const
    {
        if (!object.is_object()) bad_file(document.file, what + " is no object");
        for (const Member& member : members) {
            const auto found = object.find(member.key);
            if (found == object.end()) {
                if (member.required) bad_file(document.file, what + " has no '" + member.key + "'");
            } else if (!has_kind(*found, member.kind)) {
                constexpr std::size_t kShown = 60;
                bad_file(document.file,
                         what + ": '" + member.key + "' is " +
                             found->dump(-1, ' ', true, Json::error_handler_t::replace).substr(0, kShown) +
                             ", expected " + name_of(member.kind));
            } else if (member.length > 0 && found->size() != member.length) {
                bad_file(document.file, what + ": '" + member.key + "' has " + std::to_string(found->size()) +
                                            " numbers, expected " + std::to_string(member.length));
            }
        }
    }

    /// The object that is a member, if it is there.
    void member(const Json& object, const char* key, std::span<const Member> expected, const std::string& what) const
    {
        const auto found = object.find(key);
        if (found != object.end()) members(*found, expected, what + ", " + key);
    }

    void extension(const Json& object, const char* name, std::span<const Member> expected,
                   const std::string& what) const
    {
        if (const Json* found = extension_of(document, object, name, what))
            members(*found, expected, what + ", " + name);
    }

    template <class Check>
    void all(const char* key, const char* kind, std::span<const Member> expected, const Check& check) const
    {
        std::size_t index = 0;
        for (const Json& element : array_of(document, key)) {
            const auto name = element.is_object() ? element.find("name") : element.end();
            const bool named = element.is_object() && name != element.end() && name->is_string();
            const std::string what = element_name(kind, index++, named ? name->get<std::string>() : "");
            members(element, expected, what);
            check(element, what);
        }
    }

    /// Members that are textureInfos are those whose key ends so.
    void texture_infos(const Json& object, const std::string& what) const
    {
        for (const auto& [key, value] : object.items()) {
            if (!key.ends_with("Texture")) continue;
            members(value, kTextureInfo, what + ", " + key);
            extension(value, "KHR_texture_transform", kTextureTransform, what + ", " + key);
        }
    }

    void material(const Json& object, const std::string& what) const
    {
        texture_infos(object, what);
        if (const auto pbr = object.find("pbrMetallicRoughness"); pbr != object.end()) {
            members(*pbr, kPbr, what);
            texture_infos(*pbr, what);
        }
        for (const auto& [name, expected] : material_extensions()) {
            const Json* found = extension_of(document, object, name.c_str(), what);
            if (!found) continue;
            members(*found, expected, what + ", " + name);
            texture_infos(*found, what);
        }
    }

    void animation(const Json& object, const std::string& what) const
    {
        std::size_t index = 0;
        for (const Json& channel : object["channels"]) {
            const std::string name = what + ", channel " + std::to_string(index++);
            members(channel, kChannel, name);
            member(channel, "target", kTarget, name);
        }
        index = 0;
        for (const Json& sampler : object["samplers"]) {
            members(sampler, kAnimationSampler, what + ", sampler " + std::to_string(index++));
        }
    }
};

}  // namespace

void check_types(const GltfDocument& document)
{
    const Checker check{document};
    const auto nothing = [](const Json&, const std::string&) {};
    check.all("scenes", "scene", kScene, nothing);
    check.all("nodes", "node", kNode, nothing);
    check.all("meshes", "mesh", kMesh, [&](const Json& mesh, const std::string& what) {
        std::size_t index = 0;
        const auto primitives = mesh.find("primitives");
        if (primitives == mesh.end() || !primitives->is_array()) {
            bad_file(document.file, what + " has no array of primitives");
        }
        for (const Json& primitive : *primitives) {
            check.members(primitive, kPrimitive, what + ", primitive " + std::to_string(index++));
        }
    });
    check.all("materials", "material", kMaterial,
              [&](const Json& material, const std::string& what) { check.material(material, what); });
    check.all("textures", "texture", kTexture, [&](const Json& texture, const std::string& what) {
        check.extension(texture, "EXT_texture_webp", kWebp, what);
    });
    check.all("samplers", "sampler", kSampler, nothing);
    check.all("images", "image", kImage, nothing);
    check.all("accessors", "accessor", kAccessor,
              [&](const Json& accessor, const std::string& what) { check.member(accessor, "sparse", kSparse, what); });
    check.all("skins", "skin", kSkin, nothing);
    check.all("animations", "animation", kAnimation,
              [&](const Json& animation, const std::string& what) { check.animation(animation, what); });
    check.all("cameras", "camera", kCamera, [&](const Json& camera, const std::string& what) {
        check.member(camera, "perspective", kPerspective, what);
        check.member(camera, "orthographic", kOrthographic, what);
    });
    if (const Json* lights = extension_of(document, document.root, "KHR_lights_punctual", "the file")) {
        std::size_t index = 0;
        const auto list = lights->find("lights");
        if (list == lights->end() || !list->is_array()) bad_file(document.file, "KHR_lights_punctual has no lights");
        for (const Json& light : *list) {
            const std::string what = element_name("light", index++, "");
            check.members(light, kLight, what);
            check.member(light, "spot", kSpot, what);
        }
    }
}

}  // namespace rcs
