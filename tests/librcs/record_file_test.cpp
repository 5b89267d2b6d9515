#include "rcs/record_file.h"
#include "rcs/reference.h"

#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "rcs/error.h"
#include "rcs/fingerprint.h"
#include "rcs/gl_context.h"
#include "rcs/metrics.h"
#include "rcs/ray_scene.h"
#include "records/record_bytes.h"
#include "support/same_bits.h"
#include "support/scenes.h"
#include "support/session.h"
#include "support/temporary_folder.h"

namespace rcs {
namespace {

using test::bytes_of;
using test::TemporaryFolder;
using test::write_bytes;

const RecordKey kKey{"0123456789abcdef", "bounces 1"};

/// Records of all that records may hold, every other one with radiance.
std::vector<Record> random_records(int count)
{
    std::mt19937 engine(7);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    const auto vector = [&] { return glm::vec3(unit(engine), unit(engine), unit(engine)); };
    std::vector<Record> records(static_cast<std::size_t>(count));
    for (std::size_t k = 0; k < records.size(); ++k) {
        Record& r = records[k];
        r.position = 1e6f * (vector() - 0.5f);
        r.normal = glm::normalize(vector() + 0.1f);
        r.irradiance = k % 5 == 0 ? glm::vec3(0.0f) : vector();
        for (int c = 0; c < 3; ++c) {
            r.rotation_gradient[static_cast<std::size_t>(c)] = vector() - 0.5f;
            r.translation_gradient[static_cast<std::size_t>(c)] = 1e-30f * vector();
        }
        r.harmonic_mean_distance = k % 3 == 0 ? std::numeric_limits<float>::infinity() : unit(engine);
        r.minimum_distance = k % 3 == 1 ? std::numeric_limits<float>::infinity() : 0.0f;
        r.gradient_reach = unit(engine);
        r.rays = static_cast<int>(k) + 1;
        r.footprint = 1e-5f + unit(engine);
        r.noise = unit(engine);
        r.spacing_radius = unit(engine);
        r.gradient_scale = k % 2 == 0 ? 0.0f : 1.0f;
        r.closeness = 0.25f;
        r.breadth = 0.5f;
        if (k % 4 == 0) {
            r.watch.origin = r.position;
            r.watch.geometric_normal = r.normal;
            r.watch.instance = static_cast<std::uint32_t>(k);
        }
        for (int i = 0; i < (k % 2 == 0 ? 108 : 0); ++i) r.radiance.push_back(unit(engine) - 0.5f);
        if (k % 3 != 0) continue;
        r.gathered_lamps = static_cast<std::uint32_t>(k);
        r.of_lamps = 0.5f * r.irradiance;
        for (std::size_t i = 0; i < r.radiance.size(); ++i) r.radiance_of_lamps.push_back(unit(engine));
    }
    return records;
}

/// @return what the error says, of the code expected
std::string error_of(ErrorCode code, const std::function<void()>& work)
{
    try {
        work();
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), code) << e.what();
        return e.what();
    }
    ADD_FAILURE() << "no error";
    return {};
}

TEST(RecordFile, HoldsRecordsBitForBit)
{
    const TemporaryFolder folder;
    for (const int count : {0, 1, 250}) {
        const std::vector<Record> records = random_records(count);
        write_records(folder / "a.records", kKey, records);
        EXPECT_TRUE(test::same_bits(read_records(folder / "a.records", kKey), records)) << count << " records";
        write_records(folder / "b.records", kKey, records);
        EXPECT_EQ(bytes_of(folder / "a.records"), bytes_of(folder / "b.records")) << count << " records";
    }
    EXPECT_EQ(folder.names().size(), 2u) << "nothing else is left";
}

