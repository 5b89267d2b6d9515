// Walks the table of options: what one of library, command line and wire refuses, all refuse, in the same words.

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "cli/render_arguments.h"
#include "rcs/error.h"
#include "rcs/option_table.h"
#include "support/rcsplat.h"
#include "support/temporary_folder.h"
#include "wire/options.h"

namespace rcs {
namespace {

using test::rcsplat;
using test::TemporaryFolder;

/// What is said against it; "" where nothing is.
template <typename Use>
std::string refusal(const Use& use)
{
    try {
        use();
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), ErrorCode::bad_argument) << e.what();
        return e.what();
    }
    return "";
}

/// The member itself, set by a program to a number.
template <typename Value>
std::optional<Value> value_of(const std::string& text)
{
    const std::optional<double> number = read_number(text);
    if (!number) return std::nullopt;
    if constexpr (std::is_enum_v<Value> || std::is_same_v<Value, EffectSet> ||
                  std::is_same_v<Value, std::optional<Crop>>) {
        return std::nullopt;
    } else if constexpr (std::is_same_v<Value, int>) {
        if (*number != std::floor(*number) || std::abs(*number) > 2e9) return std::nullopt;
        return static_cast<int>(*number);
    } else if constexpr (std::is_same_v<Value, std::uint64_t>) {
        if (*number != std::floor(*number) || !(*number >= 0.0 && *number < 1e19)) return std::nullopt;
        return std::stoull(text);
    } else {
        return static_cast<Value>(*number);
    }
}

/// What an option is of no use without: its name and value.
std::vector<std::string> companion_of(const OptionInfo& option)
{
    if (option.key == "f_stop") return {"--focus", "3"};
    if (option.key == "focus") return {"--f-stop", "2"};
    return {};
}

RenderOptions with_companion(const OptionInfo& option)
{
    RenderOptions options;
    if (option.key == "f_stop") options.focus = 3.0;
    if (option.key == "focus") options.f_stop = 2.0;
    return options;
}

struct Verdicts {
    std::string by_text;                           ///< of the library
    std::optional<std::string> by_value, by_wire;  ///< none: a member, or a field, cannot hold such a value
};

Verdicts judge(const OptionInfo& option, const std::string& text)
{
    Verdicts verdicts;
    verdicts.by_text = refusal([&] {
        RenderOptions options = with_companion(option);
        set_from_text(option, options, text);
        validate(options);
    });
    RenderOptions options = with_companion(option);
    change_value(option, options, [&](auto& value) {
        using Value = std::remove_cvref_t<decltype(value)>;
        if (const std::optional<Value> held = value_of<Value>(text)) {
            value = *held;
            verdicts.by_value = "";
        }
    });
    if (verdicts.by_value) {
        verdicts.by_value = refusal([&] { validate(options); });
        verdicts.by_wire = refusal([&] { service::from_message(service::to_message(options)); });
    }
    return verdicts;
}

/// What `rcsplat render` says to these arguments before it does anything.
std::string said_to(std::vector<std::string> words)
{
    CLI::App command("", "render");
    service::RenderArguments arguments;
    service::add_render_arguments(command, arguments);
    words.insert(words.begin(), "demo:cornell");
    std::reverse(words.begin(), words.end());  // as CLI11 wants them
    try {
        command.parse(words);
        service::final_options(arguments);
    } catch (const CLI::ParseError& e) {
        return e.what();
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), ErrorCode::bad_argument) << e.what();
        return e.what();
    }
    return "";
}

/// What is said of a value, without the hint at units that the command line adds.
std::string without_hint(const std::string& said)
{
    std::size_t end = said.size();
    for (const char* hint : {"; did you mean ", "; it may end in "}) end = std::min(end, said.find(hint));
    return said.substr(0, end);
}

/// @param words  that the library refuses it with; "": accepts it
void expect_on_command_line(const std::vector<std::string>& arguments, const std::string& words)
{
    const std::string said = said_to(arguments);
    const std::string shown = testing::PrintToString(arguments) + ": " + said;
    EXPECT_EQ(said.empty(), words.empty()) << shown;
    EXPECT_TRUE(words.empty() || without_hint(said).ends_with(": " + words)) << shown;
}

/// As --size takes it.
std::vector<std::string> arguments_of(const OptionInfo& option, const std::string& text)
{
    if (option.key == "width") return {"--size", text + "x8"};
    if (option.key == "height") return {"--size", "8x" + text};
    const std::string value = std::string(option.prefix) + text;
    std::vector<std::string> words = companion_of(option);
    if (value.empty())
        words.insert(words.end(), {std::string(option.name), ""});
    else
        words.push_back(std::string(option.name) + "=" + value);
    return words;
}

