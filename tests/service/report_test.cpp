#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "rcs/error.h"
#include "report/encoding.h"
#include "report/headline.h"
#include "report/keys.h"
#include "report/page.h"
#include "report/pictures.h"
#include "report/raster.h"
#include "report/table.h"
#include "support/temporary_folder.h"

namespace rcs::service {
namespace {

Measurement render_point(const std::string& label, double seconds, double error)
{
    Measurement m;
    m.label = label;
    m.seconds = seconds;
    m.stage_seconds = {{"records", 0.75 * seconds}, {"splat", 0.25 * seconds}};
    m.records = 100;
    m.indirect.mean_relative_error = error;
    m.pictures = {"P", "I", "D", "R"};
    return m;
}

Measurement paths_point(int paths, double seconds, double error)
{
    std::string name = std::to_string(paths);
    name += " paths a pixel";
    Measurement m = render_point(name, seconds, error);
    m.paths = paths;
    m.records = 0;
    m.pictures.records.clear();
    return m;
}

AccuracyReport small_report()
{
    AccuracyReport report;
    report.scene = "a \"b\" <c> & {{d}}.glb";
    report.camera = "front";
    report.width = 40;
    report.height = 30;
    report.bounces = report.aa = 1;
    report.reference = {
        .paths = 512, .seconds = 60.0, .error = 0.01, .wanted_error = 0.02, .picture = "p", .indirect = "i"};
    report.points = {render_point("coarse", 1.0, 0.4), render_point("beaten, by far", 20.0, 0.3),
                     render_point("fine", 16.0, 0.1), paths_point(16, 10.0, 0.4), paths_point(64, 40.0, 0.2)};
    return report;
}

std::size_t count(const std::string& text, const std::string& part)
{
    std::size_t found = 0;
    for (std::size_t at = text.find(part); at != text.npos; at = text.find(part, at + part.size())) ++found;
    return found;
}

TEST(Encoding, Base64IsThatOfTheStandard)
{
    // The test vectors of RFC 4648, section 10.
    EXPECT_EQ(base64(""), "");
    EXPECT_EQ(base64("f"), "Zg==");
    EXPECT_EQ(base64("fo"), "Zm8=");
    EXPECT_EQ(base64("foo"), "Zm9v");
    EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
    EXPECT_EQ(base64("\xff\xfe\xfd"), "//79");
}

TEST(Encoding, FieldsThatNeedItAreQuoted)
{
    EXPECT_EQ(csv_field("plain"), "plain");
    EXPECT_EQ(csv_field("a,b"), "\"a,b\"");
    EXPECT_EQ(csv_field("say \"a\""), "\"say \"\"a\"\"\"");
    EXPECT_EQ(html_escape("<a href=\"x\">&</a>"), "&lt;a href=&quot;x&quot;&gt;&amp;&lt;/a&gt;");
}

TEST(Encoding, FiguresHaveTheDigitsAPersonReads)
{
    EXPECT_EQ(percent_text(0.1), "10 %");
    EXPECT_EQ(percent_text(0.064), "6.4 %");
    EXPECT_EQ(percent_text(0.0026), "0.26 %");
    EXPECT_EQ(percent_text(1.234), "123 %");
    EXPECT_EQ(percent_text(0.0), "0 %");
    EXPECT_EQ(duration_text(0.0123), "12 ms");
    EXPECT_EQ(duration_text(0.999), "1 s");
    EXPECT_EQ(duration_text(4.04), "4 s");
    EXPECT_EQ(duration_text(15.2), "15 s");
    EXPECT_EQ(duration_text(1200.0), "20 min");
    EXPECT_EQ(duration_text(5400.0), "90 min");
    EXPECT_EQ(duration_text(9000.0), "2.5 h");
    EXPECT_EQ(duration_text(10.0 * 86400.0), "10 days");
}

TEST(Headline, SaysWhatErrorsCostAndWhatThePathTracerNeeds)
{
    // Both halve their error for four times the time: 10 % costs 4 s, 5 % 16 s; the path tracer 100 times as much.
    const std::vector<CostPoint> renders{{1.0, 0.2}, {16.0, 0.05}}, paths{{100.0, 0.2}, {1600.0, 0.05}};
    EXPECT_EQ(headline(renders, paths),
              "An error of 10 % costs 4 s; 7 % costs 8.2 s; 5 % costs 16 s; the path tracer needs 27 min for 5 %.");
    EXPECT_EQ(headline(renders, {}), "An error of 10 % costs 4 s; 7 % costs 8.2 s; 5 % costs 16 s.");
}

TEST(Headline, MarksWhatIsExtrapolated)
{
    const std::vector<CostPoint> renders{{1.0, 0.2}, {16.0, 0.05}};
    EXPECT_NE(headline(renders, {{1.0, 0.4}, {4.0, 0.2}}).find("needs about 64 s for 5 %"), std::string::npos)
        << "a quarter of the error for 16 times 4 s: " << headline(renders, {{1.0, 0.4}, {4.0, 0.2}});
    const PathCost within = path_seconds_for_error({{1.0, 0.4}, {4.0, 0.2}}, 0.2).value();
    EXPECT_EQ(within.seconds, 4.0);
    EXPECT_FALSE(within.extrapolated);
    EXPECT_FALSE(path_seconds_for_error({}, 0.1).has_value());
}

TEST(Headline, NamesTheOneErrorThereIsWhenNoRoundOneIsReached)
{
    EXPECT_EQ(headline({{2.0, 0.123}}, {}), "An error of 12 % costs 2 s.");
    EXPECT_EQ(headline({}, {}), "Nothing was rendered.");
}

TEST(Table, CsvHasALineForEachPointAndMarksTheFront)
{
    AccuracyReport report = small_report();
    report.points[2].estimated_error = 0.08;
    const std::string csv = to_csv(report);
    EXPECT_EQ(count(csv, "\r\n"), 6u);
    EXPECT_EQ(csv.rfind("point,method,label,seconds,", 0), 0u);
    EXPECT_NE(csv.find("\r\n1,splatting,coarse,1,0,0,100,0,0,1,,0.4,"), std::string::npos) << csv;
    EXPECT_NE(csv.find("\r\n2,splatting,\"beaten, by far\",20,0,0,100,0,0,0,,0.3,"), std::string::npos) << csv;
    EXPECT_NE(csv.find("\r\n3,splatting,fine,16,0,0,100,0,0,1,0.08,0.1,"), std::string::npos) << csv;
    EXPECT_NE(csv.find("\r\n4,path tracer,16 paths a pixel,10,0,0,0,0,16,0,,0.4,"), std::string::npos) << csv;
    std::set<std::size_t> fields;
    for (std::size_t at = 0; at < csv.size();) {
        const std::size_t end = csv.find("\r\n", at);
        const std::string line = csv.substr(at, end - at);
        fields.insert(count(line, ",") - (line.find('"') != line.npos ? 1u : 0u));
        at = end + 2;
    }
    EXPECT_EQ(fields.size(), 1u) << "every line has as many fields as the first";
}

TEST(Table, JsonHoldsTheSameFigures)
{
    const auto json = to_json(small_report());
    EXPECT_EQ(json.at("points").size(), 5u);
    EXPECT_EQ(json.at("points")[2].at("pareto"), true);
    EXPECT_EQ(json.at("points")[1].at("pareto"), false);
    EXPECT_EQ(json.at("points")[0].at("indirect").at("mean_relative_error"), 0.4);
    EXPECT_EQ(json.at("reference").at("paths_per_pixel"), 512);
}

TEST(Measurement, ComesBackFromItsFolderAsItWas)
{
    const test::TemporaryFolder folder;
    Measurement m = render_point("--accuracy 0.2", 1.25, 0.07);
    m.rays = 123456789012;
    m.estimated_error = 0.05;
    m.indirect.display_psnr = std::numeric_limits<double>::infinity();
    m.pictures.picture = std::string("\0\xff<>", 4);
    EXPECT_FALSE(load_measurement(folder / "point").has_value());
    save(folder / "point", m);
    const Measurement back = load_measurement(folder / "point").value();
    EXPECT_EQ(to_json(back).dump(), to_json(m).dump());
    EXPECT_EQ(back.pictures.picture, m.pictures.picture);
    EXPECT_EQ(back.pictures.records, "R");
    EXPECT_TRUE(std::isinf(back.indirect.display_psnr));

    test::write_bytes(folder / "point/point.json", "{\"label\": 3");
    try {
        load_measurement(folder / "point");
        FAIL() << "takes a damaged file";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::bad_file);
        EXPECT_NE(std::string(error.what()).find("point.json"), std::string::npos) << error.what();
    }
}

TEST(Keys, ChangeWithEveryOptionOfARenderAndOfThePaths)
{
    const auto print = [](const RenderOptions& options) {
        Fingerprint result;
        add(result, options);
        return result.text();
    };
    std::set<std::string> prints{print({})};
    RenderOptions options;
    const auto expect_new = [&] { EXPECT_TRUE(prints.insert(print(options)).second); };
    options.aa = 9, expect_new();
    settings_of(options).noise_target = 0.5f, expect_new();
    options.max_reach = 99.0f, expect_new();
    options.area_samples = 3, expect_new();
    options.overlap = 2.0f, expect_new();
    options.seed = 7, expect_new();

    const Scene scene = load_scene("demo:cornell");
    View view{find_camera(scene, ""), 8, 8};
    ReferenceOptions paths;
    const std::string key = paths_key(scene, view, paths);
    paths.samples = 4096;
    EXPECT_EQ(paths_key(scene, view, paths), key) << "more samples continue what is there";
    paths.bounces = 2;
    EXPECT_NE(paths_key(scene, view, paths), key);
    paths.bounces = 1;
    view.height = 9;
    EXPECT_NE(paths_key(scene, view, paths), key);
    EXPECT_NE(machine_key(1, "a"), machine_key(2, "a"));
    EXPECT_NE(machine_key(1, "a"), machine_key(1, "b"));
}

TEST(Measurement, LosesTheReferencesNoiseInSquares)
{
    EXPECT_NEAR(without_noise(0.05, 0.03), 0.04, 1e-12);
    EXPECT_EQ(without_noise(0.05, 0.0), 0.05);
    EXPECT_NEAR(without_noise(0.02, 0.03), 0.002, 1e-12) << "and never all of itself";
}

TEST(Plot, PutsQuickAndRightPointsAtTheLowerLeft)
{
    AccuracyReport report = small_report();
    report.reference.error = 0.0;
    const std::vector<Shape> shapes = lay_out(plot_of(report));
    std::vector<Shape> points;
    for (const Shape& shape : shapes) {
        if (shape.render >= 0) points.push_back(shape);
        for (std::size_t i = 0; i < shape.at.size(); i += 2) {
            EXPECT_GE(shape.at[i], 0.0);
            EXPECT_LE(shape.at[i], kPlotWidth);
            EXPECT_GE(shape.at[i + 1], 0.0);
            EXPECT_LE(shape.at[i + 1], kPlotHeight);
        }
    }
    ASSERT_EQ(points.size(), 5u);
    EXPECT_EQ(points[0].role, Role::front_point);
    EXPECT_EQ(points[1].role, Role::other_point);
    EXPECT_EQ(points[3].role, Role::paths_point);
    // 1 s to 16 s and 10 s to 40 s: ratios 16 and 4 are 2 to 1 on a logarithmic axis; so are errors 0.4 / 0.1 and 0.4 /
    // 0.2.
    EXPECT_NEAR(points[2].at[0] - points[0].at[0], 2.0 * (points[4].at[0] - points[3].at[0]), 1e-9);
    EXPECT_NEAR(points[2].at[1] - points[0].at[1], 2.0 * (points[4].at[1] - points[3].at[1]), 1e-9);
    EXPECT_GT(points[2].at[0], points[0].at[0]);
    EXPECT_GT(points[2].at[1], points[0].at[1]) << "smaller errors are further down";
}

TEST(Plot, StandsASinglePointAndEqualPoints)
{
    for (const auto& points : {std::vector<PlotPoint>{{1.0, 0.1, "1", ""}},
                               std::vector<PlotPoint>{{1.0, 0.1, "1", ""}, {1.0, 0.1, "2", ""}}}) {
        for (const Shape& shape : lay_out({.renders = points, .paths = {}, .front = {0}, .noise_floor = 0.0})) {
            for (const double at : shape.at) EXPECT_TRUE(std::isfinite(at));
        }
    }
}

TEST(Plot, PictureShowsTheColoursOfBothMethods)
{
    check_plot_font();
    const Image picture = raster(lay_out(plot_of(small_report())));
    EXPECT_EQ(picture.width, 2 * kPlotWidth);
    std::size_t blue = 0, orange = 0, dark = 0;
    for (std::size_t i = 0; i < picture.pixels.size(); i += 3) {
        const float r = picture.pixels[i], g = picture.pixels[i + 1], b = picture.pixels[i + 2];
        ASSERT_TRUE(r >= 0.0f && r <= 1.0f && b >= 0.0f && b <= 1.0f);
        blue += b - r > 0.5f ? 1 : 0;
        orange += r - b > 0.5f ? 1 : 0;
        dark += std::max({r, g, b}) < 0.3f ? 1 : 0;
    }
    EXPECT_GT(blue, 1000u);
    EXPECT_GT(orange, 500u);
    EXPECT_GT(dark, 500u) << "the text";
}

TEST(Pictures, DifferencesHaveTheColourOfTheirSign)
{
    Image difference(4, 1, 1);
    difference.pixels = {0.0f, 0.25f, -0.25f, NAN};
    const Image picture = difference_picture(difference);
    const auto color = [&](int x) { return std::vector<float>(picture.at(x, 0), picture.at(x, 0) + 3); };
    EXPECT_EQ(color(0), (std::vector<float>{0.0f, 0.0f, 0.0f}));
    EXPECT_GT(color(1)[0], color(1)[2]) << "too bright: orange";
    EXPECT_LT(color(2)[0], color(2)[2]) << "too dark: blue";
    EXPECT_EQ(color(3), (std::vector<float>{1.0f, 0.0f, 1.0f}));
}

TEST(Pictures, RecordsAreDotsWhereTheCameraSeesThem)
{
    const View view{look_at_camera("c", {0.0, 0.0, 2.0}, {0.0, 0.0, 0.0}, 2.0 * std::atan(0.5)), 40, 20};
    // At distance 2 the view is 2 m high: 10 px a metre.
    std::vector<Record> records(3);
    records[0].position = {0.53f, 0.27f, 0.0f};
    records[1].position = {0.0f, 0.0f, 3.0f};   // behind the camera
    records[2].position = {50.0f, 0.0f, 0.0f};  // beside the view
    Image display(40, 20, 3);
    const Image picture = records_picture(display, view, records);
    int dots = 0;
    for (int y = 0; y < 20; ++y) {
        for (int x = 0; x < 40; ++x) dots += picture.at(x, y)[0] > 0.5f ? 1 : 0;
    }
    EXPECT_EQ(dots, 1);
    EXPECT_GT(picture.at(25, 7)[0], 0.5f) << "20 + 5.3 px to the right, 10 - 2.7 px down";
}

TEST(Page, HoldsEverythingItselfAndEscapesNames)
{
    const AccuracyReport report = small_report();
    const std::string page = to_html(report);
    EXPECT_EQ(count(page, "<button role=\"tab\""), 5u);
    EXPECT_EQ(count(page, "<a href=\"#point\" data-point="), 5u);
    EXPECT_EQ(count(page, "<tr><td>"), 6u) << "the head and five points";
    EXPECT_NE(page.find("a &quot;b&quot; &lt;c&gt; &amp; {{d}}.glb"), std::string::npos);
    EXPECT_NE(page.find(html_escape(headline(report.renders(), report.paths()))), std::string::npos);
    EXPECT_EQ(count(page, "http:") + count(page, "https:"), 0u) << "no address of anywhere";
    EXPECT_EQ(count(page, "<script src") + count(page, "@import") + count(page, "url("), 0u);

    const std::string begin = "id=\"data\">";
    const std::size_t at = page.find(begin) + begin.size();
    const auto data = nlohmann::json::parse(page.substr(at, page.find("</script>", at) - at));
    EXPECT_EQ(data.at("points").size(), 5u);
    EXPECT_EQ(data.at("points")[0].at("images").at("records"), "data:image/jpeg;base64,Ug==");
    EXPECT_FALSE(data.at("points")[3].at("images").contains("records"));
    EXPECT_EQ(data.at("points")[0].at("stages")[0].at("share"), 0.75);
    EXPECT_EQ(data.at("reference").at("picture"), "data:image/jpeg;base64,cA==");
}

TEST(Page, SaysWhenTheReferenceFellShort)
{
    AccuracyReport report = small_report();
    EXPECT_EQ(to_html(report).find("ran out"), std::string::npos);
    report.reference.error = 0.03;
    EXPECT_NE(to_html(report).find("the paths allowed ran out"), std::string::npos);
}

}  // namespace
}  // namespace rcs::service
