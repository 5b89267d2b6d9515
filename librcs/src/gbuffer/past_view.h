#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "gbuffer/shading.h"
#include "rcs/camera.h"
#include "rcs/gbuffer.h"
#include "rcs/thread_pool.h"
#include "scene/camera_rays.h"
#include "util/random.h"

namespace rcs {

/// What an earlier view's pixels saw.
struct PastPoints {
    View view;
    glm::dvec3 camera_position{0.0};      ///< scene space [m]
    std::vector<glm::vec3> position;      ///< per pixel, relative to that [m]
    std::vector<glm::vec3> normal;        ///< of the shading normal, unit
    std::vector<std::uint32_t> instance;  ///< GBuffer::kNone where nothing is seen
};
PastPoints points_of(const GBuffer& gbuffer, const View& view);

/// Between which four pixels of an earlier view a point lies.
struct PastPlace {
    std::uint32_t first = GBuffer::kNone;  ///< the one at the top left; kNone: it was not seen
    float x = 0.0f, y = 0.0f;              ///< from there, in [0, 1) [px]
    float turn = 0.0f;  ///< of the viewer about the point since then, over the width of the surface's narrowest lobe
    std::array<std::uint8_t, 4> taken = {0, 1, 2, 3};  ///< of the four, row by row, which stands for each
    bool is_whole = true;                              ///< none stands for another: each saw the surface

    bool is_seen() const { return first != GBuffer::kNone; }
};

/// Where an earlier view of the same scene saw the points of this one, and its values there.
class PastPlaces {
public:
    /// @param past  has to outlive this   @param shading  of `gbuffer`
    PastPlaces(const PastPoints& past, const GBuffer& gbuffer, const View& view, const Shading& shading,
               ThreadPool& pool);

    const PastPlace& operator[](std::size_t pixel) const { return places_[pixel]; }
    const PastPoints& points() const { return past_; }
    /// Where a point shows in the earlier view, whatever was seen there. @param point  relative to that view's camera
    PastPlace project(glm::dvec3 point) const;

    /// The four pixels around the point, where it was seen in part those that saw it in place of the others; it has to
    /// be seen.
    std::array<std::size_t, 4> around(const PastPlace& p) const
    {
        const std::array<std::size_t, 4> all = {p.first, p.first + 1, p.first + width_, p.first + width_ + 1};
        return {all[p.taken[0]], all[p.taken[1]], all[p.taken[2]], all[p.taken[3]]};
    }
    std::array<std::size_t, 4> around(std::size_t pixel) const { return around(places_[pixel]); }
    template <typename T>
    T mean(const std::vector<T>& values, std::size_t pixel) const
    {
        return mean(values, places_[pixel]);
    }
    template <typename T>
    T mean(const std::vector<T>& values, const PastPlace& p) const
    {
        return mean([&](std::size_t j) { return values[j]; }, p);
    }
    /// @param value  of a pixel of the earlier view
    template <typename Value>
        requires std::invocable<Value, std::size_t>
    auto mean(const Value& value, const PastPlace& p) const
    {
        const std::array<std::size_t, 4> at = around(p);
        return (1.0f - p.y) * ((1.0f - p.x) * value(at[0]) + p.x * value(at[1])) +
               p.y * ((1.0f - p.x) * value(at[2]) + p.x * value(at[3]));
    }
    /// Views over which light stays about the same of which so large a part comes by lobes: 1, 2, 4, 8 or 16; no more
    /// than 4 where the point was seen in part. What is reflected evenly stays in any case.
    int views(std::size_t pixel, float part_of_lobes) const;
    /// One of the four, drawn in proportion to its part of the mean: what is handed on so from view to view stays where
    /// it was on the surface, in the mean. @param bits  random, two numbers of 32 bits
    std::size_t drawn(std::size_t pixel, std::uint64_t bits) const
    {
        const PastPlace& p = places_[pixel];
        const float x = to_unit_float(static_cast<std::uint32_t>(bits)),
                    y = to_unit_float(static_cast<std::uint32_t>(bits >> 32));
        return around(pixel)[(x < p.x ? 1u : 0u) + (y < p.y ? 2u : 0u)];
    }
    std::size_t nearest(std::size_t pixel) const
    {
        const PastPlace& p = places_[pixel];
        return around(pixel)[(p.x > 0.5f ? 1u : 0u) + (p.y > 0.5f ? 2u : 0u)];
    }

private:
    bool fits(const GBuffer& g, std::size_t pixel, glm::vec3 point) const;
    bool fits_in_part(const GBuffer& g, std::size_t pixel, glm::vec3 point, PastPlace& place) const;

    const PastPoints& past_;
    ImageProjection projection_;  // of the earlier view
    std::vector<PastPlace> places_;
    std::size_t width_;  // of the earlier view [px]
    float coarser_;      // its pixels over this one's, at the same distance
};

/// Whether light changes so little from one of four pixels to the next that the mean of them is the light in between,
/// as far as anyone knows.
/// @param light  of the four   @param error  standard error of the luminance of each
/// @param beside  what there is to see that may be off by some of it, > 0
bool is_even(const std::array<glm::vec3, 4>& light, float error, float beside);
/// The same of light without noise, which is not to become worse: it changes as it would on a plane.
bool is_exactly_even(const std::array<glm::vec3, 4>& light, float beside);

/// How much of a new estimate goes into what was known, and what variance that leaves, over that of one view's samples.
struct PastMix {
    float weight, variance;
};
/// @param past, now  variances   @param least  weight of the new one: so soon it follows what changes with the view
PastMix mix_of(float past, float now, float least);

}  // namespace rcs
