#pragma once

#include <cstdint>

namespace rcs {

/// Mixes a 64-bit key into a well-scattered one (the finaliser of SplitMix64, Steele et al. 2014).
inline std::uint64_t mix64(std::uint64_t x)
{
    x += 0x9e3779b97f4a7c15ull;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
    return x ^ (x >> 31);
}

/// What a random stream is for; part of its key, so that stages never share numbers.
enum class Stream : std::uint64_t {
    gather = 1,
    gather_light,
    direct,
    placement,
    reference,
    glossy,
    light_cache,
    lit_points,
    probes,
    direct_error,
    direct_again,
    lamp_checks,
    contacts,
    renewal,
    views
};

inline std::uint64_t stream_key(std::uint64_t seed, Stream stream, std::uint64_t index)
{
    return mix64(mix64(seed ^ (static_cast<std::uint64_t>(stream) << 56)) ^ index);
}

/// The seed of one pass of a picture; that of pass 0 is the picture's. Steps by 2^64 over the golden ratio, so that
/// pictures of seeds s and s + 1 have no pass in common.
inline std::uint64_t pass_seed(std::uint64_t seed, int pass)
{
    return seed + static_cast<std::uint64_t>(pass) * 0x9e3779b97f4a7c15ull;
}

/// [0, 1), from the upper 24 bits.
inline float to_unit_float(std::uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24f; }

/// A small counter-based generator: number n of the stream with this key.
class RandomStream {
public:
    explicit RandomStream(std::uint64_t key) : key_(key) {}
    float next() { return to_unit_float(static_cast<std::uint32_t>(mix64(key_ + counter_++) >> 32)); }

private:
    std::uint64_t key_;
    std::uint64_t counter_ = 0;
};

}  // namespace rcs
