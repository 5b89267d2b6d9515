#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace rcs {

/// MurmurHash3_x86_32 with seed 0 (Austin Appleby, in the public domain).
inline std::uint32_t murmur_hash(std::string_view text)
{
    const auto scrambled = [](std::uint32_t k) { return std::rotl(k * 0xcc9e2d51u, 15) * 0x1b873593u; };
    std::uint32_t hash = 0;
    std::size_t i = 0;
    for (; i + 4 <= text.size(); i += 4) {
        std::uint32_t block = 0;
        for (unsigned byte = 0; byte < 4; ++byte)
            block |= static_cast<std::uint32_t>(static_cast<unsigned char>(text[i + byte])) << 8 * byte;
        hash = std::rotl(hash ^ scrambled(block), 13) * 5u + 0xe6546b64u;
    }
    std::uint32_t rest = 0;
    for (unsigned byte = 0; i + byte < text.size(); ++byte)
        rest |= static_cast<std::uint32_t>(static_cast<unsigned char>(text[i + byte])) << 8 * byte;
    hash ^= scrambled(rest);
    hash ^= static_cast<std::uint32_t>(text.size());
    hash = (hash ^ hash >> 16) * 0x85ebca6bu;
    hash = (hash ^ hash >> 13) * 0xc2b2ae35u;
    return hash ^ hash >> 16;
}

}  // namespace rcs
