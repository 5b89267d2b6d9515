#pragma once

#include <cmath>
#include <numbers>

#include "util/multiversion.h"

namespace rcs {

// Angles as parts of a full turn, by functions that loops can compute in vectors.

RCS_ALWAYS_INLINE float fraction(float x) { return x - std::floor(x); }

/// sin(2 pi t) for t in [-0.25, 0.25]: Taylor series to t^11, error below 6e-8.
RCS_ALWAYS_INLINE float sine_of_quarter_turns(float t)
{
    const float x = t * (2.0f * std::numbers::pi_v<float>);
    const float x2 = x * x;
    return x * (1.0f + x2 * (-1.0f / 6.0f +
                             x2 * (1.0f / 120.0f +
                                   x2 * (-1.0f / 5040.0f + x2 * (1.0f / 362880.0f - x2 * (1.0f / 39916800.0f))))));
}

/// sin(2 pi t) for t in [-0.5, 1.5): fold to the nearest zero crossing, turn the sign every half turn.
RCS_ALWAYS_INLINE float sine_of_turns(float t)
{
    const float half_turns = std::floor(2.0f * t + 0.5f);
    const float folded = t - 0.5f * half_turns;
    const float sign = 1.0f - 2.0f * std::abs(half_turns - 2.0f * std::floor(0.5f * half_turns));
    return sign * sine_of_quarter_turns(folded);
}

/// The angle of (x, y) from x towards y, in [0, 1]; error below 2e-6. Of (0, 0): 0.
RCS_ALWAYS_INLINE float turns_of(float x, float y)
{
    const float ax = std::abs(x), ay = std::abs(y);
    const float longer = ax > ay ? ax : ay, shorter = ax > ay ? ay : ax;
    const float q = shorter / (longer > 1e-30f ? longer : 1e-30f), q2 = q * q;
    // Minimax for the arc tangent over [0, 1] (Abramowitz and Stegun 1964, 4.4.49).
    const float of_eighth =
        q *
        (1.0f + q2 * (-0.3333314528f +
                      q2 * (0.1999355085f +
                            q2 * (-0.1420889944f +
                                  q2 * (0.1065626393f +
                                        q2 * (-0.0752896400f +
                                              q2 * (0.0429096138f + q2 * (-0.0161657367f + q2 * 0.0028662257f))))))));
    const float eighth = of_eighth * (0.5f / std::numbers::pi_v<float>);
    const float quarter = ay > ax ? 0.25f - eighth : eighth;
    const float half = x < 0.0f ? 0.5f - quarter : quarter;
    return y < 0.0f ? 1.0f - half : half;
}

}  // namespace rcs
