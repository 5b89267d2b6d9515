#pragma once

#include <array>
#include <cmath>
#include <numbers>

#include "util/multiversion.h"

namespace rcs {

/// Real spherical harmonics up to band 5, orthonormal; coefficient (l, m) is number l (l + 1) + m.
inline constexpr int kBands = 6;
inline constexpr int kHarmonics = kBands * kBands;
/// Directions that are evaluated together.
inline constexpr int kHarmonicLanes = 16;

using HarmonicLanes = float[kHarmonics][kHarmonicLanes];

namespace detail {

/// Factors of the recurrences over normalised associated Legendre functions (without sin^m).
struct HarmonicFactors {
    float start[kBands];      // P(m, m)
    float a[kBands][kBands];  // P(l, m) = a z P(l-1, m) - b P(l-2, m)
    float b[kBands][kBands];
};

inline HarmonicFactors make_harmonic_factors()
{
    HarmonicFactors f{};
    double diagonal = std::sqrt(1.0 / (4.0 * std::numbers::pi));
    for (int m = 0; m < kBands; ++m) {
        if (m > 0) diagonal *= std::sqrt((2.0 * m + 1.0) / (2.0 * m));
        // The pair of cos(m phi) and sin(m phi) shares the factor sqrt(2).
        f.start[m] = static_cast<float>(m == 0 ? diagonal : diagonal * std::numbers::sqrt2);
        for (int l = m + 1; l < kBands; ++l) {
            const auto a = [m](int n) { return std::sqrt((4.0 * n * n - 1.0) / (n * n - m * m)); };
            f.a[l][m] = static_cast<float>(a(l));
            f.b[l][m] = l == m + 1 ? 0.0f : static_cast<float>(a(l) / a(l - 1));
        }
    }
    return f;
}

inline const HarmonicFactors& harmonic_factors()
{
    static const HarmonicFactors factors = make_harmonic_factors();
    return factors;
}

}  // namespace detail

/// All harmonics in 16 unit directions.
RCS_ALWAYS_INLINE void evaluate_harmonics(const detail::HarmonicFactors& f, const float* x, const float* y,
                                          const float* z, HarmonicLanes& out)
{
    float c[kHarmonicLanes], s[kHarmonicLanes];  // sin(theta)^m cos(m phi), sin(theta)^m sin(m phi)
    for (int i = 0; i < kHarmonicLanes; ++i) {
        c[i] = 1.0f;
        s[i] = 0.0f;
    }
    for (int m = 0; m < kBands; ++m) {
        float previous[kHarmonicLanes], last[kHarmonicLanes];
        for (int i = 0; i < kHarmonicLanes; ++i) {
            previous[i] = 0.0f;
            last[i] = f.start[m];
        }
        for (int l = m; l < kBands; ++l) {
            float* cosine = out[l * (l + 1) + m];
            float* sine = out[l * (l + 1) - m];
            const float a = l > m ? f.a[l][m] : 0.0f, b = f.b[l][m];
            for (int i = 0; i < kHarmonicLanes; ++i) {
                const float p = l > m ? a * z[i] * last[i] - b * previous[i] : last[i];
                previous[i] = l > m ? last[i] : previous[i];
                last[i] = p;
                if (m > 0) sine[i] = p * s[i];
                cosine[i] = p * c[i];
            }
        }
        for (int i = 0; i < kHarmonicLanes; ++i) {
            const float next = c[i] * x[i] - s[i] * y[i];
            s[i] = s[i] * x[i] + c[i] * y[i];
            c[i] = next;
        }
    }
}

}  // namespace rcs
