#pragma once

#include <cmath>

namespace rcs {

/// The transfer curve of IEC 61966-2-1 and its inverse, on [0, 1].
inline float srgb_from_linear(float v)
{
    return v <= 0.0031308f ? 12.92f * v : 1.055f * std::pow(v, 1.0f / 2.4f) - 0.055f;
}

inline float linear_from_srgb(float v) { return v <= 0.04045f ? v / 12.92f : std::pow((v + 0.055f) / 1.055f, 2.4f); }

}  // namespace rcs
