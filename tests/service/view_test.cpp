// What a page of the live view may say, who is let in, and what waits between its two threads.
#include <chrono>
#include <string>
#include <thread>
#include <variant>

#include <gtest/gtest.h>

#include "rcs/error.h"
#include "view/desk.h"
#include "view/door.h"
#include "view/look.h"

namespace rcs::service {
namespace {

using namespace std::chrono_literals;

std::string look_message(const std::string& field = "", const std::string& value = "")
{
    std::string text = "{\"look\":{";
    for (const auto& [name, usual] : {std::pair("number", "7"),
                                      {"eye", "[1,2,3]"},
                                      {"target", "[0,2,3]"},
                                      {"up", "[0,1,0]"},
                                      {"fov", "45"},
                                      {"error", "10"},
                                      {"exposure", "null"},
                                      {"bounces", "1"},
                                      {"layer", "\"picture\""}})
        text.append(text.back() == '{' ? "" : ",")
            .append("\"")
            .append(name)
            .append("\":")
            .append(field == name ? value : usual);
    return text + "}}";
}

std::string refusal_of(const std::string& message)
{
    try {
        parse_wish(message);
        return "";
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), ErrorCode::bad_argument);
        return e.what();
    }
}

TEST(Wish, ALookIsReadWithAllItSays)
{
    const Look look = std::get<Look>(parse_wish(look_message("exposure", "-1.5")));
    EXPECT_EQ(look.number, 7u);
    EXPECT_EQ(look.eye, glm::dvec3(1.0, 2.0, 3.0));
    EXPECT_EQ(look.target, glm::dvec3(0.0, 2.0, 3.0));
    EXPECT_EQ(look.exposure, -1.5);
    EXPECT_EQ(look.layer, ViewLayer::picture);
    EXPECT_FALSE(std::get<Look>(parse_wish(look_message())).exposure);
}

TEST(Wish, OtherMessagesAreRead)
{
    EXPECT_EQ(std::get<Shown>(parse_wish("{\"shown\":12}")).frame, 12u);
    EXPECT_EQ(std::get<Pick>(parse_wish("{\"pick\":{\"x\":0.25,\"y\":1}}")).x, 0.25);
    EXPECT_TRUE(std::holds_alternative<SendJob>(parse_wish("{\"job\":true}")));
    EXPECT_TRUE(std::holds_alternative<Afresh>(parse_wish("{\"afresh\":true}")));
}

TEST(Wish, WhatIsWrongIsNamedWithItsRange)
{
    EXPECT_EQ(refusal_of(look_message("fov", "180")), "fov is 180, expected a number from 0 to 179");
    EXPECT_EQ(refusal_of(look_message("fov", "0")), "fov is 0, expected more than 0");
    EXPECT_EQ(refusal_of(look_message("bounces", "1.5")), "bounces is 1.5, expected a whole number");
    EXPECT_EQ(refusal_of(look_message("eye", "[1,2]")), "eye is [1,2], expected three numbers");
    EXPECT_EQ(refusal_of(look_message("layer", "\"all\"")),
              "layer is all, expected picture, indirect, direct, error or records");
    EXPECT_NE(refusal_of(look_message("target", "[1,2,3]")), "") << "it is the eye";
    EXPECT_NE(refusal_of(look_message("target", "[1,9,3]")), "") << "straight up";
    EXPECT_NE(refusal_of(look_message("error", "1e999")), "");
    EXPECT_EQ(refusal_of("{\"shown\":-1}"), "shown is -1, expected a number from 0 to 9007199254740992");
}

TEST(Wish, AnythingElseIsRefusedInOneShortLine)
{
    const std::string deep(4000, '['), long_name(3000, 'x');
    for (const std::string& message :
         {std::string(), std::string("{}"), std::string("[1]"), std::string("{\"look\":1}"),
          std::string("{\"a\":1,\"b\":2}"), std::string("{\"fly\":1}"), deep, "{\"" + long_name + "\":1}",
          std::string("{\"shown\":\"\xff\xfe\"}"), look_message("layer", "\"a\\nb\"")}) {
        const std::string why = refusal_of(message);
        EXPECT_NE(why, "");
        EXPECT_LE(why.size(), 120u);
        EXPECT_EQ(why.find('\n'), why.npos);
    }
}

TEST(Wish, ExposureAndLayerLeaveThePictureAsItIs)
{
    Look a, b;
    b.exposure = 2.0, b.layer = ViewLayer::error, b.number = 9;
    EXPECT_TRUE(same_picture(a, b));
    b.error = 5.0;
    EXPECT_FALSE(same_picture(a, b));
}

const Door kDoor{"0123456789abcdef0123456789abcdef", 4711};
const std::string kPath = "/" + kDoor.token + "/";

bool lets_in(const Asked& asked) { return answer_door(kDoor, asked).refusal.empty(); }