std::vector<std::string> numbers_to_try(const OptionInfo& option)
{
    const bool whole = expected_of(option).starts_with("a whole");
    const bool single = !whole && (quality_of(option) == 0 || quality_of(option) == kAnyQuality);
    const NumberRange& range = option.range;
    std::vector<std::string> texts{"fine", "", "nan", "1e99", "-1"};
    if (whole) {
        const bool large = range.most > 1e18;
        texts.push_back(number_text(range.least - 1.0));
        texts.push_back(number_text(range.least));
        texts.push_back(number_text(range.least + 0.5));
        texts.push_back(large ? "18446744073709551615" : number_text(range.most));
        texts.push_back(large ? "18446744073709551616" : number_text(range.most + 1.0));
    } else if (single) {
        const auto least = static_cast<float>(range.least), most = static_cast<float>(range.most);
        for (const float value : {std::nextafter(least, -1.0f), least, std::nextafter(least, 1e9f),
                                  std::nextafter(most, 0.0f), most, std::nextafter(most, 1e38f)})
            texts.push_back(number_text(value));
    } else {
        for (const double value : {std::nextafter(range.least, -1.0), range.least, std::nextafter(range.least, 1e9),
                                   range.most, std::nextafter(range.most, 1e38)})
            texts.push_back(number_text(value));
    }
    return texts;
}

TEST(OptionTable, IsJudgedAlikeByLibraryCommandLineAndWire)
{
    for (const OptionInfo& option : option_table()) {
        std::vector<std::string> texts{"cubes", "", "2"};
        if (option.range.most > option.range.least) {
            texts = numbers_to_try(option);
        } else if (!option.choices.empty()) {
            texts.insert(texts.end(), option.choices.begin(), option.choices.end());
        } else if (option.key == "crop") {
            texts.insert(texts.end(), {"0,0,1000,1000", "7,5,993,20", "7,5,994,20", "0,0,0,5", "-1,0,5,5", "1,2,3",
                                       "1,2,3,4,5", "1,2,3,4.5", "0,0,1e99,1"});
        } else {
            texts.insert(texts.end(), {"emission", "emission,highlights", "emission,magic", "all", "auto"});
        }
        int accepted = 0, refused = 0;
        for (const std::string& text : texts) {
            const Verdicts verdicts = judge(option, text);
            const std::string shown = std::string(option.key) + " = " + text;
            EXPECT_EQ(verdicts.by_value.value_or(verdicts.by_text), verdicts.by_text) << shown;
            EXPECT_EQ(verdicts.by_wire.value_or(verdicts.by_text), verdicts.by_text) << shown;
            if (!text.empty() || option.given_alone.empty())
                expect_on_command_line(arguments_of(option, text), verdicts.by_text);
            ++(verdicts.by_text.empty() ? accepted : refused);
        }
        EXPECT_GE(accepted, option.key == "min_reach" ? 1 : 2) << option.key;
        EXPECT_GE(refused, 3) << option.key;
    }
}

TEST(OptionTable, WhatIsGivenAloneTakesNoWordAfterIt)
{
    EXPECT_TRUE(said_to({"--denoise"}).empty() && !said_to({"--denoise", "off"}).empty());
}

TEST(OptionTable, TheProgramSaysTheSame)
{
    const TemporaryFolder folder;
    for (const OptionInfo& option : option_table()) {
        std::vector<std::string> arguments{"render", "demo:cornell", "-o", folder / "a.png"};
        for (const std::string& word : arguments_of(option, "nonsense")) arguments.push_back(word);
        const std::string words = judge(option, "nonsense").by_text;
        test::expect_error(arguments, test::kBadUsage, std::string(option.name) + ": " + words, folder);
    }
    test::expect_error({"render", "demo:cornell", "-o", folder / "a.png", "--rays", "64", "--budget", "5s"},
                       test::kBadUsage, "--budget, --rays: quality is settings and budget_seconds, expected", folder);
}

TEST(OptionTable, RefusalsNameFieldValueAndRange)
{
    const auto words = [](const char* key, const std::string& text) { return judge(find_option(key), text).by_text; };
    EXPECT_EQ(words("rays", "15"), "rays is 15, expected a whole number in [16, 65536]");
    EXPECT_EQ(words("rays", "64.5"), "rays is 64.5, expected a whole number in [16, 65536]");
    EXPECT_EQ(words("error_tolerance", "1.50"), "error_tolerance is 1.5, expected a value in (0, 1]");
    EXPECT_EQ(words("error_tolerance", "fine"), "error_tolerance is fine, expected a value in (0, 1]");
    EXPECT_EQ(words("seed", "-1"), "seed is -1, expected a whole number in [0, 18446744073709551615]");
    EXPECT_EQ(words("splat", "cubes"), "splat is cubes, expected one of auto, quads, tiles, gpu-tiles");
    EXPECT_NE(words("with_effects", "magic").find("with_effects is magic, expected one of emission, "),
              std::string::npos);
    EXPECT_EQ(words("min_reach", "80"), "min_reach is 80, expected at most max_reach, which is 60");
    EXPECT_EQ(words("target_error", "500%"), "target_error is 5, expected a value in (0, 1]");
}

