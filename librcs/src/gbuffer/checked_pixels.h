#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "rcs/gbuffer.h"
#include "util/random.h"

namespace rcs {

/// A picture is parted in squares of so many pixels a side, and in each, light is sampled again at one pixel [px].
inline constexpr int kCheckedSide = 8;

inline int checked_squares(int pixels) { return (pixels + kCheckedSide - 1) / kCheckedSide; }

/// Which pixels those are: one in each square, by chance.
class CheckedPixels {
public:
    static constexpr std::uint32_t kNone = GBuffer::kNone;

    CheckedPixels(int width, int height, std::uint64_t seed)
        : width_(width), height_(height), columns_(checked_squares(width)), seed_(seed)
    {
    }
    std::size_t squares() const
    {
        return static_cast<std::size_t>(columns_) * static_cast<std::size_t>(checked_squares(height_));
    }
    std::size_t square_of(std::size_t pixel) const
    {
        const auto width = static_cast<std::size_t>(width_), side = static_cast<std::size_t>(kCheckedSide);
        return pixel / width / side * static_cast<std::size_t>(columns_) + pixel % width / side;
    }
    /// Of a square; none where chance has it beyond the edge of the picture.
    std::uint32_t pixel(std::size_t square) const
    {
        const int x = static_cast<int>(square % static_cast<std::size_t>(columns_));
        const int y = static_cast<int>(square / static_cast<std::size_t>(columns_));
        const auto name = static_cast<std::uint64_t>(y) << 32 | static_cast<std::uint64_t>(x);
        const std::uint64_t key = stream_key(seed_, Stream::direct_error, name);
        const int px = x * kCheckedSide + static_cast<int>(key % kCheckedSide);
        const int py = y * kCheckedSide + static_cast<int>((key >> 32) % kCheckedSide);
        if (px >= width_ || py >= height_) return kNone;
        return static_cast<std::uint32_t>(py) * static_cast<std::uint32_t>(width_) + static_cast<std::uint32_t>(px);
    }

private:
    int width_, height_, columns_;
    std::uint64_t seed_;
};

}  // namespace rcs