TEST(RecordFile, KeepsItsFormatWithinAVersion)
{
    // Whoever changes what a file looks like gives it another version: old files are then refused, not misread.
    Record r;
    r.irradiance = {1.0f, 2.0f, 3.0f};
    r.harmonic_mean_distance = 4.0f;
    r.rays = 128;
    r.footprint = 0.5f;
    r.watch.instance = 5;
    const std::string bytes = to_bytes({"scene", "settings"}, {r});
    ASSERT_EQ(bytes.size(), 12u + 4 + 4 + 5 + 4 + 8 + 4 + 50 * 4);
    EXPECT_EQ(bytes.substr(0, 25), std::string("rcs records\n\3\0\0\0\5\0\0\0scene", 25));
    const auto word = [&](std::size_t i) { return bytes.substr(41 + 4 * i, 4); };
    EXPECT_EQ(word(6), std::string("\0\0\x80\x3f", 4)) << "irradiance 1";
    EXPECT_EQ(word(8), std::string("\0\0\x40\x40", 4)) << "irradiance 3";
    EXPECT_EQ(word(30), std::string("\0\0\x80\x40", 4)) << "harmonic mean distance 4";
    EXPECT_EQ(word(32), std::string("\0\0\x80\x7f", 4)) << "gradient reach infinite";
    EXPECT_EQ(word(33), std::string("\x80\0\0\0", 4)) << "128 rays";
    EXPECT_EQ(word(34), std::string("\0\0\0\x3f", 4)) << "footprint 0.5";
    EXPECT_EQ(word(48), std::string("\0\0\0\0", 4)) << "no radiance";
    EXPECT_EQ(word(47), std::string("\5\0\0\0", 4)) << "born on instance 5";
}

TEST(RecordFile, CutShortOrWithAnyBitFlippedIsOneErrorThatNamesIt)
{
    const TemporaryFolder folder;
    const std::string path = folder / "a.records";
    write_records(path, kKey, random_records(2));
    const std::string whole = bytes_of(path);
    const auto message = [&](const std::string& bytes) {
        write_bytes(path, bytes);
        try {
            read_records(path, kKey);
        } catch (const Error& e) {
            EXPECT_TRUE(e.code() == ErrorCode::bad_file || e.code() == ErrorCode::unsupported) << e.what();
            return std::string(e.what());
        }
        return std::string("accepted");
    };
    EXPECT_EQ(message(whole), "accepted");
    for (std::size_t size = 0; size < whole.size(); size += size < 80 ? 1 : 7)
        EXPECT_NE(message(whole.substr(0, size)).find("a.records"), std::string::npos) << size << " bytes";
    for (std::size_t bit = 0; bit < 8 * whole.size(); bit += 3) {
        std::string flipped = whole;
        flipped[bit / 8] = static_cast<char>(flipped[bit / 8] ^ 1 << bit % 8);
        EXPECT_NE(message(flipped).find("a.records"), std::string::npos) << "bit " << bit;
    }
    EXPECT_NE(message(whole + "x").find("a.records"), std::string::npos);
    EXPECT_NE(message("").find("a.records is no record file"), std::string::npos);
    EXPECT_NE(message(std::string("rcs records\n\1\0\0\0", 16) + std::string(16, '0'))
                  .find("version 1, this build reads version 3"),
              std::string::npos);
}

