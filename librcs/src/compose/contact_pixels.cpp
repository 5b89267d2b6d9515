#include "compose/contact_pixels.h"

#include <span>

#include "gbuffer/visible_points.h"

namespace rcs {
namespace {

constexpr int kReach = 2;  // [px]
// Sine of the angle at which the other surface rises, at the least.
constexpr float kRises = 0.5f;
// So many footprints a pixel it may be away: what is farther stands in front, and touches nothing.
constexpr float kTouching = 3.0f;
// Of the eight neighbours, so many at the most lie on the surface of a pixel that is alone, bent by no more than this
// (cosine). crytek-sponza, 640 x 360, with 1, 3, 5 of them: 11.5, 11.6, 11.3 % (12.1 without) by 4.4, 5.6, 8.7 million
// rays (3.7).
constexpr int kFew = 3;
constexpr float kHardlyBent = 0.9f;

/// Where the nearest other surface rises [px]; 0, 0: none does.
glm::ivec2 rises_beside(const GBuffer& g, std::size_t i)
{
    const glm::vec3 p = g.position(i), n = g.geometric_normal[i];
    const float far = kTouching * g.footprint[i];
    glm::ivec2 nearest(0);
    for_each_around(g, i, kReach, [&](std::size_t j, int columns, int rows) {
        if (!g.covered(j)) return;
        const glm::vec3 d = g.position(j) - p;
        const float height = glm::dot(d, n), distance2 = glm::dot(d, d);
        const float apart2 = static_cast<float>(columns * columns + rows * rows);
        if (!(height > 0.0f && height * height > kRises * kRises * distance2 && distance2 < far * far * apart2)) return;
        const glm::ivec2 to(columns, rows);
        if (nearest == glm::ivec2(0) || pixels_away(to) < pixels_away(nearest)) nearest = to;
    });
    return nearest;
}

/// @param left_out  1: a pixel whose surface is even, and as those around; empty: none is
bool lies_alone(const GBuffer& g, std::size_t i, std::span<const std::uint8_t> left_out)
{
    int beside = 0;
    for_each_near(g, i, 1, [&](std::size_t j) {
        const bool is_even = !left_out.empty() && left_out[j] != 0;
        beside += is_even ||
                  (j != i && g.covered(j) && lies_beside(g, i, j) && glm::dot(g.normal(i), g.normal(j)) > kHardlyBent);
    });
    return beside <= kFew;
}

}  // namespace

std::vector<PixelAtContact> pixels_at_contacts(const GBuffer& gbuffer, ThreadPool& pool, const FirstContacts* first)
{
    std::vector<glm::ivec2> to(gbuffer.size(), glm::ivec2(0));
    std::vector<std::uint8_t> alone(gbuffer.size(), 0);
    const std::span<const std::uint8_t> left_out = first ? first->left_out : std::span<const std::uint8_t>{};
    if (first)
        for (const PixelAtContact& p : first->pixels) to[p.pixel] = p.to;
    pool.parallel_for(gbuffer.size(), 4096, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t i = begin; i < end; ++i) {
            if (!gbuffer.covered(i)) continue;
            if (!first) to[i] = rises_beside(gbuffer, i);
            alone[i] = to[i] == glm::ivec2(0) && lies_alone(gbuffer, i, left_out);
        }
    });
    std::vector<PixelAtContact> pixels;
    for (std::size_t i = 0; i < to.size(); ++i)
        if (to[i] != glm::ivec2(0) || alone[i] != 0) pixels.push_back({static_cast<std::uint32_t>(i), to[i]});
    return pixels;
}

}  // namespace rcs
