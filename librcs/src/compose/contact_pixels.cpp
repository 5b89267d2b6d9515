#include "compose/contact_pixels.h"

#include <algorithm>
#include <cstdlib>
#include <span>
#include <vector>

#include "gbuffer/visible_points.h"
#include "util/multiversion.h"

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

/// Pixels side by side, from one of them on.
struct PixelRow {
    const float *x, *y, *z;  // positions
    const std::uint32_t* instance;

    PixelRow(const GBuffer& g, std::size_t first)
        : x(&g.position_x[first]), y(&g.position_y[first]), z(&g.position_z[first]), instance(&g.instance[first])
    {
    }
};

/// Geometric normals of a row of the image, and how far away another surface is that touches it, in planes.
struct RowSurfaces {
    std::vector<float> x, y, z;
    std::vector<float> far2;  // [m^2], of what is one pixel away

    RowSurfaces(const GBuffer& g, std::size_t row) : x(static_cast<std::size_t>(g.width)), y(x), z(x), far2(x)
    {
        for (std::size_t k = 0; k < x.size(); ++k) {
            const std::size_t i = row * x.size() + k;
            const glm::vec3 n = g.geometric_normal[i];
            x[k] = n.x, y[k] = n.y, z[k] = n.z;
            const float far = kTouching * g.footprint[i];
            far2[k] = far * far;
        }
    }
};

/// Marks pixels of a row where those to one side of them, sqrt(apart2) pixels away, are of a surface that rises.
/// @param first  of the row's surfaces, that own[0] is
RCS_MULTIVERSION
void mark_rising(const PixelRow& own, const PixelRow& other, const RowSurfaces& surfaces, std::size_t first,
                 float apart2, std::span<int> rises)
{
    const float *const nx = surfaces.x.data() + first, *const ny = surfaces.y.data() + first,
                       *const nz = surfaces.z.data() + first, *const far2 = surfaces.far2.data() + first;
    int* const out = rises.data();
    const std::size_t count = rises.size();
    RCS_INDEPENDENT_LOOP
    for (std::size_t k = 0; k < count; ++k) {
        const float dx = other.x[k] - own.x[k], dy = other.y[k] - own.y[k], dz = other.z[k] - own.z[k];
        const float height = dx * nx[k] + dy * ny[k] + dz * nz[k], distance2 = dx * dx + dy * dy + dz * dz;
        const bool is_near = distance2 < far2[k] * apart2;
        const bool is_steep = height * height > kRises * kRises * distance2;
        out[k] |= static_cast<int>(height > 0.0f) & static_cast<int>(is_steep) & static_cast<int>(is_near) &
                  static_cast<int>(other.instance[k] != GBuffer::kNone);
    }
}

/// Steps within reach, the nearest first, and those as near row by row.
std::vector<glm::ivec2> steps_around()
{
    std::vector<glm::ivec2> steps;
    for (int away = 1; away <= kReach; ++away)
        for (int row = -away; row <= away; ++row)
            for (int column = -away; column <= away; ++column)
                if (pixels_away({column, row}) == away) steps.emplace_back(column, row);
    return steps;
}

/// Where the nearest other surface rises beside the pixels of a row [px]; 0, 0: none does.
void find_rising(const GBuffer& g, int row, std::span<const glm::ivec2> steps, glm::ivec2* nearest)
{
    const auto width = static_cast<std::size_t>(g.width);
    const std::size_t begin = static_cast<std::size_t>(row) * width;
    const RowSurfaces surfaces(g, static_cast<std::size_t>(row));
    std::vector<int> rises(width);
    for (const glm::ivec2 step : steps) {
        if (row + step.y < 0 || row + step.y >= g.height || std::abs(step.x) >= g.width) continue;
        const auto first = static_cast<std::size_t>(std::max(0, -step.x));
        const auto count = static_cast<std::size_t>(g.width - std::abs(step.x));
        const auto other = static_cast<std::size_t>((row + step.y) * g.width + static_cast<int>(first) + step.x);
        std::fill(rises.begin(), rises.end(), 0);
        mark_rising(PixelRow(g, begin + first), PixelRow(g, other), surfaces, first,
                    static_cast<float>(step.x * step.x + step.y * step.y), std::span(rises).subspan(first, count));
        for (std::size_t k = first; k < first + count; ++k)
            if (rises[k] != 0 && nearest[k] == glm::ivec2(0)) nearest[k] = step;
    }
    for (std::size_t k = 0; k < width; ++k)
        if (!g.covered(begin + k)) nearest[k] = glm::ivec2(0);
}

/// @param left_out  1: a pixel whose surface is even, and as those around; empty: none is
bool lies_alone(const GBuffer& g, std::size_t i, std::span<const std::uint8_t> left_out)
{
    int beside = 0;
    for_each_near(g, i, 1, [&](std::size_t j) {
        if (beside > kFew) return;
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
    const std::vector<glm::ivec2> steps = steps_around();
    pool.parallel_for(static_cast<std::size_t>(gbuffer.height), 4, [&](std::size_t begin, std::size_t end, int) {
        const auto width = static_cast<std::size_t>(gbuffer.width);
        for (std::size_t row = begin; row < end && !first; ++row)
            find_rising(gbuffer, static_cast<int>(row), steps, &to[row * width]);
        for (std::size_t i = begin * width; i < end * width; ++i)
            alone[i] = gbuffer.covered(i) && to[i] == glm::ivec2(0) && lies_alone(gbuffer, i, left_out);
    });
    std::vector<PixelAtContact> pixels;
    for (std::size_t i = 0; i < to.size(); ++i)
        if (to[i] != glm::ivec2(0) || alone[i] != 0) pixels.push_back({static_cast<std::uint32_t>(i), to[i]});
    return pixels;
}

}  // namespace rcs