TEST(RecordFile, WithValuesThatNoRecordHasIsAnError)
{
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();
    const std::vector<std::pair<std::string, std::function<void(Record&)>>> changes{
        {"position", [](Record& r) { r.position.y = kNan; }},
        {"position", [](Record& r) { r.position.x = 1e30f; }},
        {"normal", [](Record& r) { r.normal *= 2.0f; }},
        {"normal", [](Record& r) { r.normal.z = kInfinity; }},
        {"irradiance", [](Record& r) { r.irradiance.g = -1.0f; }},
        {"irradiance", [](Record& r) { r.irradiance.b = kInfinity; }},
        {"gradient", [](Record& r) { r.rotation_gradient[2].x = kNan; }},
        {"gradient", [](Record& r) { r.translation_gradient[0].z = kInfinity; }},
        {"distance", [](Record& r) { r.harmonic_mean_distance = kNan; }},
        {"distance", [](Record& r) { r.minimum_distance = -1.0f; }},
        {"distance", [](Record& r) { r.gradient_reach = -0.5f; }},
        {"distance", [](Record& r) { r.spacing_radius = kInfinity; }},
        {"rays", [](Record& r) { r.rays = 0; }},
        {"rays", [](Record& r) { r.rays = -7; }},
        {"footprint", [](Record& r) { r.footprint = 0.0f; }},
        {"footprint", [](Record& r) { r.footprint = 1e-40f; }},
        {"noise", [](Record& r) { r.noise = kNan; }},
        {"scale", [](Record& r) { r.gradient_scale = 1.5f; }},
        {"scale", [](Record& r) { r.closeness = 0.0f; }},
        {"scale", [](Record& r) { r.breadth = kNan; }},
        {"birth", [](Record& r) { r.watch.origin.x = kNan; }},
        {"birth", [](Record& r) { r.watch.geometric_normal = {0.5f, 0.0f, 0.0f}; }},
        {"radiance", [](Record& r) { r.radiance[5] = kInfinity; }},
        {"radiance", [](Record& r) { r.radiance.pop_back(); }},
    };
    for (std::size_t i = 0; i < changes.size(); ++i) {
        std::vector<Record> records = random_records(3);
        changes[i].second(records[2]);
        const std::string words =
            error_of(ErrorCode::bad_file, [&] { parse_records(to_bytes(kKey, records), "a.records"); });
        EXPECT_NE(words.find(changes[i].first), std::string::npos) << "change " << i << ": " << words;
    }
}

TEST(RecordFile, ThatPromisesMoreThanItHasTakesNoMemory)
{
    std::string bytes = to_bytes(kKey, {});
    for (std::size_t i = bytes.size() - 4; i < bytes.size(); ++i) bytes[i] = '\xff';
    EXPECT_NE(error_of(ErrorCode::bad_file, [&] { parse_records(bytes, "a.records"); })
                  .find("too short for 4294967295 records"),
              std::string::npos);
    bytes = to_bytes(kKey, {}).substr(0, 16) + "\xff\xff\xff\xff";
    EXPECT_NE(error_of(ErrorCode::bad_file, [&] { parse_records(bytes, "a.records"); }).find("4294967295 bytes"),
              std::string::npos);
}

TEST(RecordFile, MissingOrNoFileIsAnError)
{
    const TemporaryFolder folder;
    EXPECT_NE(error_of(ErrorCode::not_found, [&] { read_records(folder / "none.records", kKey); }).find("none.records"),
              std::string::npos);
    EXPECT_NE(error_of(ErrorCode::io, [&] { read_records(folder.path(), kKey); }).find(folder.path()),
              std::string::npos);
    EXPECT_NE(error_of(ErrorCode::io, [&] { write_records(folder / "nowhere/a.records", kKey, {}); }).find("nowhere"),
              std::string::npos);
    EXPECT_TRUE(folder.names().empty());
}

