#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "rcs/scene.h"
#include "scene/image_decoder.h"
#include "support/gltf_builder.h"
#include "support/pictures.h"

// What of a file's materials and textures arrives in the scene.

namespace rcs::test {
namespace {

/// A triangle with that material; a second set of uvs is there.
GltfBuilder file_with(const Json& material)
{
    GltfBuilder b;
    b.add("materials", material);
    const int positions = b.add_vec3({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
    const int uvs = b.add_vec2({{0, 1}, {1, 1}, {0, 0}});
    const int uvs1 = b.add_vec2({{0.5f, 0.5f}, {0.25f, 0.5f}, {0.5f, 0.75f}});
    b.add_node(
        {{"mesh", b.add_mesh("m", {{"attributes", {{"POSITION", positions}, {"TEXCOORD_0", uvs}, {"TEXCOORD_1", uvs1}}},
                                   {"material", 0}})}});
    return b;
}

void add_picture(GltfBuilder& b, const std::string& picture = kPicture)
{
    b.add("images", {{"bufferView", b.add_view(picture)}, {"mimeType", "image/png"}});
    b.add("textures", {{"source", static_cast<int>(b.root["images"].size()) - 1}});
}

Material material_of(const Json& material)
{
    GltfBuilder b = file_with(material);
    add_picture(b);
    return load(b).materials.at(0);
}

TEST(GltfMaterial, DefaultsAreThoseOfGltf)
{
    const Material m = material_of(Json::object());
    EXPECT_EQ(m.base_color, glm::vec3(1.0f));
    EXPECT_EQ(m.metallic, 1.0f);
    EXPECT_EQ(m.roughness, 1.0f);
    EXPECT_EQ(m.specular, 1.0f);
    EXPECT_EQ(m.specular_color, glm::vec3(1.0f));
    EXPECT_EQ(m.ior, 1.5f);
    EXPECT_EQ(m.alpha_mode, AlphaMode::opaque);
    EXPECT_EQ(m.alpha_cutoff, 0.5f);
    EXPECT_EQ(m.normal_scale, 1.0f);
    EXPECT_FALSE(m.double_sided || m.unlit || m.base_color_texture.used() || m.normal_texture.used());
}

TEST(GltfMaterial, EveryFactorArrives)
{
    const Material m = material_of(Json::parse(R"({
        "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0.5,
            "roughnessFactor": 0.6},
        "alphaMode": "MASK", "alphaCutoff": 0.7, "doubleSided": true, "emissiveFactor": [1, 0.5, 0.25],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}, "KHR_materials_ior": {"ior": 1.75},
            "KHR_materials_specular": {"specularFactor": 0.8, "specularColorFactor": [0.5, 1, 2]},
            "KHR_materials_transmission": {"transmissionFactor": 0.25},
            "KHR_materials_clearcoat": {"clearcoatFactor": 0.75, "clearcoatRoughnessFactor": 0.125},
            "KHR_materials_anisotropy": {"anisotropyStrength": 0.625, "anisotropyRotation": -2.5},
            "KHR_materials_diffuse_transmission": {"diffuseTransmissionFactor": 0.875,
                "diffuseTransmissionColorFactor": [0.25, 0.5, 0.75]},
            "KHR_materials_sheen": {"sheenColorFactor": [0.5, 0.25, 1], "sheenRoughnessFactor": 0.375}}})"));
    EXPECT_EQ(m.sheen_color, glm::vec3(0.5f, 0.25f, 1.0f));
    EXPECT_EQ(m.sheen_roughness, 0.375f);
    EXPECT_EQ(m.diffuse_transmission, 0.875f);
    EXPECT_EQ(m.diffuse_transmission_color, glm::vec3(0.25f, 0.5f, 0.75f));
    EXPECT_EQ(m.anisotropy, 0.625f);
    EXPECT_EQ(m.anisotropy_rotation, -2.5f);
    EXPECT_EQ(m.base_color, glm::vec3(0.1f, 0.2f, 0.3f));
    EXPECT_EQ(m.alpha, 0.4f);
    EXPECT_EQ(m.metallic, 0.5f);
    EXPECT_EQ(m.roughness, 0.6f);
    EXPECT_EQ(m.alpha_mode, AlphaMode::mask);
    EXPECT_EQ(m.alpha_cutoff, 0.7f);
    EXPECT_TRUE(m.double_sided);
    EXPECT_EQ(m.emission, glm::vec3(4, 2, 1));
    EXPECT_EQ(m.ior, 1.75f);
    EXPECT_EQ(m.specular, 0.8f);
    EXPECT_EQ(m.specular_color, glm::vec3(0.5f, 1, 2));
    EXPECT_EQ(m.transmission, 0.25f);
    EXPECT_EQ(m.clearcoat, 0.75f);
    EXPECT_EQ(m.clearcoat_roughness, 0.125f);
}

TEST(GltfMaterial, UnlitOnesKeepTheirColourAlone)
{
    const Material m = material_of({{"emissiveFactor", {1, 1, 1}},
                                    {"normalTexture", {{"index", 0}}},
                                    {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}},
                                    {"extensions", {{"KHR_materials_unlit", Json::object()}}}});
    EXPECT_TRUE(m.unlit);
    EXPECT_TRUE(m.base_color_texture.used());
    EXPECT_FALSE(m.normal_texture.used());
    EXPECT_EQ(m.emission, glm::vec3(0.0f));
}

