#include "compose/cryptomatte.h"

#include <bit>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "support/scenes.h"
#include "util/murmur_hash.h"

namespace rcs {
namespace {

TEST(MurmurHash, IsThePublishedOne)
{
    // Values that other implementations give (seed 0).
    EXPECT_EQ(murmur_hash(""), 0u);
    EXPECT_EQ(murmur_hash("a"), 0x3c2569b2u);
    EXPECT_EQ(murmur_hash("hello"), 0x248bfa47u);
    EXPECT_EQ(murmur_hash("hello, world"), 0x149bbb7fu);
    EXPECT_EQ(murmur_hash("The quick brown fox jumps over the lazy dog"), 0x2e4ff723u);
}

TEST(Cryptomatte, IdsAreFiniteFloats)
{
    int mended = 0;
    for (int i = 0; i < 5000; ++i) {
        const std::string name = "object " + std::to_string(i);
        const std::uint32_t hash = murmur_hash(name), id = cryptomatte_id(name);
        ASSERT_TRUE(std::isnormal(std::bit_cast<float>(id))) << name;
        const std::uint32_t exponent = hash >> 23 & 255u;
        const bool is_special = exponent == 0u || exponent == 255u;
        ASSERT_EQ(id, is_special ? hash ^ 0x00800000u : hash) << name;
        mended += is_special ? 1 : 0;
    }
    EXPECT_GT(mended, 10);
}

/// The pairs of a pixel after ranking.
std::vector<std::pair<std::uint32_t, float>> ranks(const Image& image, std::size_t pixel)
{
    std::vector<std::pair<std::uint32_t, float>> found;
    for (std::size_t rank = 0; rank < kCryptomatteRanks; ++rank) {
        const float* const pair = image.pixels.data() + 2 * (kCryptomatteRanks * pixel + rank);
        if (pair[1] > 0.0f) found.emplace_back(std::bit_cast<std::uint32_t>(pair[0]), pair[1]);
    }
    return found;
}

TEST(Cryptomatte, RanksAreInOrderOfCoverage)
{
    const std::uint32_t a = cryptomatte_id("a"), b = cryptomatte_id("b"), c = cryptomatte_id("c");
    Image pairs(2, 1, 2);
    add_coverage(pairs, 0, a, 0.25f);
    add_coverage(pairs, 0, b, 1.0f);
    add_coverage(pairs, 0, a, 0.5f);
    add_coverage(pairs, 0, c, 0.75f);
    add_coverage(pairs, 0, c, 0.0f);
    add_coverage(pairs, 1, c, 4.0f);
    rank_coverage(4, pairs);
    EXPECT_EQ(pairs.channels, 12);
    const auto first = std::min(a, c), second = std::max(a, c);
    EXPECT_EQ(ranks(pairs, 0),
              (std::vector<std::pair<std::uint32_t, float>>{{b, 0.25f}, {first, 0.1875f}, {second, 0.1875f}}));
    EXPECT_EQ(ranks(pairs, 1), (std::vector<std::pair<std::uint32_t, float>>{{c, 1.0f}}));
}

TEST(Cryptomatte, KeepsTheLargestOfMoreThanSix)
{
    Image pairs(1, 1, 2);
    float all = 0.0f;
    for (int i = 1; i <= 20; ++i) {
        add_coverage(pairs, 0, cryptomatte_id(std::to_string(i)), static_cast<float>(i));
        all += static_cast<float>(i);
    }
    rank_coverage(1, pairs);
    const auto kept = ranks(pairs, 0);
    ASSERT_EQ(kept.size(), 6u);
    for (std::size_t rank = 0; rank < 6; ++rank) {
        const int i = 20 - static_cast<int>(rank);
        EXPECT_EQ(kept[rank].first, cryptomatte_id(std::to_string(i)));
        EXPECT_EQ(kept[rank].second, static_cast<float>(i));
    }
}

TEST(Cryptomatte, ThePartsOfTheFirstPassCountOnceMore)
{
    const std::uint32_t a = cryptomatte_id("a"), b = cryptomatte_id("b");
    Image first(2, 1, 2);
    add_coverage(first, 0, a, 1.0f);
    add_coverage(first, 1, b, 1.0f);
    Image pairs = first;
    add_coverage(pairs, 1, a, 1.0f);
    repeat_coverage(first, {1, 0}, pairs);
    rank_coverage(2, pairs);
    EXPECT_EQ(ranks(pairs, 0), (std::vector<std::pair<std::uint32_t, float>>{{a, 1.0f}}));
    EXPECT_EQ(ranks(pairs, 1).size(), 2u);
    EXPECT_EQ(ranks(pairs, 1)[0].second, 0.5f);
}

TEST(Cryptomatte, NamesAreThoseOfTheSceneAndUnnamedOnesGetTheirNumber)
{
    Scene scene;
    const int grey = test::add_material(scene, glm::vec3(0.5f));
    scene.materials[0].name = "grey \"paint\"";
    scene.materials.emplace_back();
    for (int i = 0; i < 4; ++i) test::add_mesh(scene, test::quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, i == 3 ? 1 : grey));
    scene.instances[0].name = scene.instances[1].name = "chair";
    scene.instances[2].name = "table";
    scene.instances[3].name = "";
    const CryptomatteIds objects = object_ids(scene), materials = material_ids(scene);
    EXPECT_EQ(objects.names.size(), 3u) << "those of one name are one object";
    EXPECT_EQ(objects.of_instance, (std::vector<std::uint32_t>{cryptomatte_id("chair"), cryptomatte_id("chair"),
                                                               cryptomatte_id("table"), cryptomatte_id("object 3")}));
    EXPECT_EQ(materials.of_instance[0], cryptomatte_id("grey \"paint\""));
    EXPECT_EQ(materials.of_instance[3], cryptomatte_id("material 1"));

    LayeredImage image;
    describe_cryptomatte(kMaterialLayer, materials, image);
    const auto& metadata = image.layer_metadata.at(kMaterialLayer);
    ASSERT_EQ(metadata.size(), 4u);
    const std::string key = metadata.begin()->first.substr(0, 20);
    EXPECT_EQ(key.substr(0, 12), "cryptomatte/");
    EXPECT_EQ(key[19], '/') << "7 digits";
    EXPECT_EQ(metadata.at(key + "name"), "CryptoMaterial");
    EXPECT_EQ(metadata.at(key + "hash"), "MurmurHash3_32");
    EXPECT_EQ(metadata.at(key + "conversion"), "uint32_to_float32");
    const auto manifest = nlohmann::json::parse(metadata.at(key + "manifest"));
    char id[16];
    std::snprintf(id, sizeof id, "%08x", cryptomatte_id("grey \"paint\""));
    EXPECT_EQ(manifest.at("grey \"paint\""), id);
    EXPECT_EQ(manifest.size(), 2u);
}

}  // namespace
}  // namespace rcs
