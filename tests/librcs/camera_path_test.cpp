#include "rcs/camera_path.h"

#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <glm/gtc/constants.hpp>

#include "rcs/error.h"
#include "support/temporary_folder.h"

namespace rcs {
namespace {

constexpr double kRounding = 1e-12;

CameraKey key_at(double time, double x)
{
    CameraKey key;
    key.time = time;
    key.eye = {x, 0.0, 10.0};
    key.target = {x, 0.0, 0.0};
    return key;
}

double x_at(const CameraPath& path, double time)
{
    const CameraChoice choice = camera_at(path, time);
    return choice.given ? camera_position(*choice.given).x : -1000.0;
}

TEST(CameraPath, FollowsASplineThroughItsKeys)
{
    const CameraPath path{{key_at(0.0, 0.0), key_at(1.0, 2.0), key_at(3.0, 3.0), key_at(4.0, 7.0)}};
    for (const CameraKey& key : path.keys) EXPECT_NEAR(x_at(path, key.time), key.eye.x, kRounding);
    // By hand. Slopes: 2 at the first key, (3 - 0) / 3 = 1 at the second, (7 - 2) / 3 at the third, 4 at the last.
    EXPECT_NEAR(x_at(path, 0.5), 0.5 * (0.0 + 2.0) + 1.0 * (2.0 - 1.0) / 8.0, kRounding);
    EXPECT_NEAR(x_at(path, 2.0), 0.5 * (2.0 + 3.0) + 2.0 * (1.0 - 5.0 / 3.0) / 8.0, kRounding);
    // A quarter of the way: h00 = 54/64, h10 = 9/64, h01 = 10/64, h11 = -3/64.
    EXPECT_NEAR(x_at(path, 3.25), (54.0 * 3.0 + 9.0 * 5.0 / 3.0 + 10.0 * 7.0 - 3.0 * 4.0) / 64.0, kRounding);
    EXPECT_EQ(x_at(path, -5.0), 0.0) << "held before its first key";
    EXPECT_EQ(x_at(path, 99.0), 7.0) << "and after its last";
}

TEST(CameraPath, GoesStraightBetweenTwoKeys)
{
    const CameraPath path{{key_at(1.0, 4.0), key_at(3.0, 5.0)}};
    EXPECT_NEAR(x_at(path, 1.5), 4.25, kRounding);
}

TEST(CameraPath, CutsWithoutALookAhead)
{
    CameraPath path{{key_at(0.0, 0.0), key_at(1.0, 1.0), key_at(2.0, 50.0), key_at(3.0, 50.0)}};
    path.keys[2].cut = true;
    EXPECT_NEAR(x_at(path, 0.5), 0.5, kRounding) << "the spline ends before the cut, and knows nothing beyond";
    EXPECT_EQ(x_at(path, 1.999), 1.0) << "the last key before a cut holds";
    EXPECT_EQ(x_at(path, 2.0), 50.0) << "at the very time of the key";
    EXPECT_EQ(x_at(path, 2.5), 50.0);
}

TEST(CameraPath, NamesTheScenesCameras)
{
    CameraPath path{{key_at(0.0, 0.0), key_at(1.0, 1.0), key_at(2.0, 5.0)}};
    path.keys[1] = CameraKey{};
    path.keys[1].time = 1.0;
    path.keys[1].camera = "court";
    EXPECT_EQ(x_at(path, 0.9), 0.0);
    EXPECT_EQ(camera_at(path, 1.0).name, "court");
    EXPECT_EQ(camera_at(path, 1.9).name, "court");
    EXPECT_FALSE(camera_at(path, 1.9).given);
    EXPECT_EQ(x_at(path, 2.0), 5.0);
}

TEST(CameraPath, KeepsTheFieldOfViewBetweenItsKeys)
{
    CameraPath path{{key_at(0.0, 0.0), key_at(1.0, 0.0), key_at(2.0, 0.0)}};
    path.keys[0].yfov = path.keys[1].yfov = 3.0;
    path.keys[2].yfov = 0.01;
    for (double t = 0.0; t < 2.0; t += 0.05) {
        const double yfov = camera_at(path, t).given->yfov;
        EXPECT_LE(yfov, 3.0) << "the spline would swing over";
        EXPECT_GE(yfov, 0.01);
    }
}

TEST(CameraPath, ReadsItsFile)
{
    const test::TemporaryFolder folder;
    test::write_bytes(folder / "walk.json", R"({"fps": 24, "keys": [
        {"frame": 12, "eye": [1, 2, 3], "target": [0, 0, 0]},
        {"frame": 24, "eye": [4, 5, 6], "target": [0, 1, 0], "up": [0, 0, 1], "fov": 90, "cut": true},
        {"frame": 36, "camera": "court"}]})");
    const CameraPath path = load_camera_path(folder / "walk.json");
    ASSERT_EQ(path.keys.size(), 3u);
    EXPECT_EQ(path.keys[0].time, 0.5);
    EXPECT_EQ(path.keys[0].eye, glm::dvec3(1, 2, 3));
    EXPECT_EQ(path.keys[0].up, glm::dvec3(0, 1, 0));
    EXPECT_FALSE(path.keys[0].cut);
    EXPECT_EQ(path.keys[1].time, 1.0) << "exactly frame / fps";
    EXPECT_EQ(path.keys[1].target, glm::dvec3(0, 1, 0));
    EXPECT_EQ(path.keys[1].up, glm::dvec3(0, 0, 1));
    EXPECT_NEAR(path.keys[1].yfov, glm::half_pi<double>(), kRounding);
    EXPECT_TRUE(path.keys[1].cut);
    EXPECT_EQ(path.keys[2].camera, "court");
}

