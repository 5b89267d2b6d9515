#include "corpus/corpus.h"

// Textures of every slot, samplers, transforms and images.

namespace rcs::test {
namespace {

/// The base colour texture, with members of its textureInfo and of its texture.
Corpus::Change base(const Json& info, const Json& texture = Json::object(), const std::string& picture = kPicture)
{
    return [=](Draft& d) {
        Json made = d.texture(picture, texture);
        if (!info.empty()) made.update(info);
        d.pbr()["baseColorTexture"] = made;
    };
}

Corpus::Change sampler(const Json& settings)
{
    return [=](Draft& d) {
        base(Json::object(), {{"sampler", 0}})(d);
        d.root()["samplers"] = Json::array({settings});
    };
}

Corpus::Change transform(const Json& settings) { return base({{"extensions", {{"KHR_texture_transform", settings}}}}); }

void second_uvs(Draft& d) { d.attributes()["TEXCOORD_1"] = d.b.add_vec2({{0, 0}, {1, 0}, {1, 1}, {0, 1}}); }

/// A texture in a slot of an extension.
Corpus::Change slot(const char* extension, const char* factor, const char* key)
{
    return [=](Draft& d) {
        const Json texture = d.texture();
        d.extension(extension) = {{factor, 0.5}, {key, texture}};
    };
}

std::uint32_t crc_of(const std::string& bytes)
{
    std::uint32_t crc = 0xffffffff;
    for (const char c : bytes) {
        crc ^= static_cast<unsigned char>(c);
        for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320u : 0u);
    }
    return ~crc;
}

std::string big_endian(std::uint32_t value)
{
    std::string bytes;
    for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift & 0xff);
    return bytes;
}

/// kPicture with another size in its header.
std::string picture_that_says(std::uint32_t width, std::uint32_t height)
{
    const std::string header = "IHDR" + big_endian(width) + big_endian(height) + kPicture.substr(24, 5);
    return kPicture.substr(0, 12) + header + big_endian(crc_of(header)) + kPicture.substr(33);
}

void add_image_files(Corpus& c)
{
    c.renders("image_png", base({}));
    c.renders("image_png_grey_16_bit", base({}, Json::object(), kDeepPicture));
    c.renders("image_png_with_alpha", base({}, Json::object(), kTransparentPicture));
    c.renders("image_jpeg", base({}, Json::object(), bytes_of(RCS_TESTS_DIR "/corpus/picture.jpg")));
    c.renders("image_webp_alone", [](Draft& d) {
        d.root()["images"] = Json::array({{{"bufferView", d.b.add_view(kWebpPicture)}, {"mimeType", "image/webp"}}});
        d.root()["textures"] = Json::array({{{"extensions", {{"EXT_texture_webp", {{"source", 0}}}}}}});
        d.pbr()["baseColorTexture"] = {{"index", 0}};
    });
    c.renders("image_webp_or_png", [](Draft& d) {
        base({})(d);
        d.root()["images"].push_back({{"bufferView", d.b.add_view(kWebpPicture)}, {"mimeType", "image/webp"}});
        d.root()["textures"][0]["extensions"]["EXT_texture_webp"]["source"] = 1;
    });
    c.notes("texture_without_image", "without an image", [](Draft& d) {
        base({})(d);
        d.root()["textures"][0].erase("source");
    });
    c.fails("image_of_no_kind", "image 0", base({}, Json::object(), "no picture"), ErrorCode::unsupported);
    c.fails("image_damaged", "image 0",
            base({}, Json::object(), kPicture.substr(0, 50) + '\x55' + kPicture.substr(51)));
    c.fails("image_bomb", "fewer bytes", base({}, Json::object(), picture_that_says(11000, 11000)));
    c.fails("image_too_wide", "sides", base({}, Json::object(), picture_that_says(40000, 1)), ErrorCode::unsupported);
    c.fails("image_of_nothing", "image 0", [](Draft& d) { d.root()["images"] = Json::array({Json::object()}); });
    c.fails("image_of_both", "image 0", [](Draft& d) {
        base({})(d);
        d.root()["images"][0]["uri"] = "x.png";
    });
    c.fails("image_view_unknown", "image 0",
            [](Draft& d) { d.root()["images"] = Json::array({{{"bufferView", 99}}}); });
    c.fails("image_uri_is_number", "'uri'", [](Draft& d) { d.root()["images"] = Json::array({{{"uri", 1}}}); });
    c.fails("webp_source_unknown", "image 8", [](Draft& d) {
        base({})(d);
        d.root()["textures"][0]["extensions"]["EXT_texture_webp"]["source"] = 8;
    });
    c.renders("webp_without_source", [](Draft& d) {
        base({})(d);
        d.root()["textures"][0]["extensions"]["EXT_texture_webp"] = Json::object();
    });
    c.renders("textures_without_source_unused", [](Draft& d) {
        base({})(d);
        d.root()["textures"].push_back(Json::object());
        d.root()["textures"].push_back({{"extensions", {{"EXT_texture_webp", Json::object()}}}});
    });
}

