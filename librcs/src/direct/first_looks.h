#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "direct/direct_point.h"
#include "direct/spared_pixels.h"
#include "rcs/gbuffer.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// What first looks at lamps found in a band of rows, and in those below whose sight of lamps it takes to know where to
/// look again: second looks go on from there.
class FirstLooks {
public:
    /// @param kept  whether there are second looks
    FirstLooks(const GBuffer& g, bool kept)
        : width_(static_cast<std::size_t>(g.width)),
          height_(static_cast<std::size_t>(g.height)),
          band_(kept ? std::max<std::size_t>(1, kPixels / std::max<std::size_t>(1, width_)) : height_),
          looks_(kept ? std::min(height_, band_ + SparedPixels::kReach) * width_ : 0)
    {
    }

    /// Of a pixel that is now looked at for the first time; null: it is not kept.
    FirstLook* begin(std::size_t pixel)
    {
        if (looks_.empty()) return nullptr;
        FirstLook& look = looks_[pixel % looks_.size()];
        look.is_over = false;
        return &look;
    }
    FirstLook* of(std::size_t pixel) { return &looks_[pixel % looks_.size()]; }

    /// Calls first(pixel, thread) for all pixels, and where looks are kept second(pixel, thread) as soon as those
    /// around are through with the first.
    template <typename First, typename Second>
    void each_twice(ThreadPool& pool, const First& first, const Second& second)
    {
        const auto each = [&](std::size_t from, std::size_t to, const auto& visit) {
            pool.parallel_for(to - from, 128, [&](std::size_t begin, std::size_t end, int thread) {
                for (std::size_t i = from + begin; i < from + end; ++i) visit(i, thread);
            });
        };
        std::size_t looked = 0;
        for (std::size_t row = 0; row < height_; row += band_) {
            const std::size_t last = std::min(row + band_, height_);
            const std::size_t needed = std::min(last + SparedPixels::kReach, height_);
            each(looked * width_, needed * width_, first);
            looked = needed;
            if (!looks_.empty()) each(row * width_, last * width_, second);
        }
    }

private:
    static constexpr std::size_t kPixels = 4096;  // of a band, about: they stay near at hand

    std::size_t width_, height_, band_;
    std::vector<FirstLook> looks_;  // a ring
};

}  // namespace rcs