TEST(CameraPath, NamesEveryMistakeOfItsFile)
{
    const test::TemporaryFolder folder;
    const std::vector<std::pair<std::string, std::string>> mistakes{
        {"walk", "no JSON"},
        {"[]", "it is [], expected an object"},
        {R"({"fps": 0, "keys": []})", "fps is 0, expected frames a second in (0, 1e6]"},
        {R"({"keys": {}})", "it has no array of keys"},
        {R"({"keys": []})", "keys is empty, expected at least one"},
        {R"({"speed": 1, "keys": []})", "it has the unknown field \"speed\", expected some of fps, keys"},
        {R"({"keys": [{"frame": 1, "camera": "a"}]})", "a frame needs fps"},
        {R"({"fps": 24, "keys": [{"time": 1, "camera": "a"}]})", "expected a frame, as the file has fps"},
        {R"({"keys": [{"time": 0, "eye": [0, 0], "target": [0, 0, 0]}]})", "keys[0].eye is [0,0], expected three"},
        {R"({"keys": [{"time": 0, "eye": [0, "b", 0], "target": [0, 0, 0]}]})", "keys[0].eye[1] is \"b\", expected a"},
        {R"({"keys": [{"time": 0, "eye": [0, 0, 1e19], "target": [0, 0, 0]}]})", "keys[0].eye is 1e+19, expected a"},
        {R"({"keys": [{"time": 0, "eye": [1, 1, 1]}]})", "expected an eye and a target"},
        {R"({"keys": [{"time": 0, "eye": [1, 1, 1], "target": [1, 1, 1]}]})", "keys[0].target is the same place"},
        {R"({"keys": [{"time": 0, "eye": [0, 9, 0], "target": [0, 0, 0]}]})", "keys[0].up runs along the way"},
        {R"({"keys": [{"time": 0, "eye": [0, 0, 9], "target": [0, 0, 0], "up": [0, 0, 0]}]})", "keys[0].up is 0,0,0"},
        {R"({"keys": [{"time": 0, "eye": [0, 0, 9], "target": [0, 0, 0], "fov": 180}]})", "keys[0].fov is 180, expect"},
        {R"({"keys": [{"time": 0, "camera": 3}]})", "keys[0].camera is 3, expected the name"},
        {R"({"keys": [{"time": 0, "camera": "a", "cut": true}]})", "not both"},
        {R"({"keys": [{"time": 1, "camera": "a"}, {"time": 1, "camera": "b"}]})", "keys[1].time is 1, expected more"},
    };
    for (const auto& [text, words] : mistakes) {
        test::write_bytes(folder / "walk.json", text);
        try {
            load_camera_path(folder / "walk.json");
            ADD_FAILURE() << text << " was read";
        } catch (const Error& e) {
            EXPECT_EQ(e.code(), ErrorCode::bad_file);
            EXPECT_NE(std::string(e.what()).find(words), std::string::npos) << e.what() << " does not say " << words;
            EXPECT_NE(std::string(e.what()).find("walk.json"), std::string::npos) << e.what();
        }
    }
}

TEST(CameraPath, RefusesWhatMeetsItsTargetOnTheWay)
{
    CameraPath path{{key_at(0.0, 0.0), key_at(1.0, 0.0)}};
    path.keys[1].eye.z = -10.0;
    EXPECT_NO_THROW(validate(path));
    EXPECT_THROW(camera_at(path, 0.5), Error);
}

}  // namespace
}  // namespace rcs