void add_slot_files(Corpus& c)
{
    c.renders("metallic_roughness_texture", [](Draft& d) { d.pbr()["metallicRoughnessTexture"] = d.texture(); });
    c.renders("normal_texture", [](Draft& d) { d.material["normalTexture"] = d.texture(); });
    c.renders("normal_texture_scaled", [](Draft& d) {
        d.material["normalTexture"] = d.texture();
        d.material["normalTexture"]["scale"] = 0.5;
    });
    c.renders("normal_texture_with_tangents", [](Draft& d) {
        d.material["normalTexture"] = d.texture();
        d.attributes()["NORMAL"] = d.b.add_vec3(std::vector<glm::vec3>(4, {0, 0, 1}));
        d.attributes()["TANGENT"] =
            d.b.add_accessor(d.b.add_view(raw(std::vector<glm::vec4>(4, {1, 0, 0, 1}))), kFloat, "VEC4", 4);
    });
    c.notes("tangents_of_zero", "tangents that are zero", [](Draft& d) {
        d.material["normalTexture"] = d.texture();
        d.attributes()["NORMAL"] = d.b.add_vec3(std::vector<glm::vec3>(4, {0, 0, 1}));
        d.attributes()["TANGENT"] = d.b.add_accessor(d.b.add_view(std::string(64, '\0')), kFloat, "VEC4", 4);
    });
    c.fails("tangents_of_three", "TANGENT", [](Draft& d) {
        d.material["normalTexture"] = d.texture();
        d.attributes()["NORMAL"] = d.attributes()["TANGENT"] = d.b.add_vec3(std::vector<glm::vec3>(4, {0, 0, 1}));
    });
    c.renders("occlusion_texture", [](Draft& d) { d.material["occlusionTexture"] = d.texture(); });
    c.renders("emissive_texture", [](Draft& d) {
        d.material["emissiveTexture"] = d.texture();
        d.material["emissiveFactor"] = {1, 1, 1};
    });
    c.renders("specular_texture", slot("KHR_materials_specular", "specularFactor", "specularTexture"));
    c.renders("specular_color_texture", slot("KHR_materials_specular", "specularFactor", "specularColorTexture"));
    c.renders("transmission_texture", slot("KHR_materials_transmission", "transmissionFactor", "transmissionTexture"));
    c.renders("clearcoat_texture", slot("KHR_materials_clearcoat", "clearcoatFactor", "clearcoatTexture"));
    c.renders("clearcoat_roughness_texture",
              slot("KHR_materials_clearcoat", "clearcoatFactor", "clearcoatRoughnessTexture"));
    c.notes("clearcoat_normal_texture", "clearcoat normal",
            slot("KHR_materials_clearcoat", "clearcoatFactor", "clearcoatNormalTexture"));
    c.renders("alpha_mask_texture", [](Draft& d) {
        base({}, Json::object(), kTransparentPicture)(d);
        d.material["alphaMode"] = "MASK";
    });
    c.fails("texture_unknown", "texture 5", [](Draft& d) { d.pbr()["baseColorTexture"] = {{"index", 5}}; });
    c.fails("texture_index_missing", "'index'", [](Draft& d) { d.pbr()["baseColorTexture"] = Json::object(); });
    c.fails("texture_index_is_text", "'index'", [](Draft& d) { d.material["normalTexture"] = {{"index", "0"}}; });
    c.fails("texture_of_extension_unknown", "texture 5",
            [](Draft& d) { d.extension("KHR_materials_specular") = {{"specularTexture", {{"index", 5}}}}; });
    c.fails("texture_source_unknown", "image 9", [](Draft& d) {
        base({})(d);
        d.root()["textures"][0]["source"] = 9;
    });
    c.fails("normal_scale_is_text", "'scale'", [](Draft& d) {
        d.material["normalTexture"] = d.texture();
        d.material["normalTexture"]["scale"] = "1";
    });
}

