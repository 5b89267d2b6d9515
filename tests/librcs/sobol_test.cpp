#include "reference/sobol.h"

#include <cmath>
#include <numbers>
#include <set>
#include <vector>

#include <gtest/gtest.h>

namespace rcs {
namespace {

/// Whether n = 2^m points leave exactly one in each of the elementary intervals of every shape.
bool is_net(const std::vector<glm::vec2>& points, int m)
{
    for (int x_bits = 0; x_bits <= m; ++x_bits) {
        const int y_bits = m - x_bits;
        std::set<int> cells;
        for (const glm::vec2 p : points) {
            const int x = static_cast<int>(std::ldexp(p.x, x_bits));
            const int y = static_cast<int>(std::ldexp(p.y, y_bits));
            cells.insert((y << x_bits) | x);
        }
        if (cells.size() != points.size()) return false;
    }
    return true;
}

TEST(SobolPair, EveryAlignedBlockOfAPowerOfTwoIsANet)
{
    for (const std::uint64_t key : {0ull, 1ull, 0x123456789abcdefull}) {
        for (const int m : {1, 2, 4, 6, 8, 10}) {
            for (std::uint32_t block = 0; block < 8; ++block) {
                std::vector<glm::vec2> points;
                for (std::uint32_t i = 0; i < (1u << m); ++i) points.push_back(sobol_pair((block << m) + i, key));
                EXPECT_TRUE(is_net(points, m)) << "m " << m << ", block " << block << ", key " << key;
            }
        }
    }
}

TEST(SobolPair, SecondDimensionIsPascalsTriangleModuloTwo)
{
    const auto binomial_is_odd = [](std::uint32_t n, std::uint32_t k) { return (n & k) == k; };  // Lucas
    for (const std::uint32_t index : {0u, 1u, 2u, 3u, 77u, 0x80000001u, 0xdeadbeefu, 0xffffffffu}) {
        std::uint32_t expected = 0;  // digit 2^-(row + 1) in bit `row`
        for (std::uint32_t row = 0; row < 32; ++row) {
            std::uint32_t digit = 0;
            for (std::uint32_t column = row; column < 32; ++column)
                if (binomial_is_odd(column, row)) digit ^= index >> column & 1u;
            expected |= digit << row;
        }
        EXPECT_EQ(reversed_second_dimension(index), expected) << index;
    }
}

TEST(OwenScramble, LetsADigitDependOnlyOnTheDigitsBeforeIt)
{
    for (std::uint32_t seed = 0; seed < 50; ++seed) {
        const auto x = static_cast<std::uint32_t>(mix64(seed));
        for (int digit = 0; digit < 32; ++digit) {
            const std::uint32_t flipped = x ^ (0x80000000u >> digit);
            const std::uint32_t difference = owen_scramble(x, seed) ^ owen_scramble(flipped, seed);
            EXPECT_EQ(difference >> (31 - digit), 1u) << "digit " << digit << " itself must flip, none before it";
        }
    }
}

TEST(SobolPair, EachPointIsUniformOverTheKeys)
{
    // Mean of n uniform numbers: 1/2 with standard error sqrt(1/(12 n)); 5 of those. Second moment 1/3
    // with sqrt(4/(45 n)); products of independent ones 1/4 with sqrt(7/(144 n)).
    const int n = 1 << 16;
    for (const std::uint32_t index : {0u, 1u, 5u, 1000u}) {
        double x = 0, y = 0, xx = 0, yy = 0, xy = 0;
        for (int key = 0; key < n; ++key) {
            const glm::dvec2 p(sobol_pair(index, static_cast<std::uint64_t>(key)));
            x += p.x, y += p.y, xx += p.x * p.x, yy += p.y * p.y, xy += p.x * p.y;
        }
        EXPECT_NEAR(x / n, 0.5, 5 * std::sqrt(1.0 / 12 / n));
        EXPECT_NEAR(y / n, 0.5, 5 * std::sqrt(1.0 / 12 / n));
        EXPECT_NEAR(xx / n, 1.0 / 3, 5 * std::sqrt(4.0 / 45 / n));
        EXPECT_NEAR(yy / n, 1.0 / 3, 5 * std::sqrt(4.0 / 45 / n));
        EXPECT_NEAR(xy / n, 0.25, 5 * std::sqrt(7.0 / 144 / n));
    }
}

TEST(SobolPair, PadsToMoreDimensionsWithoutCorrelation)
{
    // 4D integrand: the product of (2 u - 1) of two padded pairs has mean 0, variance 1/81 per point.
    // Where the order of the second pair were not shuffled, the mean would stay far from 0.
    const int n = 1 << 14;
    double sum = 0;
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(n); ++i) {
        const glm::dvec2 a = 2.0 * glm::dvec2(sobol_pair(i, 11)) - 1.0;
        const glm::dvec2 b = 2.0 * glm::dvec2(sobol_pair(i, 12)) - 1.0;
        sum += a.x * a.y * b.x * b.y;
    }
    EXPECT_NEAR(sum / n, 0.0, 5 * std::sqrt(1.0 / 81 / n));
}

TEST(SobolPair, IntegratesASmoothFunctionFarBetterThanRandomPoints)
{
    // Error of scrambled nets falls as n^-1.5 for smooth integrands; random points would leave 0.4 % of the
    // mean at n = 4096.
    const int n = 4096;
    double worst = 0;
    for (std::uint64_t key = 0; key < 20; ++key) {
        double sum = 0;
        for (std::uint32_t i = 0; i < n; ++i) {
            const glm::dvec2 p(sobol_pair(i, key));
            sum += std::sin(std::numbers::pi * p.x) * std::exp(p.y);
        }
        const double exact = 2.0 / std::numbers::pi * (std::numbers::e - 1.0);
        worst = std::max(worst, std::abs(sum / n / exact - 1.0));
    }
    EXPECT_LT(worst, 1e-4);
}

}  // namespace
}  // namespace rcs
