// Glances by the records that are there, and what a picture that is called off leaves behind.
#include <cmath>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "rcs/rcs.h"

namespace rcs {
namespace {

RenderOptions options_to(double error, int side = 64)
{
    RenderOptions options;
    options.width = options.height = side;
    options.aa = 1;
    options.quality = TargetError{error};
    return options;
}

Session cornell()
{
    Session session({.keep_records = true});
    session.show(load_scene("demo:cornell"));
    return session;
}

Camera camera_of(const Session& session) { return choose_camera(session.scene(), {}); }

double mean_difference(const Image& a, const Image& b)
{
    double sum = 0.0, all = 0.0;
    for (std::size_t i = 0; i < a.pixels.size(); ++i) {
        sum += static_cast<double>(std::abs(a.pixels[i] - b.pixels[i]));
        all += static_cast<double>(b.pixels[i]);
    }
    return sum / all;
}

TEST(Glance, ShowsTheRecordsThatAreThere)
{
    Session session = cornell();
    const Camera camera = camera_of(session);
    const RenderOptions options = options_to(0.05);
    const RenderResult rendered = render(session, camera, options);
    const std::size_t records = session.records().size();
    const RenderResult seen = glance(session, camera, options);
    EXPECT_EQ(seen.stats.records.records, 0u);
    EXPECT_EQ(session.records().size(), records);
    EXPECT_EQ(seen.stats.unserved_pixels, 0u);
    EXPECT_LT(mean_difference(seen.image.layers.at("indirect"), rendered.image.layers.at("indirect")), 0.02);
}

TEST(Glance, FillsWhatNoRecordReachesAndCountsIt)
{
    Session session = cornell();
    const Camera camera = camera_of(session);
    const RenderOptions options = options_to(0.05, 160);
    const RenderResult seen = glance(session, camera, options, {.gather_seconds = 1e-6});
    EXPECT_GT(seen.stats.records.records, 0u);
    EXPECT_GT(seen.stats.unserved_pixels, 0u) << "there was hardly time";
    EXPECT_EQ(session.records().size(), seen.stats.records.records);
    const Image& irradiance = seen.image.layers.at("irradiance");
    const Image& depth = seen.image.layers.at("depth");
    std::size_t dark = 0;
    for (std::size_t i = 0; i < depth.pixels.size(); ++i)
        if (std::isfinite(depth.pixels[i]) && !(irradiance.pixels[3 * i] > 0.0f)) ++dark;
    EXPECT_EQ(dark, 0u);
    const RenderResult later = glance(session, camera, options, {.gather_seconds = 5.0});
    EXPECT_LT(later.stats.unserved_pixels, seen.stats.unserved_pixels / 4);
    EXPECT_LT(later.stats.errors.indirect.mean_relative, seen.stats.errors.indirect.mean_relative);
}

TEST(Glance, GathersNothingForBouncesOfAnotherView)
{
    Session session = cornell();
    Camera camera = camera_of(session);
    RenderOptions options = options_to(0.2);
    options.bounces = 3;
    render(session, camera, options);
    EXPECT_EQ(glance(session, camera, options).stats.unserved_pixels, 0u);
    camera.world_from_view[3].x += 1.0;
    EXPECT_EQ(glance(session, camera, options).stats.records.records, 0u);
}

TEST(Glance, RecordsInAnotherViewAreRefinedToTheTarget)
{
    Session session = cornell();
    const Camera camera = camera_of(session);
    const RenderOptions options = options_to(0.03);
    glance(session, camera, options, {.gather_seconds = 5.0});
    const std::size_t coarse = session.records().size();
    const RenderResult result = render(session, camera, options);
    EXPECT_GT(result.stats.records.refined, coarse / 4) << "those of the glance as well";
    EXPECT_LE(result.stats.errors.image.mean_relative, 1.05 * 0.03);
    EXPECT_LE(result.stats.errors.indirect.mean_relative, 1.05 * 0.03);
}

TEST(Glance, StopsWhenToldTo)
{
    Session session = cornell();
    const Camera camera = camera_of(session);
    const RenderOptions options = options_to(0.1);
    render(session, camera, options);
    const std::size_t records = session.records().size();
    EXPECT_THROW(glance(session, camera, options, {}, [](std::string_view stage, float) { return stage != "splat"; }),
                 Error);
    EXPECT_EQ(session.records().size(), records);
}

TEST(CalledOff, RecordsStay)
{
    Session session = cornell();
    const Camera camera = camera_of(session);
    const RenderOptions options = options_to(0.02);
    const RenderHooks hooks{.progress = [](std::string_view stage, float) { return stage != "splat"; }};
    EXPECT_THROW(render(session, camera, options, hooks), Error);
    const std::size_t kept = session.records().size();
    EXPECT_GT(kept, 100u);
    const RenderResult result = render(session, camera, options);
    EXPECT_LT(result.stats.records.records, kept / 4) << "hardly any is gathered again";
    EXPECT_LE(result.stats.errors.indirect.mean_relative, 1.05 * 0.02);
}

TEST(AfterStep, PicturesComeNearer)
{
    Session session = cornell();
    std::vector<double> errors;
    Image last;
    RenderHooks hooks;
    hooks.after_step = [&](const std::function<PictureSoFar()>& make) {
        PictureSoFar so_far = make();
        errors.push_back(so_far.errors.indirect.mean_relative);
        last = std::move(so_far.image.layers.at("beauty"));
    };
    const RenderResult result = render(session, camera_of(session), options_to(0.02), hooks);
    ASSERT_GE(errors.size(), 2u);
    EXPECT_LT(errors.back(), errors.front());
    EXPECT_LT(mean_difference(last, result.image.layers.at("beauty")), 0.01);
}

TEST(AfterStep, HooksLeaveThePictureAsItIs)
{
    Session one = cornell(), other = cornell();
    RenderHooks hooks;
    hooks.after_step = [](const std::function<PictureSoFar()>& make) { make(); };
    const Image a = render(one, camera_of(one), options_to(0.05), hooks).image.layers.at("beauty");
    const Image b = render(other, camera_of(other), options_to(0.05)).image.layers.at("beauty");
    EXPECT_EQ(a.pixels, b.pixels);
}

}  // namespace
}  // namespace rcs