void add_mapping_files(Corpus& c)
{
    c.renders("texture_of_second_uvs", [](Draft& d) {
        base({{"texCoord", 1}})(d);
        second_uvs(d);
    });
    c.renders("texture_of_fifth_uvs", [](Draft& d) {
        base({{"texCoord", 4}})(d);
        d.attributes()["TEXCOORD_4"] = d.attributes()["TEXCOORD_0"];
    });
    c.notes("texture_of_missing_uvs", "no texture coordinates", base({{"texCoord", 1}}));
    c.notes("textures_of_three_uv_sets", "more than two sets", [](Draft& d) {
        second_uvs(d);
        d.attributes()["TEXCOORD_2"] = d.attributes()["TEXCOORD_1"];
        int set = 0;
        for (Json* place :
             {&d.pbr()["baseColorTexture"], &d.pbr()["metallicRoughnessTexture"], &d.material["normalTexture"]}) {
            *place = d.texture();
            (*place)["texCoord"] = set++;
        }
    });
    c.renders("transform_offset", transform({{"offset", {0.5, 0.25}}}));
    c.renders("transform_turn", transform({{"rotation", 0.7}}));
    c.renders("transform_scale", transform({{"scale", {3, -2}}}));
    c.renders("transform_to_second_uvs", [](Draft& d) {
        transform({{"texCoord", 1}})(d);
        second_uvs(d);
    });
    c.fails("transform_offset_of_three", "'offset'", transform({{"offset", {1, 2, 3}}}));
    c.fails("transform_turn_is_text", "'rotation'", transform({{"rotation", "90"}}));
    c.renders("sampler_repeat", sampler({{"wrapS", 10497}, {"wrapT", 10497}}));
    c.renders("sampler_mirror", sampler({{"wrapS", 33648}, {"wrapT", 33648}}));
    c.renders("sampler_clamp", sampler({{"wrapS", 33071}, {"wrapT", 33071}}));
    c.renders("sampler_nearest", sampler({{"magFilter", 9728}, {"minFilter", 9984}}));
    c.fails("sampler_wrap_unknown", "wrap mode 5", sampler({{"wrapS", 5}}));
    c.fails("sampler_filter_unknown", "magFilter", sampler({{"magFilter", 5}}));
    c.fails("sampler_filter_is_text", "'magFilter'", sampler({{"magFilter", "LINEAR"}}));
    c.fails("sampler_unknown", "sampler 4", base({}, {{"sampler", 4}}));
}

}  // namespace

void add_texture_files(Corpus& corpus)
{
    add_image_files(corpus);
    add_slot_files(corpus);
    add_mapping_files(corpus);
}

}  // namespace rcs::test
