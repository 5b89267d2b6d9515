#include "scene/gltf_texture.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "rcs/fingerprint.h"
#include "scene/gltf_accessor.h"
#include "scene/gltf_uri.h"

namespace rcs {
namespace {

constexpr GltfNoteKind kNoImage{"textures without an image that this build reads", "material",
                                "their factors alone are used"};
constexpr GltfNoteKind kManyUvSets{"more than two sets of texture coordinates", "material",
                                   "textures that use the others are left out"};
constexpr GltfNoteKind kBadTransform{"a texture transform that is not finite", "material", "ignored"};

/// All textures of a scene together: 4 GiB, a third more with their mip chains.
constexpr std::int64_t kMaxTotalTexels = std::int64_t{1} << 29;

double number_of(const tinygltf::Value& object, const char* key, std::size_t index, double missing)
{
    if (!object.Has(key)) return missing;
    const tinygltf::Value& value = object.Get(key);
    if (!value.IsArray()) return value.IsNumber() ? value.GetNumberAsDouble() : missing;
    return index < value.ArrayLen() ? value.Get(static_cast<int>(index)).GetNumberAsDouble() : missing;
}

/// KHR_texture_transform: scaled, turned counter-clockwise as seen with v pointing down, moved. The
/// extension's second example (the lower left quadrant, turned clockwise) tells the sense of the turn.
glm::mat3x2 transform_of(const tinygltf::Value& transform)
{
    const double turn = number_of(transform, "rotation", 0, 0.0);
    const glm::dvec2 scale(number_of(transform, "scale", 0, 1.0), number_of(transform, "scale", 1, 1.0));
    const glm::dvec2 offset(number_of(transform, "offset", 0, 0.0), number_of(transform, "offset", 1, 0.0));
    const double c = std::cos(turn);
    const double s = std::sin(turn);
    return {glm::vec2(scale.x * glm::dvec2(c, -s)), glm::vec2(scale.y * glm::dvec2(s, c)), glm::vec2(offset)};
}

Wrap wrap_of(const GltfFile& file, int mode, const std::string& what)
{
    switch (mode) {
        case TINYGLTF_TEXTURE_WRAP_REPEAT:
            return Wrap::repeat;
        case TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT:
            return Wrap::mirrored_repeat;
        case TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE:
            return Wrap::clamp_to_edge;
        default:
            bad_file(file, what + " has the wrap mode " + std::to_string(mode) + ", expected 10497, 33071 or 33648");
    }
}

/// What the texels of an image follow from.
std::string content_of(std::span<const std::uint8_t> bytes, ColorSpace space)
{
    Fingerprint print;
    print.add(space);
    print.add(bytes.size());
    print.add_bytes(bytes.data(), bytes.size());
    return print.text();
}

bool is_finite(const glm::mat3x2& matrix)
{
    for (int i = 0; i < 3; ++i) {
        if (!std::isfinite(matrix[i].x) || !std::isfinite(matrix[i].y)) return false;
    }
    return true;
}

}  // namespace

TextureUse texture_use(int index, int uv_set, const tinygltf::ExtensionMap& extensions)
{
    TextureUse use{index, uv_set};
    const auto found = extensions.find("KHR_texture_transform");
    if (found == extensions.end()) return use;
    use.texture_from_uv = transform_of(found->second);
    use.uv_set = static_cast<int>(number_of(found->second, "texCoord", 0, uv_set));
    return use;
}

TextureUse texture_use(const tinygltf::Value& parent, const char* key)
{
    if (!parent.Has(key)) return {};
    const tinygltf::Value& info = parent.Get(key);
    tinygltf::ExtensionMap extensions;
    if (info.Has("extensions") && info.Get("extensions").Has("KHR_texture_transform")) {
        extensions["KHR_texture_transform"] = info.Get("extensions").Get("KHR_texture_transform");
    }
    return texture_use(static_cast<int>(number_of(info, "index", 0, -1)),
                       static_cast<int>(number_of(info, "texCoord", 0, 0)), extensions);
}

TextureSlot TextureReader::read(const TextureUse& use, ColorSpace space, const UvSets& uv_sets, const std::string& user,
                                const std::string& name)
{
    TextureSlot slot;
    if (use.texture < 0) return slot;
    if (static_cast<std::size_t>(use.texture) >= model_.textures.size()) {
        bad_file(file_, user + " names texture " + std::to_string(use.texture) + ", the file has " +
                            std::to_string(model_.textures.size()));
    }
    const tinygltf::Texture& texture = model_.textures[static_cast<std::size_t>(use.texture)];
    const std::string what = element_name("texture", static_cast<std::size_t>(use.texture), texture.name);
    const auto set = std::find(uv_sets.begin(), uv_sets.end(), use.uv_set);
    if (set == uv_sets.end()) {
        file_.notes->add(kManyUvSets, name);
        return slot;
    }
    slot.uv_set = static_cast<int>(set - uv_sets.begin());
    if (is_finite(use.texture_from_uv))
        slot.texture_from_uv = use.texture_from_uv;
    else
        file_.notes->add(kBadTransform, name);
    set_sampler(texture, what, slot);

    const int image = image_of(texture, what, name);
    if (image < 0) return slot;
    const auto [entry, is_new] = known_.try_emplace({image, space}, static_cast<int>(scene_.textures.size()));
    if (is_new) scene_.textures.push_back(read_image(image, space));
    slot.texture = entry->second;
    return slot;
}

/// @return index of an image, -1 if there is none
int TextureReader::image_of(const tinygltf::Texture& texture, const std::string& what, const std::string& name) const
{
    int image = texture.source;
    const auto webp = texture.extensions.find("EXT_texture_webp");
    if (webp != texture.extensions.end() && (reads_webp() || image < 0)) {
        image = static_cast<int>(number_of(webp->second, "source", 0, image));
    }
    if (image < 0) {
        file_.notes->add(kNoImage, name);
        return -1;
    }
    if (static_cast<std::size_t>(image) >= model_.images.size()) {
        bad_file(file_, what + " names image " + std::to_string(image) + ", the file has " +
                            std::to_string(model_.images.size()));
    }
    return image;
}

void TextureReader::set_sampler(const tinygltf::Texture& texture, const std::string& what, TextureSlot& slot) const
{
    if (texture.sampler < 0) return;
    if (static_cast<std::size_t>(texture.sampler) >= model_.samplers.size()) {
        bad_file(file_, what + " names sampler " + std::to_string(texture.sampler) + ", the file has " +
                            std::to_string(model_.samplers.size()));
    }
    const auto index = static_cast<std::size_t>(texture.sampler);
    const tinygltf::Sampler& sampler = model_.samplers[index];
    const std::string user = element_name("sampler", index, sampler.name);
    slot.wrap_u = wrap_of(file_, sampler.wrapS, user);
    slot.wrap_v = wrap_of(file_, sampler.wrapT, user);
    const int filter = sampler.magFilter;
    if (filter != -1 && filter != TINYGLTF_TEXTURE_FILTER_NEAREST && filter != TINYGLTF_TEXTURE_FILTER_LINEAR) {
        bad_file(file_, user + " has the magFilter " + std::to_string(filter) + ", expected 9728 or 9729");
    }
    slot.nearest = filter == TINYGLTF_TEXTURE_FILTER_NEAREST;
}

int TextureReader::keep(Texture made, const std::string& user)
{
    texels_ += static_cast<std::int64_t>(made.levels.front().texels.size());
    if (texels_ > kMaxTotalTexels) {
        fail(file_, ErrorCode::unsupported,
             user + " takes the textures beyond " + std::to_string(kMaxTotalTexels) +
                 " texels, more than this build holds");
    }
    scene_.textures.push_back(std::move(made));
    return static_cast<int>(scene_.textures.size()) - 1;
}

/// The one that a scene like this has of the same image, if there is still room for it; else none, without levels.
Texture TextureReader::shared_texture(const std::string& content) const
{
    if (!file_.like) return {};
    for (const Texture& texture : file_.like->textures)
        if (texture.content == content &&
            texels_ + static_cast<std::int64_t>(texture.levels.front().texels.size()) <= kMaxTotalTexels)
            return texture;
    return {};
}

Texture TextureReader::read_image(int index, ColorSpace space)
{
    const auto number = static_cast<std::size_t>(index);
    const tinygltf::Image& image = model_.images[number];
    const std::string shown = on_one_line(image.uri.substr(0, 80));
    const std::string what = element_name("image", number, image.name.empty() ? shown : image.name);
    const std::string name = short_name(number, image.name.empty() ? shown : image.name);
    const std::string where = file_.path + ": " + what;
    const auto decode = [&](std::span<const std::uint8_t> bytes) {
        const std::string content = content_of(bytes, space);
        Texture made = shared_texture(content);
        if (made.levels.empty()) made = decode_texture(bytes, space, kMaxTotalTexels - texels_, name, where);
        made.name = name;
        made.content = content;
        return made;
    };
    Texture texture = image.bufferView >= 0 ? decode(view_bytes(file_, model_, image.bufferView, what))
                                            : decode(uri_bytes(file_, image.uri, what));
    texels_ += static_cast<std::int64_t>(texture.levels.front().texels.size());
    return texture;
}

}  // namespace rcs
