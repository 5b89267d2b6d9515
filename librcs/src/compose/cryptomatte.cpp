#include "compose/cryptomatte.h"

#include <algorithm>
#include <bit>
#include <cstdio>
#include <utility>

#include <nlohmann/json.hpp>

#include "util/murmur_hash.h"

namespace rcs {
namespace {

// More ids than that in one pixel are not told apart: further ones are left out.
constexpr std::size_t kMostIds = 32;

std::string hexadecimal(std::uint32_t id)
{
    char text[16];
    std::snprintf(text, sizeof text, "%08x", id);
    return text;
}

void add_name(const std::string& name, CryptomatteIds& ids)
{
    const std::uint32_t id = cryptomatte_id(name);
    ids.names.emplace(name, id);
    ids.of_instance.push_back(id);
}

/// Room for twice as many pairs a pixel.
void grow(Image& pairs)
{
    Image larger(pairs.width, pairs.height, 2 * pairs.channels);
    const auto from = static_cast<std::size_t>(pairs.channels);
    for (std::size_t i = 0; i < pairs.pixels.size() / from; ++i)
        std::copy_n(pairs.pixels.data() + from * i, from, larger.pixels.data() + 2 * from * i);
    pairs = std::move(larger);
}

/// Where `id` is, or would be, among a pixel's pairs; null: there is no room.
float* find_pair(Image& pairs, std::size_t pixel, std::uint32_t id)
{
    const auto channels = static_cast<std::size_t>(pairs.channels);
    float* const begin = pairs.pixels.data() + channels * pixel;
    for (float* pair = begin; pair != begin + channels; pair += 2)
        if (pair[1] == 0.0f || std::bit_cast<std::uint32_t>(pair[0]) == id) return pair;
    return nullptr;
}

}  // namespace

std::uint32_t cryptomatte_id(std::string_view name)
{
    constexpr std::uint32_t kExponent = 0xffu << 23;
    const std::uint32_t hash = murmur_hash(name), exponent = hash & kExponent;
    return exponent == 0u || exponent == kExponent ? hash ^ (1u << 23) : hash;
}

CryptomatteIds object_ids(const Scene& scene)
{
    CryptomatteIds ids;
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        const std::string& name = scene.instances[i].name;
        add_name(name.empty() ? "object " + std::to_string(i) : name, ids);
    }
    return ids;
}

CryptomatteIds material_ids(const Scene& scene)
{
    CryptomatteIds ids;
    for (const Instance& instance : scene.instances) {
        const int material = scene.meshes[static_cast<std::size_t>(instance.mesh)].material;
        const std::string& name = scene.materials[static_cast<std::size_t>(material)].name;
        add_name(name.empty() ? "material " + std::to_string(material) : name, ids);
    }
    return ids;
}

void add_coverage(Image& pairs, std::size_t pixel, std::uint32_t id, float part)
{
    if (!(part > 0.0f)) return;
    float* pair = find_pair(pairs, pixel, id);
    if (!pair && static_cast<std::size_t>(pairs.channels) < 2 * kMostIds) {
        grow(pairs);
        pair = find_pair(pairs, pixel, id);
    }
    if (!pair) return;
    pair[0] = std::bit_cast<float>(id);
    pair[1] += part;
}

void repeat_coverage(const Image& first, const std::vector<std::uint8_t>& met, Image& pairs)
{
    const auto channels = static_cast<std::size_t>(first.channels);
    for (std::size_t i = 0; i < met.size(); ++i) {
        if (met[i] == 0) continue;
        for (std::size_t c = channels * i; c < channels * (i + 1); c += 2)
            add_coverage(pairs, i, std::bit_cast<std::uint32_t>(first.pixels[c]), first.pixels[c + 1]);
    }
}

void rank_coverage(int passes, Image& pairs)
{
    using Pair = std::pair<float, std::uint32_t>;  // part, id
    Image ranked(pairs.width, pairs.height, 2 * kCryptomatteRanks);
    const auto from = static_cast<std::size_t>(pairs.channels), to = static_cast<std::size_t>(ranked.channels);
    std::vector<Pair> seen;
    for (std::size_t i = 0; i < pairs.pixels.size() / from; ++i) {
        seen.clear();
        for (std::size_t c = from * i; c < from * (i + 1) && pairs.pixels[c + 1] > 0.0f; c += 2)
            seen.emplace_back(pairs.pixels[c + 1], std::bit_cast<std::uint32_t>(pairs.pixels[c]));
        std::sort(seen.begin(), seen.end(), [](const Pair& a, const Pair& b) {
            return a.first != b.first ? a.first > b.first : a.second < b.second;
        });
        for (std::size_t rank = 0; rank < std::min<std::size_t>(seen.size(), kCryptomatteRanks); ++rank) {
            ranked.pixels[to * i + 2 * rank] = std::bit_cast<float>(seen[rank].second);
            ranked.pixels[to * i + 2 * rank + 1] = seen[rank].first / static_cast<float>(passes);
        }
    }
    pairs = std::move(ranked);
}

void describe_cryptomatte(std::string_view layer, const CryptomatteIds& ids, LayeredImage& image)
{
    nlohmann::ordered_json manifest = nlohmann::ordered_json::object();
    for (const auto& [name, id] : ids.names) manifest[name] = hexadecimal(id);
    const std::string key = "cryptomatte/" + hexadecimal(cryptomatte_id(layer)).substr(0, 7) + "/";
    std::map<std::string, std::string>& metadata = image.layer_metadata[std::string(layer)];
    metadata[key + "name"] = layer;
    metadata[key + "hash"] = "MurmurHash3_32";
    metadata[key + "conversion"] = "uint32_to_float32";
    // A name in bytes that are no UTF-8 is told with replacements.
    metadata[key + "manifest"] = manifest.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace rcs