TEST(Door, APageIsServedUnderTheTokenToThisMachinesNamesAlone)
{
    for (const char* host : {"127.0.0.1:4711", "localhost:4711"})
        EXPECT_TRUE(lets_in({"GET", kPath, host, "", false})) << host;
    for (const char* host : {"", "127.0.0.1", "127.0.0.1:4712", "evil.example:4711", "localhost.evil.example:4711"})
        EXPECT_FALSE(lets_in({"GET", kPath, host, "", false})) << host;
    EXPECT_EQ(answer_door(kDoor, {"GET", kPath + "page.js", "localhost:4711", "", false}).room, Room::script);
    for (const std::string& path : {std::string("/"), std::string(""), "/" + kDoor.token, kPath + "page.jsx",
                                    kPath + "../x", std::string("/0123456789abcdef0123456789abcdee/"), "/x" + kPath})
        EXPECT_FALSE(lets_in({"GET", path, "localhost:4711", "", false})) << path;
    EXPECT_FALSE(lets_in({"POST", kPath, "localhost:4711", "", false}));
}

TEST(Door, ASocketIsForThePageThatIsServedHere)
{
    const std::string path = kPath + "socket";
    EXPECT_TRUE(lets_in({"GET", path, "127.0.0.1:4711", "http://127.0.0.1:4711", true}));
    for (const char* origin : {"", "null", "http://localhost:4711", "https://127.0.0.1:4711", "http://127.0.0.1:4712",
                               "http://evil.example", "http://127.0.0.1:4711.evil.example"})
        EXPECT_FALSE(lets_in({"GET", path, "127.0.0.1:4711", origin, true})) << origin;
    EXPECT_FALSE(lets_in({"GET", path, "127.0.0.1:4711", "http://127.0.0.1:4711", false})) << "no upgrade";
    EXPECT_FALSE(lets_in({"GET", kPath, "127.0.0.1:4711", "http://127.0.0.1:4711", true})) << "the page is none";
}

TEST(Door, TokensAreRandomAndCompareWhole)
{
    const std::string a = random_token(), b = random_token();
    EXPECT_EQ(a.size(), 32u);
    EXPECT_EQ(a.find_first_not_of("0123456789abcdef"), a.npos);
    EXPECT_NE(a, b);
    EXPECT_TRUE(same_secret(a, a));
    EXPECT_FALSE(same_secret(a, b));
    EXPECT_FALSE(same_secret(a + "0", a));
    EXPECT_FALSE(same_secret("", a));
}

Look numbered(std::uint64_t number)
{
    Look look;
    look.number = number;
    return look;
}

TEST(Desk, TheNewestLookTakesThePlaceOfThoseBefore)
{
    Desk desk;
    desk.come();
    desk.put(numbered(1));
    desk.put(numbered(2));
    EXPECT_TRUE(desk.is_called());
    EXPECT_EQ(desk.wait({}, {}), Desk::Turn::look);
    bool afresh = true;
    EXPECT_EQ(desk.take(afresh)->number, 2u);
    EXPECT_FALSE(afresh);
    EXPECT_FALSE(desk.take(afresh));
    EXPECT_FALSE(desk.is_called());
}

TEST(Desk, ALookWaitsForTheFrameThatIsOnItsWay)
{
    Desk desk;
    desk.come();
    desk.sent(5);
    desk.put(numbered(1));
    EXPECT_FALSE(desk.may_send());
    desk.put(Shown{4});
    EXPECT_FALSE(desk.may_send()) << "another frame";
    std::jthread page([&] {
        std::this_thread::sleep_for(50ms);
        desk.put(Shown{5});
    });
    EXPECT_EQ(desk.wait({}, {}), Desk::Turn::look);
    EXPECT_TRUE(desk.may_send());
}

TEST(Desk, RestsAtItsTimeUnlessThereIsALook)
{
    Desk desk;
    desk.come();
    const auto now = Desk::Clock::now();
    EXPECT_EQ(desk.wait(now + 30ms, {}), Desk::Turn::rest);
    EXPECT_GE(Desk::Clock::now(), now + 30ms);
    desk.put(numbered(1));
    EXPECT_EQ(desk.wait(now, {}), Desk::Turn::look);
}

TEST(Desk, LeavesAfterTheLastPageUnlessAnotherComes)
{
    Desk desk;
    desk.come();
    desk.go();
    EXPECT_TRUE(desk.is_called());
    EXPECT_FALSE(desk.wait_to_send());
    const auto now = Desk::Clock::now();
    EXPECT_EQ(desk.wait(now, 60ms), Desk::Turn::leave);
    EXPECT_GE(Desk::Clock::now(), now + 50ms);
    desk.come();
    desk.put(numbered(1));
    EXPECT_EQ(desk.wait(now, 0ms), Desk::Turn::look);
}

TEST(Desk, AfreshRendersTheLastLookAgain)
{
    Desk desk;
    desk.come();
    desk.put_afresh();
    EXPECT_FALSE(desk.is_called()) << "there is no look yet";
    bool afresh = false;
    desk.put(numbered(3));
    desk.take(afresh);
    desk.put_afresh();
    EXPECT_EQ(desk.take(afresh)->number, 3u);
    EXPECT_TRUE(afresh);
}

}  // namespace
}  // namespace rcs::service