TEST(OptionTable, UnitsMayFollowWhereTheyAreCommon)
{
    RenderOptions options;
    for (const auto& [text, value] : {std::pair{"5%", 0.05}, {"0.05", 0.05}, {"100%", 1.0}}) {
        set_from_text(find_option("target_error"), options, text);
        EXPECT_EQ(target_error(options), value) << text;
    }
    for (const auto& [text, value] : {std::pair{"20", 20.0}, {"20s", 20.0}, {"2m", 120.0}, {"0.5m", 30.0}}) {
        set_from_text(find_option("budget_seconds"), options, text);
        EXPECT_EQ(budget_seconds(options), value) << text;
    }
    for (const char* text : {"%", "5%%", "5 %", "%5", "5s"})
        EXPECT_NE(judge(find_option("target_error"), text).by_text, "") << text;
    for (const char* text : {"s", "5h", "5%", "1ms"})
        EXPECT_NE(judge(find_option("budget_seconds"), text).by_text, "") << text;
}

TEST(OptionTable, QualitiesAreNotMixed)
{
    const auto mixture = [](const std::vector<const char*>& keys) {
        std::vector<const OptionInfo*> given;
        for (const char* key : keys) given.push_back(&find_option(key));
        return refusal([&] { check_quality(given); });
    };
    EXPECT_EQ(mixture({"rays", "error_tolerance", "seed"}), "");
    EXPECT_EQ(mixture({"budget_seconds", "overlap"}), "");
    const std::string expected = ", expected one of settings, target_error, budget_seconds, target_indirect_error";
    EXPECT_EQ(mixture({"rays", "budget_seconds"}), "quality is settings and budget_seconds" + expected);

    const char* settings[] = {"--accuracy=0.1", "--rays=64", "--noise=0.1"};
    for (const std::string setting : settings) {
        const std::string name = setting.substr(0, setting.find('='));
        expect_on_command_line({setting, "--budget=5s"}, mixture({"rays", "budget_seconds"}));
        expect_on_command_line({setting, "--target-error=5%"}, mixture({"rays", "target_error"}));
        EXPECT_NE(said_to({setting, "--budget=5s"}).find("--budget, " + name + ": "), std::string::npos);
    }
    expect_on_command_line({"--target-error=5%", "--budget=5s"}, mixture({"target_error", "budget_seconds"}));
    expect_on_command_line({"--target-error=5%", "--budget=5s", "--rays=64"},
                           mixture({"target_error", "budget_seconds", "rays"}));
    expect_on_command_line({"--target-error=indirect=5%", "--budget=5s"},
                           mixture({"target_indirect_error", "budget_seconds"}));
    expect_on_command_line({"--accuracy=0.1", "--rays=64", "--noise=0.1"}, "");
}

TEST(OptionTable, ATargetIsThePicturesOrThatOfItsIndirectLight)
{
    RenderOptions options;
    for (const auto& [text, picture] : {std::pair{"7%", true}, {"indirect=7%", false}, {"indirect=0.07", false}}) {
        set_from_text(option_for(find_option("target_error"), text), options, text);
        EXPECT_NEAR(target_error(options), 0.07, 1e-12) << text;
        EXPECT_EQ(aims_at_picture(options), picture) << text;
        expect_on_command_line({std::string("--target-error=") + text}, "");
    }
    EXPECT_EQ(text_of(find_option("target_indirect_error"), options), "indirect=0.07");
    EXPECT_EQ(text_of(find_option("target_error"), options), "");
    EXPECT_NE(said_to({"--target-error=direct=5%"}), "");
    EXPECT_NE(said_to({"--target-error=indirect="}), "");
}

TEST(OptionTable, AnEffectIsNotBothSimulatedAndLeftOut)
{
    RenderOptions options;
    options.effects.with.set(Effect::highlights);
    options.effects.without.set(Effect::highlights);
    const std::string words = refusal([&] { validate(options); });
    EXPECT_EQ(words, "without_effects is highlights, expected none of with_effects");
    EXPECT_EQ(refusal([&] { service::from_message(service::to_message(options)); }), words);
    expect_on_command_line({"--with=highlights", "--without=highlights"}, words);
    expect_on_command_line({"--with=emission,highlights", "--without=peeling", "--without=highlights"}, words);
    expect_on_command_line({"--effects=emission,highlights", "--without=highlights"}, "");
}

