#include "rcs/number_range.h"

#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "rcs/error.h"

namespace rcs {
namespace {

template <typename Number>
std::string refusal(const std::string& text, const NumberRange& range)
{
    try {
        parse_number<Number>("field", text, range);
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), ErrorCode::bad_argument);
        return e.what();
    }
    return "";
}

TEST(NumberRange, SaysWhatItHolds)
{
    EXPECT_EQ(words_of({16, 65536}, true), "a whole number in [16, 65536]");
    EXPECT_EQ(words_of({0, 1, true}, false), "a value in (0, 1]");
    EXPECT_EQ(words_of({0, 18446744073709551616.0}, true), "a whole number in [0, 18446744073709551615]");
}

TEST(NumberText, IsTheShortestThatReadsBackAsTheSame)
{
    EXPECT_EQ(number_text(0.1f), "0.1");
    EXPECT_EQ(number_text(0.1), "0.1");
    EXPECT_EQ(number_text(1e6), "1000000");
    EXPECT_EQ(number_text(-0.5), "-0.5");
    EXPECT_EQ(number_text(-std::numeric_limits<float>::quiet_NaN()), "nan");
    EXPECT_EQ(number_text(std::numeric_limits<double>::infinity()), "inf");
    EXPECT_EQ(number_text(std::numeric_limits<std::uint64_t>::max()), "18446744073709551615");
    for (const float value : {1.0f / 3.0f, 2e-38f, 3.4e38f, std::nextafter(1.0f, 2.0f)})
        EXPECT_EQ(std::stof(number_text(value)), value) << number_text(value);
}

TEST(ParseNumber, TakesWhatLiesInTheRangeAndNothingElse)
{
    const NumberRange range{0, 64};
    for (const auto& [text, value] : {std::pair{"0", 0}, {"64", 64}, {"1e1", 10}, {"+5", 5}, {"7.0", 7}})
        EXPECT_EQ(parse_number<int>("field", text, range), value) << text;
    for (const char* text : {"", "fine", "64.5", "-1", "65", "1e99", "nan", "inf", "-inf", "0x10", " 5", "5 ", "5%",
                             "1,000", "99999999999999999999", "1e", "--5"})
        EXPECT_NE(refusal<int>(text, range).find("expected a whole number in [0, 64]"), std::string::npos) << text;
    EXPECT_EQ(refusal<int>("64.5", range), "field is 64.5, expected a whole number in [0, 64]");
    EXPECT_EQ(refusal<int>("", range), "field is empty, expected a whole number in [0, 64]");

    const NumberRange seeds{0, 18446744073709551616.0};
    EXPECT_EQ(parse_number<std::uint64_t>("field", "18446744073709551615", seeds),
              std::numeric_limits<std::uint64_t>::max());
    EXPECT_EQ(refusal<std::uint64_t>("-1", seeds), "field is -1, expected " + words_of(seeds, true));
    EXPECT_NE(refusal<std::uint64_t>("18446744073709551616", seeds), "");

    const NumberRange open{0, 1, true};
    EXPECT_EQ(parse_number<float>("field", "1", open), 1.0f);
    EXPECT_EQ(refusal<float>("0", open), "field is 0, expected a value in (0, 1]");
    EXPECT_NE(refusal<float>("1e-99", open), "") << "no float but 0";
    EXPECT_EQ(refusal<float>("1e99", open), "field is inf, expected a value in (0, 1]");
    EXPECT_EQ(refusal<double>("nan", open), "field is nan, expected a value in (0, 1]");
}

}  // namespace
}  // namespace rcs