TEST(GltfMaterial, EverySlotHasItsTexture)
{
    const Json t = {{"index", 0}};
    Json material = {{"pbrMetallicRoughness", {{"baseColorTexture", t}, {"metallicRoughnessTexture", t}}},
                     {"normalTexture", {{"index", 0}, {"scale", 0.5}}},
                     {"emissiveTexture", t},
                     {"emissiveFactor", {1, 1, 1}}};
    material["extensions"]["KHR_materials_specular"] = {{"specularTexture", t}, {"specularColorTexture", t}};
    material["extensions"]["KHR_materials_transmission"] = {{"transmissionFactor", 1}, {"transmissionTexture", t}};
    material["extensions"]["KHR_materials_clearcoat"] = {
        {"clearcoatFactor", 1}, {"clearcoatTexture", t}, {"clearcoatRoughnessTexture", t}};
    material["extensions"]["KHR_materials_sheen"] = {
        {"sheenColorFactor", {1, 1, 1}}, {"sheenColorTexture", t}, {"sheenRoughnessTexture", t}};
    material["extensions"]["KHR_materials_anisotropy"] = {{"anisotropyStrength", 1}, {"anisotropyTexture", t}};
    material["extensions"]["KHR_materials_diffuse_transmission"] = {
        {"diffuseTransmissionFactor", 1}, {"diffuseTransmissionTexture", t}, {"diffuseTransmissionColorTexture", t}};
    GltfBuilder b = file_with(material);
    add_picture(b);
    const Scene scene = load(b);
    const Material& m = scene.materials.at(0);
    ASSERT_EQ(scene.textures.size(), 2u);  // one image, as colours and as numbers
    EXPECT_NE(scene.textures[0].content, scene.textures[1].content) << "one could stand for the other in a next scene";
    const auto red = [&](const TextureSlot& slot) {
        return scene.textures.at(static_cast<std::size_t>(slot.texture)).levels[0].texels[2][0];  // 10 of 255
    };
    const double linear_red = 10.0 / 255.0 / 12.92 * 65535.0;
    for (const TextureSlot* color : {&m.base_color_texture, &m.emission_texture, &m.specular_color_texture,
                                     &m.sheen_color_texture, &m.diffuse_transmission_color_texture}) {
        ASSERT_TRUE(color->used());
        EXPECT_NEAR(red(*color), linear_red, 0.5);
    }
    for (const TextureSlot* number :
         {&m.metallic_roughness_texture, &m.normal_texture, &m.specular_texture, &m.transmission_texture,
          &m.clearcoat_texture, &m.clearcoat_roughness_texture, &m.sheen_roughness_texture, &m.anisotropy_texture,
          &m.diffuse_transmission_texture}) {
        ASSERT_TRUE(number->used());
        EXPECT_EQ(red(*number), 10 * 257);
    }
    EXPECT_EQ(m.normal_scale, 0.5f);
    EXPECT_EQ(m.emission, glm::vec3(1.0f));
}

