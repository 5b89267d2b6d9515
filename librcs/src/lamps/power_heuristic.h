#pragma once

namespace rcs {

/// The weight of a sample that this technique takes `mine` times per steradian, and the other `others` times (Veach and
/// Guibas 1995). @param mine  may be +inf: no other technique counts
inline float power_heuristic(float mine, float others)
{
    const float ratio = others / mine;
    return mine > 0.0f ? 1.0f / (1.0f + ratio * ratio) : 0.0f;
}

}  // namespace rcs