TEST(RecordKey, ChangesWithAllThatRecordsDependOnAndWithNothingElse)
{
    const Scene scene = test::furnished_room();
    const RenderOptions options;
    const RecordKey key = record_key(scene, options);
    const auto with = [&](auto change) {
        RenderOptions other = options;
        change(other);
        return record_key(scene, other);
    };
    EXPECT_EQ(with([](auto& o) {
                  o.seed = 7;
                  o.width = 64;
                  o.aa = 1;
                  o.lobe_rays = 3;
                  o.layers.emplace();
              }),
              key);
    const std::vector<std::function<void(RenderOptions&)>> changes{
        [](RenderOptions& o) { o.bounces = 2; },
        [](RenderOptions& o) { o.quality = TargetError{0.05}; },
        [](RenderOptions& o) { settings_of(o).error_tolerance = 0.19f; },
        [](RenderOptions& o) { settings_of(o).rays = 256; },
        [](RenderOptions& o) { settings_of(o).noise_target = 0.01f; },
        [](RenderOptions& o) { settings_of(o).refinement = 4; },
        [](RenderOptions& o) { o.min_reach = 10.0f; },
        [](RenderOptions& o) { o.max_reach = 50.0f; },
        [](RenderOptions& o) { o.gradient_limit = 2.0f; },
        [](RenderOptions& o) { o.effects.without.set(Effect::area_light); },
        [](RenderOptions& o) { o.effects.with.set(Effect::area_light); }};
    for (std::size_t i = 0; i < changes.size(); ++i) {
        EXPECT_EQ(with(changes[i]).scene, key.scene);
        EXPECT_NE(with(changes[i]).settings, key.settings) << "change " << i << " goes unseen";
    }
    const auto aimed = [&](float overlap) {
        return with([&](RenderOptions& o) {
            o.quality = TargetError{0.05};
            o.overlap = overlap;
        });
    };
    EXPECT_NE(aimed(2.0f).settings, aimed(3.0f).settings) << "a target is judged by the splat";
    EXPECT_NE(key.settings.find("accuracy 0.2, rays 128, noise 0.02"), std::string::npos) << key.settings;
    Scene brighter = scene;
    brighter.sky_radiance += 0.1f;
    EXPECT_NE(record_key(brighter, options).scene, key.scene);
}

TEST(RecordFile, OfAnotherSceneOrAccuracyIsRefused)
{
    const TemporaryFolder folder;
    const std::string path = folder / "a.records";
    write_records(path, kKey, random_records(1));
    EXPECT_NE(error_of(ErrorCode::bad_file, [&] { read_records(path, {"f", "bounces 1"}); }).find("another scene"),
              std::string::npos);
    EXPECT_NE(error_of(ErrorCode::bad_file, [&] { read_records(path, {kKey.scene, "bounces 2"}); })
                  .find("made with bounces 1, not with bounces 2"),
              std::string::npos);
}

/// Renders, and renders again from the file with its records.
struct TwoRenders {
    RenderResult first, again;
};
TwoRenders render_twice(const Scene& scene, const RenderOptions& options)
{
    const TemporaryFolder folder;
    const std::string path = folder / "a.records";
    const RecordKey key = record_key(scene, options);
    TwoRenders both;
    both.first = test::render_first(scene, options);
    EXPECT_GT(both.first.records.size(), 10u);
    write_records(path, key, both.first.records);
    both.again = test::render_first(scene, options, 2, read_records(path, key));
    return both;
}

RenderOptions small(int aa)
{
    RenderOptions options;
    options.width = options.height = 64;
    options.aa = aa;
    return options;
}

void expect_same_picture(const Scene& scene, const RenderOptions& options, const std::string& words)
{
    const auto [first, again] = render_twice(scene, options);
    EXPECT_EQ(again.stats.records.records, 0u) << words;
    EXPECT_EQ(again.stats.records.hemisphere_rays, 0u) << words;
    EXPECT_TRUE(test::same_bits(again.records, first.records)) << words;
    for (const auto& [name, layer] : first.image.layers) {
        if (name == "indirect_error") continue;  // judged by probes that know less of who sees which light
        EXPECT_EQ(again.image.layers.at(name).pixels, layer.pixels) << words << ", layer " << name;
    }
    const double told = first.stats.errors.indirect.mean_relative;
    EXPECT_NEAR(again.stats.errors.indirect.mean_relative, told, 0.3 * told) << words;
}

TEST(RecordFile, GivesTheSamePictureWithoutARay)
{
    RenderOptions options = small(1);
    expect_same_picture(test::furnished_room(), options, "diffuse");
    options.quality = TargetError{0.08};
    expect_same_picture(test::furnished_room(), options, "with a target");
    options.quality = QualitySettings{};
    options.bounces = 3;
    expect_same_picture(load_scene("demo:spheres"), options, "glossy, three bounces");
}