TEST(GltfMaterial, SpecularGlossinessIsTheSameSurfaceInOtherWords)
{
    const auto material = [](const Json& values) {
        return material_of({{"extensions", {{"KHR_materials_pbrSpecularGlossiness", values}}}});
    };
    const Material m = material(
        {{"diffuseFactor", {0.4, 0.6, 0.8, 0.5}}, {"specularFactor", {0.25, 0.5, 0.125}}, {"glossinessFactor", 0.75}});
    EXPECT_EQ(m.alpha, 0.5f);
    EXPECT_EQ(m.metallic, 0.0f);
    EXPECT_FLOAT_EQ(m.roughness, 0.25f);
    for (int c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(m.base_color[c], 0.5f * glm::vec3(0.4f, 0.6f, 0.8f)[c]);
    const float root = (m.ior - 1.0f) / (m.ior + 1.0f);
    for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(root * root * m.specular_color[c], glm::vec3(0.25f, 0.5f, 0.125f)[c], 1e-6f);
    EXPECT_EQ(m.specular, 1.0f);
    const Material defaults = material(Json::object());
    EXPECT_EQ(defaults.base_color, glm::vec3(0.0f));  // all of the light is reflected
    EXPECT_EQ(defaults.roughness, 0.0f);
}

TEST(GltfMaterial, SpecularGlossinessTexturesAreConvertedTexelByTexel)
{
    const Json t = {{"index", 0}};
    const auto scene_of = [&](const Json& specular) {
        GltfBuilder b = file_with({{"extensions",
                                    {{"KHR_materials_pbrSpecularGlossiness",
                                      {{"diffuseFactor", {1, 0.5, 1, 1}},
                                       {"diffuseTexture", t},
                                       {"specularFactor", {0.5, 0.25, 1}},
                                       {"glossinessFactor", 0.75},
                                       {"specularGlossinessTexture", specular}}}}}});
        add_picture(b);
        add_picture(b, kTransparentPicture);
        return b;
    };
    const auto texels = [](const Scene& scene, const TextureSlot& slot) {
        return scene.textures.at(static_cast<std::size_t>(slot.texture)).levels[0].texels;
    };
    const Scene scene = load(scene_of(t));
    const Material& m = scene.materials.at(0);
    const auto source = texels(scene, m.specular_color_texture), base = texels(scene, m.base_color_texture);
    ASSERT_EQ(base.size(), 4u);
    EXPECT_EQ(m.base_color, glm::vec3(1.0f, 0.5f, 1.0f));
    for (std::size_t i = 0; i < 4; ++i) {
        const glm::dvec3 s = glm::dvec3(source[i][0], source[i][1], source[i][2]) / 65535.0;
        const double left = 1.0 - std::max({0.5 * s.r, 0.25 * s.g, s.b});
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(base[i][static_cast<std::size_t>(c)], 65535.0 * left * s[c], 1.0);
    }
    // Glossiness is in alpha: 0 and 1 of the second picture, 1 of the first, which has none.
    EXPECT_NEAR(texels(scene, m.metallic_roughness_texture)[0][1], 0.25 * 65535, 1.0);
    EXPECT_EQ(m.roughness, 1.0f);
    const Scene transparent = load(scene_of({{"index", 1}}));
    const auto rough = texels(transparent, transparent.materials.at(0).metallic_roughness_texture);
    EXPECT_EQ(rough.at(0)[1], 65535);
    EXPECT_NEAR(rough.at(1)[1], 0.25 * 65535, 1.0);

    Log log;
    load(scene_of({{"index", 0}, {"texCoord", 1}}), &log);
    EXPECT_EQ(log.count("mapped unlike the diffuse one in 1 material"), 1);
}

TEST(GltfMaterial, SamplersReachTheirSlots)
{
    GltfBuilder b = file_with(
        {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}, {"normalTexture", {{"index", 1}}}});
    add_picture(b);
    b.add("textures", {{"source", 0}, {"sampler", 0}});
    b.add("samplers", {{"wrapS", 33071}, {"wrapT", 33648}, {"magFilter", 9728}});
    const Scene scene = load(b);
    const Material& m = scene.materials.at(0);
    EXPECT_EQ(m.base_color_texture.wrap_u, Wrap::repeat);
    EXPECT_FALSE(m.base_color_texture.nearest);
    EXPECT_EQ(m.normal_texture.wrap_u, Wrap::clamp_to_edge);
    EXPECT_EQ(m.normal_texture.wrap_v, Wrap::mirrored_repeat);
    EXPECT_TRUE(m.normal_texture.nearest);
}

/// Where a slot reads its texture for a mesh's uv.
glm::vec2 mapped(const TextureSlot& slot, glm::vec2 uv) { return slot.texture_from_uv * glm::vec3(uv, 1.0f); }

