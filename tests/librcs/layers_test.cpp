#include "rcs/layers.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>

#include <gtest/gtest.h>

#include "compose/layer_sums.h"
#include "plan/plan_layers.h"
#include "rcs/error.h"

namespace rcs {
namespace {

TEST(Layers, HaveNamesOfTheirOwnAndChannelsThatAnExrCanName)
{
    std::set<std::string_view> names;
    for (const LayerKind& layer : all_layers()) {
        SCOPED_TRACE(layer.name);
        EXPECT_TRUE(names.insert(layer.name).second);
        EXPECT_EQ(layer.name.find('.'), layer.name.npos);
        EXPECT_EQ(std::set<char>(layer.channels.begin(), layer.channels.end()).size(), layer.channels.size());
        EXPECT_FALSE(layer.what.empty());
        EXPECT_TRUE(layer.of_render || layer.of_reference);
        EXPECT_FALSE(layer.in_sum && layer.made_by.empty()) << "made by what?";
        EXPECT_EQ(look_up_layer(layer.name), &layer);
    }
    EXPECT_EQ(look_up_layer("Depth"), nullptr);
    EXPECT_EQ(layer_names(Renderer::reference).front(), "beauty");
}

TEST(Layers, OfARenderAddUpInAWayOfTheirOwn)
{
    for (const std::string& name : layer_names(Renderer::records)) EXPECT_EQ(layer_sum(name).name, name);
    EXPECT_THROW(layer_sum("standard_error"), Error);
}

TEST(Layers, ThatAreNoneAreRefusedWithThoseThereAre)
{
    EXPECT_EQ(find_layer("depth").channels, "Z");
    for (const std::string name : {"", "Depth", "standard_error"}) {
        try {
            find_layer(name);
            ADD_FAILURE() << name;
        } catch (const Error& e) {
            EXPECT_EQ(e.code(), ErrorCode::not_found);
            EXPECT_NE(std::string(e.what()).find("is not a layer; there are beauty, emission, "), std::string::npos);
        }
    }
}

/// Names of the layers for which `decision` holds.
std::set<std::string_view> those(const std::vector<PlannedLayer>& layers, bool PlannedLayer::* decision)
{
    std::set<std::string_view> names;
    for (const PlannedLayer& planned : layers)
        if (planned.*decision) names.insert(planned.layer->name);
    return names;
}

TEST(Layers, AreMadeIfAnOutputKeepsThemOrBeautyTakesThemIn)
{
    const EffectSet effects = {Effect::area_light, Effect::indirect_diffuse, Effect::error_estimate};
    std::set<std::string_view> by_default;
    for (const LayerKind& layer : all_layers())
        if (layer.of_render && layer.by_default) by_default.insert(layer.name);
    EXPECT_EQ(those(plan_layers({}, effects, 100.0), &PlannedLayer::made), by_default);

    const std::vector<PlannedLayer> one = plan_layers({{"depth"}}, effects, 100.0);
    EXPECT_EQ(those(one, &PlannedLayer::kept), (std::set<std::string_view>{"beauty", "depth"}));
    EXPECT_EQ(those(one, &PlannedLayer::made),
              (std::set<std::string_view>{"beauty", "depth", "direct", "direct_error", "indirect", "indirect_error"}));
    for (const PlannedLayer& planned : one)
        EXPECT_EQ(planned.bytes, planned.made ? 400.0 * planned.layer->channel_count() : 0.0) << planned.layer->name;
    EXPECT_THROW(plan_layers({{"deep"}}, effects, 100.0), Error);
}

/// A row of the table in docs/layers.md.
std::string row_of(const LayerKind& layer)
{
    const auto text = [](std::string_view words) { return std::string(words); };
    const std::string by = !layer.of_reference ? "render" : !layer.of_render ? "reference" : "both";
    return "| " + text(layer.name) + " | " + (layer.parts > 1 ? std::to_string(layer.parts) + " x " : "") +
           text(layer.channels) + " | " + text(layer.unit) + " | " + (layer.needs_float ? "float" : "half") + " | " +
           by + (layer.by_default ? "" : ", on demand") + " | " + text(layer.what) + " |\n";
}

TEST(Layers, AreWhatTheDocumentationSays)
{
    std::ifstream file(RCS_TESTS_DIR "/../docs/layers.md");
    const std::string page{std::istreambuf_iterator<char>(file), {}};
    std::string table;
    for (const LayerKind& layer : all_layers()) table += row_of(layer);
    EXPECT_NE(page.find("| --- | --- | --- | --- | --- | --- |\n" + table + "\n"), std::string::npos)
        << "docs/layers.md is to have these rows and no others:\n"
        << table;
}

}  // namespace
}  // namespace rcs