TEST(RecordFile, LeavesHardlyAHoleWhereSamplesOfAPixelShareRecords)
{
    // Records of later samples shorten the reach of earlier ones, where light is steep by much, and so may leave a hole
    // in the first sample's view.
    RenderOptions options = small(4);
    options.width = options.height = 128;
    const auto [first, again] = render_twice(load_scene("demo:atrium"), options);
    EXPECT_LT(again.stats.records.records, first.records.size() / 25);
    const double told = first.stats.errors.indirect.mean_relative;
    EXPECT_LT(compare_images(again.image, first.image, "indirect").mean_relative_error, 0.5 * told);
    EXPECT_NEAR(again.stats.errors.indirect.mean_relative, told, 0.3 * told);
    EXPECT_EQ(again.image.metadata.at("rcs:records"), std::to_string(again.records.size()))
        << "those it was made of, gathered or not";
}

TEST(RecordFile, TakesWhatTheLargestLightLeavesFinite)
{
    Scene scene = test::furnished_room();
    scene.sky_radiance = glm::vec3(1e36f);
    const auto [first, again] = render_twice(scene, small(1));
    EXPECT_LE(again.records.size(), first.records.size() + again.stats.records.records);
}

TEST(RecordFile, SavesWhatIsNoUseToGlossySurfacesForOthers)
{
    const TemporaryFolder folder;
    const Scene scene = load_scene("demo:spheres");
    const RenderOptions options = small(1);
    Camera up = scene.cameras[0];
    up.lens_shift = {0.0, 3.0};
    const RenderResult glossy = test::render_first(scene, options);
    ASSERT_TRUE(glossy.stats.plan.needs(Effect::glossy_records));
    const RenderResult plain = test::render_view(scene, up, options);
    ASSERT_FALSE(plain.stats.plan.needs(Effect::glossy_records));
    ASSERT_GT(plain.records.size(), 0u);
    const RenderResult both = test::render_first(scene, options, 2, plain.records);
    EXPECT_EQ(both.stats.records.records, glossy.records.size());
    EXPECT_EQ(both.records.size(), glossy.records.size() + plain.records.size());
    EXPECT_EQ(test::render_view(scene, up, options, 2, both.records).stats.records.records, 0u);
}

TEST(RecordFile, OfASmallPictureMakesNoLargeOneCoarse)
{
    const Scene scene = load_scene("demo:cornell");
    RenderOptions options = small(1);
    options.width = options.height = 24;
    const RenderResult coarse = test::render_first(scene, options);
    options.width = options.height = 192;
    const RenderResult fresh = test::render_first(scene, options);
    const RenderResult grown = test::render_first(scene, options, 2, coarse.records);
    EXPECT_GT(grown.stats.records.records, fresh.records.size() / 2);
    ThreadPool pool(2);
    const View view{scene.cameras[0], 192, 192, {0.5, 0.5}};
    ReferenceOptions paths;
    paths.samples = 1024;
    paths.stride = 4;
    const LayeredImage truth = render_reference(build_ray_scene(scene, pool), view, paths, pool);
    EXPECT_LT(compare_images(grown.image, truth, "indirect").mean_relative_error,
              1.1 * compare_images(fresh.image, truth, "indirect").mean_relative_error);
    const Image &a = grown.image.layers.at("indirect"), &b = fresh.image.layers.at("indirect");
    double difference = 0.0, light = 0.0;
    for (std::size_t i = 0; i < a.pixels.size(); ++i) {
        difference += std::abs(static_cast<double>(a.pixels[i]) - static_cast<double>(b.pixels[i]));
        light += static_cast<double>(b.pixels[i]);
    }
    EXPECT_LT(difference / light,
              grown.stats.errors.indirect.mean_relative + fresh.stats.errors.indirect.mean_relative);
}

}  // namespace
}  // namespace rcs
