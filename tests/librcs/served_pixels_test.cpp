#include "placement/served_pixels.h"

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "support/splat_wall.h"

namespace rcs {
namespace {

class Served : public test::SplatWall {
protected:
    TiledSurfaces surfaces = make_tiled_surfaces(gbuffer, pool);

    void SetUp() override
    {
        for (Record& r : records) r.spacing_radius *= 0.5f;  // so that some pixels are served by none
    }

    std::vector<char> anew(std::span<const Record> of)
    {
        std::vector<float> weight(gbuffer.size(), 0.0f);
        add_weights(of, surfaces, view, {options.error_tolerance, 1.0f}, pool, weight);
        return is_served(weight);
    }

    static std::vector<char> is_served(const std::vector<float>& weight)
    {
        std::vector<char> served;
        for (const float w : weight) served.push_back(w > 0.0f ? 1 : 0);
        return served;
    }

    static std::ptrdiff_t count(const std::vector<char>& served) { return std::count(served.begin(), served.end(), 1); }
};

TEST_F(Served, AreThoseOfAllRecordsAsTheyReachNow)
{
    ServedPixels served(surfaces, view, options.error_tolerance, pool);
    const std::size_t half = records.size() / 2;
    served.add(std::span(std::as_const(records)).first(half));
    std::vector<char> before = is_served(served.weight());
    EXPECT_EQ(before, anew(std::span(std::as_const(records)).first(half)));
    served.add(records);
    EXPECT_EQ(is_served(served.weight()), anew(records));
    EXPECT_GT(count(is_served(served.weight())), count(before));

    // Some reach less far, some farther, and others not at all any more.
    before = is_served(served.weight());
    for (std::size_t k = 0; k < records.size(); k += 7)
        records[k].spacing_radius *= k % 3 == 0 ? 0.4f : k % 3 == 1 ? 1.6f : 0.0f;
    served.follow(records);
    EXPECT_EQ(is_served(served.weight()), anew(records));
    const std::vector<char> after = is_served(served.weight());
    std::size_t gone = 0, come = 0;
    for (std::size_t i = 0; i < before.size(); ++i) {
        gone += before[i] > after[i] ? 1u : 0u;
        come += before[i] < after[i] ? 1u : 0u;
    }
    EXPECT_GT(gone, 100u);
    EXPECT_GT(come, 100u);
}

TEST_F(Served, AreLeftAloneWhereNothingHasChanged)
{
    ServedPixels served(surfaces, view, options.error_tolerance, pool);
    served.add(records);
    const std::vector<float> before = served.weight();
    served.follow(records);
    EXPECT_EQ(served.weight(), before);
    // One that is out of the picture is served nowhere, and harms nothing.
    records.push_back(records[0]);
    records.back().position.z += 10.0f;
    served.add(records);
    EXPECT_EQ(served.weight(), before);
}

}  // namespace
}  // namespace rcs
