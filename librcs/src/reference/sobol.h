#pragma once

#include <cstdint>

#include <glm/glm.hpp>

#include "util/random.h"

namespace rcs {

inline std::uint32_t reverse_bits(std::uint32_t x)
{
    x = (x >> 16) | (x << 16);
    x = ((x & 0xff00ff00u) >> 8) | ((x & 0x00ff00ffu) << 8);
    x = ((x & 0xf0f0f0f0u) >> 4) | ((x & 0x0f0f0f0fu) << 4);
    x = ((x & 0xccccccccu) >> 2) | ((x & 0x33333333u) << 2);
    return ((x & 0xaaaaaaaau) >> 1) | ((x & 0x55555555u) << 1);
}

/// A hash in which each bit depends on lower bits only: on reversed bits, an Owen scramble. The form
/// of Laine and Karras 2011; Vegdahl's multipliers (2021, "Building a better LK hash").
inline std::uint32_t hash_upwards(std::uint32_t x, std::uint32_t seed)
{
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1u;
    x ^= x * 0x05526c56u;
    return x ^ (x * 0x53a22864u);
}

/// Random digits 2^-1, 2^-2, ... where each depends on those before it (Owen 1995).
inline std::uint32_t owen_scramble(std::uint32_t x, std::uint32_t seed)
{
    return reverse_bits(hash_upwards(reverse_bits(x), seed));
}

/// The second Sobol' dimension with its bits reversed. Its generator matrix is Pascal's triangle
/// modulo 2, the Kronecker power of (1 1; 0 1), so it is applied one factor at a time.
inline std::uint32_t reversed_second_dimension(std::uint32_t index)
{
    index ^= index >> 16;
    index ^= (index & 0xff00ff00u) >> 8;
    index ^= (index & 0xf0f0f0f0u) >> 4;
    index ^= (index & 0xccccccccu) >> 2;
    return index ^ ((index & 0xaaaaaaaau) >> 1);
}

/// Point `index` of the Sobol' (0, 2)-sequence that belongs to `key`, in [0, 1)^2: order shuffled and both
/// dimensions Owen-scrambled (Burley 2020, "Practical hash-based Owen scrambling", JCGT 9(4)).
/// Sequences of different keys are independent and may be padded to more dimensions. Every aligned
/// block of 2^m indices is a (0, m, 2)-net.
inline glm::vec2 sobol_pair(std::uint32_t index, std::uint64_t key)
{
    const std::uint64_t axes = mix64(key);
    const std::uint32_t shuffled = owen_scramble(index, static_cast<std::uint32_t>(mix64(~key)));
    // The first dimension is the reversed index: its reversal cancels that of the scramble.
    const std::uint32_t x = reverse_bits(hash_upwards(shuffled, static_cast<std::uint32_t>(axes)));
    const std::uint32_t y_seed = static_cast<std::uint32_t>(axes >> 32);
    const std::uint32_t y = reverse_bits(hash_upwards(reversed_second_dimension(shuffled), y_seed));
    return {to_unit_float(x), to_unit_float(y)};
}

}  // namespace rcs