Json transformed(const Json& transform)
{
    return {{"pbrMetallicRoughness",
             {{"baseColorTexture", {{"index", 0}, {"extensions", {{"KHR_texture_transform", transform}}}}}}}};
}

TEST(GltfMaterial, TransformsScaleThenTurnThenMove)
{
    // The extension's examples: "utilizes only the lower left quadrant of the source image, rotated clockwise
    // 90 degrees", which puts the quadrant's lower left corner to the upper left; and v inverted.
    const TextureSlot quadrant =
        material_of(transformed({{"offset", {0, 1}}, {"rotation", std::acos(0.0)}, {"scale", {0.5, 0.5}}}))
            .base_color_texture;
    EXPECT_LT(glm::distance(mapped(quadrant, {0, 0}), {0, 1}), 1e-6f);
    EXPECT_LT(glm::distance(mapped(quadrant, {1, 0}), {0, 0.5f}), 1e-6f);
    EXPECT_LT(glm::distance(mapped(quadrant, {0, 1}), {0.5f, 1}), 1e-6f);
    const TextureSlot inverted = material_of(transformed({{"offset", {0, 1}}, {"scale", {1, -1}}})).base_color_texture;
    EXPECT_EQ(mapped(inverted, {0.25f, 0.25f}), glm::vec2(0.25f, 0.75f));
    EXPECT_EQ(material_of(transformed({{"texCoord", 1}})).base_color_texture.uv_set, 1);
}

TEST(GltfMaterial, TheSecondUvSetIsReadWhereItIsUsed)
{
    const auto scene = [](int set) {
        GltfBuilder b =
            file_with({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}, {"texCoord", set}}}}}});
        add_picture(b);
        b.root["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_6"] = 2;
        return load(b);
    };
    const Scene first = scene(0);
    EXPECT_EQ(first.meshes.at(0).uvs.size(), 3u);
    EXPECT_TRUE(first.meshes.at(0).uvs1.empty());
    const Scene second = scene(1);
    EXPECT_EQ(second.materials.at(0).base_color_texture.uv_set, 1);
    EXPECT_EQ(second.meshes.at(0).uvs1.at(1), glm::vec2(0.25f, 0.5f));
    const Scene seventh = scene(6);  // takes the first place
    EXPECT_EQ(seventh.materials.at(0).base_color_texture.uv_set, 0);
    EXPECT_EQ(seventh.meshes.at(0).uvs.at(1), glm::vec2(0.25f, 0.5f));
}

TEST(GltfMaterial, WebpIsPreferredToItsFallback)
{
    GltfBuilder b = file_with({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
    add_picture(b);
    add_picture(b, kWebpPicture);
    b.root["textures"][0]["extensions"]["EXT_texture_webp"]["source"] = 1;
    const Scene scene = load(b);
    const Texture::Level& level = scene.textures.at(0).levels[0];
    ASSERT_EQ(level.width, 2);
    ASSERT_EQ(level.height, 1);
    EXPECT_NEAR(level.texels[0][3], 128 * 257, 257);  // alpha is linear and does not darken the colour
    EXPECT_EQ(level.texels[0], level.texels[1]);
}

TEST(GltfMaterial, ImagesBeyondWhatIsLeftForThemAreRefused)
{
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(kPicture.data());
    EXPECT_EQ(decode_texture({bytes, kPicture.size()}, ColorSpace::srgb, 4, "p", "image").levels.size(), 2u);
    expect_error(ErrorCode::unsupported, {"image has 2 x 2 texels", "at most 3 texels"},
                 [&] { decode_texture({bytes, kPicture.size()}, ColorSpace::srgb, 3, "p", "image"); });
}

TEST(GltfMaterial, AFileWithoutLightGetsANeutralSky)
{
    const auto sky = [](const Json& material) { return load(file_with(material)).sky_radiance; };
    EXPECT_EQ(sky(Json::object()), glm::vec3(1.0f));
    EXPECT_EQ(sky({{"emissiveFactor", {0, 1, 0}}}), glm::vec3(0.0f));
    GltfBuilder unused = file_with(Json::object());  // a lamp that nothing is made of gives no light
    unused.add("materials", {{"emissiveFactor", {1, 1, 1}}});
    EXPECT_EQ(load(unused).sky_radiance, glm::vec3(1.0f));
}

}  // namespace
}  // namespace rcs::test