TEST(OptionTable, EveryMemberOfTheOptionsIsInIt)
{
    // Taken apart by all its members: one more, and this does not compile until somebody looks at the table.
    const auto& [width, height, crop, f_stop, focus, aa, bounces, quality, min_reach, max_reach, gradient_limit,
                 area_samples, penumbra_samples, lamp_picks, lobe_rays, overlap, splat, gather, device, denoise,
                 effects, layers, motion, seed] = RenderOptions{};
    static_cast<void>(layers), static_cast<void>(motion);  // what is made, not how
    const std::size_t in_quality = 4 + 1 + 1 + 1, in_effects = 2, plain = 20;
    EXPECT_EQ(option_table().size(), plain + in_quality + in_effects);
    for (const OptionInfo& option : option_table()) {
        EXPECT_EQ(&find_option(option.key), &option) << option.key << " is there twice";
        EXPECT_FALSE(option.help.empty()) << option.key;
        EXPECT_TRUE(option.help.back() != '.' && std::isupper(option.help.front()) != 0) << option.key;
    }
}

TEST(OptionTable, TextsReadBackAsTheSameValue)
{
    RenderOptions options;
    options.quality = QualitySettings{.error_tolerance = 1.0f / 3.0f, .rays = 77, .noise_target = 1e-3f};
    options.seed = std::numeric_limits<std::uint64_t>::max();
    options.crop = Crop{1, 2, 30, 40};
    options.f_stop = 2.8, options.focus = 1.0 / 3.0;
    options.effects.with.set(Effect::highlights);
    options.effects.with.set(Effect::emission);
    RenderOptions back;
    for (const OptionInfo& option : option_table()) {
        const std::string text = text_of(option, options);
        if (!text.empty()) set_from_text(option, back, text);
    }
    for (const OptionInfo& option : option_table()) EXPECT_EQ(text_of(option, back), text_of(option, options));
    const auto listed = list_options(options);
    EXPECT_EQ(listed.front(), (std::pair<std::string, std::string>("size", "1000x1000")));
    EXPECT_EQ(listed.at(1), (std::pair<std::string, std::string>("crop", "1,2,30,40")));
    for (const auto& [name, text] : listed) EXPECT_NE(name, "budget");
    for (const auto& [name, text] : list_options(RenderOptions{})) EXPECT_NE(name, "crop") << "the whole picture";
}

/// What --help-all says, as if in one line.
std::string help_of(const std::string& command)
{
    std::istringstream words(rcsplat({command, "--help-all"}).out);
    std::string line, word;
    while (words >> word) line.append(" ").append(word);
    return line + " ";
}

TEST(OptionTable, HelpShowsUnitRangeAndDefault)
{
    const std::string help = help_of("render");
    for (const OptionInfo& option : option_table())
        EXPECT_NE(help.find(" " + std::string(option.name) + " "), std::string::npos) << option.name;
    for (const char* part : {"(default 128)", "[16, 65536]", "(0, 1]", "[px]", " auto|quads|tiles|gpu-tiles ",
                             "(default 1000x1000)", "Quality"})
        EXPECT_NE(help.find(part), std::string::npos) << part;
    EXPECT_EQ(help.find("auto-exposure"), std::string::npos);
}

TEST(OptionTable, CommandsWithNumbersOfTheirOwnSayTheSameOfTheSame)
{
    const TemporaryFolder folder;
    const auto words = [&](const std::string& command, std::string_view key) {
        const OptionInfo& option = find_option(key);
        const std::string help = help_of(command);
        EXPECT_NE(help.find(option.help), std::string::npos) << command << ' ' << key;
        EXPECT_NE(help.find(interval_text(option.range, true)), std::string::npos) << command << ' ' << key;
        for (const char* value : {"-1", "1e20", "many"}) {
            const std::string said = refusal([&] {
                RenderOptions options;
                set_from_text(option, options, value);
            });
            const auto outcome =
                rcsplat({command, "demo:cornell", "-o", folder / "a.exr", std::string(option.name), value});
            EXPECT_EQ(outcome.code, test::kBadUsage);
            EXPECT_NE(outcome.err.find(said), std::string::npos) << outcome.err << said;
        }
    };
    words("reference", "bounces");
    words("reference", "seed");
    words("accuracy", "aa");
    words("accuracy", "seed");
    // Without bounces there is nothing to measure.
    EXPECT_NE(help_of("accuracy").find(std::string(find_option("bounces").help) + ", in [1, 64]"), std::string::npos);
}

}  // namespace
}  // namespace rcs
