#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/rcs.h"

namespace rcs {
namespace {

struct Stage {
    Session session;
    explicit Stage(const char* name, int threads = 2) : session({.threads = threads})
    {
        session.show(load_scene(name));
    }

    RenderResult render(const RenderOptions& options, const RenderHooks& hooks = {})
    {
        return rcs::render(session, session.scene().cameras[0], options, hooks);
    }
    RenderStats forecast(const RenderOptions& options)
    {
        return rcs::forecast(session, session.scene().cameras[0], options);
    }
};

RenderOptions small(Quality quality, int aa = 1)
{
    RenderOptions options;
    options.width = options.height = 120;
    options.aa = aa;
    options.quality = quality;
    return options;
}

/// More time, less error: whatever is asked for, a smaller error takes more rays and leaves less.
TEST(TargetError, IsReachedBySpendingMoreOnSmallerOnes)
{
    for (const char* scene : {"demo:cornell", "demo:atrium", "demo:sphere-light"}) {
        Stage stage(scene);
        std::uint64_t rays = 0;
        double error = 1.0;
        for (const double target : {0.15, 0.07, 0.05, 0.04, 0.03}) {
            const RenderStats stats = stage.render(small(TargetError{target})).stats;
            // Records reach it; what pixels at contacts add is known afterwards.
            EXPECT_LE(stats.errors.indirect.mean_relative, 1.05 * target) << scene;
            EXPECT_LE(stats.errors.indirect.mean_relative, error) << scene << ' ' << target;
            EXPECT_GE(stats.records.hemisphere_rays, rays) << scene << ' ' << target;
            EXPECT_EQ(stats.unserved_pixels, 0u);
            rays = stats.records.hemisphere_rays;
            error = stats.errors.indirect.mean_relative;
        }
    }
}

TEST(TargetError, CountsReflectionsThatAreTraced)
{
    Stage stage("demo:spheres");
    const RenderStats loose = stage.render(small(TargetError{0.3})).stats;
    const RenderStats tight = stage.render(small(TargetError{0.012})).stats;
    EXPECT_LE(tight.errors.indirect.mean_relative, 0.012 * 1.1);
    EXPECT_GT(tight.traced.rays, loose.traced.rays);
}

/// An error is one of what is seen, however many pixels that has.
TEST(TargetError, TakesFewMoreRecordsForALargerPicture)
{
    Stage stage("demo:atrium");
    const auto records = [&](int side) {
        RenderOptions options = small(TargetError{0.1});
        options.width = options.height = side;
        return stage.render(options).stats.records.records;
    };
    EXPECT_LT(records(2000), 1.8 * static_cast<double>(records(1000)));
}

TEST(TargetError, GivesTheSameBitsForAnyNumberOfThreads)
{
    const auto beauty = [](int threads) {
        Stage stage("demo:cornell", threads);
        return stage.render(small(TargetError{0.06}, 2)).image.layers.at("beauty").pixels;
    };
    const std::vector<float> one = beauty(1), three = beauty(3);
    ASSERT_EQ(one.size(), three.size());
    EXPECT_EQ(std::memcmp(one.data(), three.data(), one.size() * sizeof(float)), 0);
}

TEST(TargetError, ThatIsOutOfReachIsSaid)
{
    Stage stage("demo:cornell");
    RenderOptions options = small(TargetError{0.001});
    options.width = options.height = 24;
    std::vector<std::string> warnings;
    const RenderResult result = stage.render(options, {.log = [&](LogLevel level, std::string_view text) {
                                                 if (level == LogLevel::warning) warnings.emplace_back(text);
                                             }});
    ASSERT_GT(result.stats.errors.indirect.mean_relative, 0.002);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("not the 0.1 % wanted"), std::string::npos) << warnings[0];
}

TEST(TargetError, MetadataTellsWhatItChose)
{
    Stage stage("demo:cornell");
    const RenderOptions options = small(TargetError{0.1});
    const RenderResult result = stage.render(options);
    EXPECT_NE(result.image.metadata.at("rcs:accuracy"), number_text(QualitySettings{}.error_tolerance));
    EXPECT_EQ(result.image.metadata.at("rcs:target-error"), "0.1");
}

TEST(Forecast, IsToldOnceAndGrowsTowardsSmallErrors)
{
    Stage stage("demo:cornell");
    int told = 0;
    const RenderResult result = stage.render(small(TargetError{0.05}), {.forecast = [&](const Forecast& f) {
                                                 ++told;
                                                 ASSERT_GE(f.points.size(), 4u);
                                                 for (std::size_t i = 1; i < f.points.size(); ++i) {
                                                     EXPECT_LT(f.points[i].error, f.points[i - 1].error);
                                                     EXPECT_GE(f.points[i].seconds, f.points[i - 1].seconds);
                                                 }
                                                 EXPECT_GT(f.points.back().seconds, f.points.front().seconds);
                                                 EXPECT_EQ(f.goal_error, 0.05);
                                                 EXPECT_GT(f.goal_seconds, 0.0);
                                             }});
    EXPECT_EQ(told, 1);
    EXPECT_EQ(result.stats.forecast.points.size(), 6u);
}

TEST(Forecast, StopsBeforeTheMainWork)
{
    Stage stage("demo:cornell");
    const RenderOptions options = small(TargetError{0.01});
    const RenderStats stats = stage.forecast(options);
    EXPECT_FALSE(stats.forecast.points.empty());
    EXPECT_LT(10 * stats.records.hemisphere_rays, stage.render(options).stats.records.hemisphere_rays);
}

TEST(Forecast, HasNothingToTellWithoutIndirectLight)
{
    Stage stage("demo:cornell");
    RenderOptions options = small(TargetError{0.05});
    options.bounces = 0;
    const RenderStats stats = stage.forecast(options);
    EXPECT_TRUE(stats.forecast.points.empty());
    EXPECT_EQ(stats.counts.gbuffers, 0u);
}

TEST(Budget, TakesFewerPassesWhereTimeIsShortAndAimsLowerWhereItIsNot)
{
    Stage stage("demo:cornell");
    const Forecast brief = stage.forecast(small(Budget{0.01}, 16)).forecast;
    const Forecast lengthy = stage.forecast(small(Budget{1000.0}, 16)).forecast;
    EXPECT_EQ(brief.passes, 1);
    EXPECT_EQ(lengthy.passes, 16);
    EXPECT_LT(lengthy.goal_error, brief.goal_error);
}

TEST(Budget, ThatIsShortGetsACoarsePictureOfAllPixels)
{
    Stage stage("demo:cornell");
    RenderOptions options = small(TargetError{0.3}, 1);
    const RenderStats lengthy = stage.render(options).stats;
    options.quality = Budget{0.01};
    const RenderStats brief = stage.render(options).stats;
    EXPECT_LT(brief.records.records, lengthy.records.records / 2);
    EXPECT_LT(brief.direct_shadow_rays, lengthy.direct_shadow_rays / 2);
    EXPECT_EQ(brief.unserved_pixels, 0u);
}

TEST(ValidateRenderOptions, NamesTargetsAndBudgetsOutOfRange)
{
    const auto message = [](RenderOptions options) -> std::string {
        try {
            validate(options);
        } catch (const Error& e) {
            EXPECT_EQ(e.code(), ErrorCode::bad_argument);
            return e.what();
        }
        return "";
    };
    RenderOptions options;
    options.quality = TargetError{1.5};
    EXPECT_NE(message(options).find("target_error is 1.5"), std::string::npos);
    options = {};
    options.quality = Budget{-1.0};
    EXPECT_NE(message(options).find("budget_seconds is -1"), std::string::npos);
}

}  // namespace
}  // namespace rcs
