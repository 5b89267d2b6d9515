#include <algorithm>
#include <cmath>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "rcs/camera_path.h"
#include "rcs/error.h"
#include "rcs/number_range.h"

namespace rcs {
namespace {

using Json = nlohmann::json;

/// A value of the file, and what it is called there: "keys[2].eye".
struct Field {
    const Json& value;
    std::string name;

    [[noreturn]] void refuse(const std::string& expected) const
    {
        constexpr std::size_t kLongest = 60;
        std::string text = value.dump(-1, ' ', true, Json::error_handler_t::replace);
        if (text.size() > kLongest) text = text.substr(0, kLongest) + "...";
        throw Error(ErrorCode::bad_file, (name.empty() ? "it" : name) + " is " + text + ", expected " + expected);
    }

    double number() const
    {
        if (!value.is_number()) refuse("a number");
        return value.get<double>();
    }

    glm::dvec3 place() const
    {
        if (!value.is_array() || value.size() != 3) refuse("three numbers");
        glm::dvec3 p(0.0);
        for (int i = 0; i < 3; ++i)
            p[i] = Field{value[static_cast<std::size_t>(i)], name + "[" + std::to_string(i) + "]"}.number();
        return p;
    }

    const Json* find(const char* member) const
    {
        const auto found = value.find(member);
        return found == value.end() ? nullptr : &*found;
    }
    Field member(const char* key) const { return {value.at(key), name.empty() ? key : name + "." + key}; }

    /// An object that has no other members.
    void expect_members(std::initializer_list<std::string_view> names) const
    {
        if (!value.is_object()) refuse("an object");
        for (const auto& [key, ignored] : value.items()) {
            if (std::find(names.begin(), names.end(), key) != names.end()) continue;
            std::string list;
            for (const std::string_view known : names) list.append(list.empty() ? "" : ", ").append(known);
            throw Error(ErrorCode::bad_file, (name.empty() ? "it" : name) + " has the unknown field \"" + key +
                                                 "\", expected some of " + list);
        }
    }
};

/// @param fps  of the file's frames [1/s]; 0: it counts in seconds
double read_time(const Field& key, double fps)
{
    const char* const name = fps > 0.0 ? "frame" : "time";
    if (key.find(name) == nullptr)
        key.refuse(fps > 0.0 ? "a frame, as the file has fps" : "a time [s]; a frame needs fps beside the keys");
    return fps > 0.0 ? key.member(name).number() / fps : key.member(name).number();
}

CameraKey read_key(const Field& field, double fps)
{
    field.expect_members({"time", "frame", "camera", "eye", "target", "up", "fov", "cut"});
    if (field.find("time") != nullptr && field.find("frame") != nullptr) field.refuse("a time or a frame, not both");
    CameraKey key;
    key.time = read_time(field, fps);
    if (field.find("camera") != nullptr) {
        for (const char* own : {"eye", "target", "up", "fov", "cut"})
            if (field.find(own) != nullptr) field.refuse("a camera of the scene or an eye and a target, not both");
        if (!field.value["camera"].is_string() || field.value["camera"].get<std::string>().empty())
            field.member("camera").refuse("the name of one of the scene's cameras");
        key.camera = field.value["camera"].get<std::string>();
        return key;
    }
    if (field.find("eye") == nullptr || field.find("target") == nullptr)
        field.refuse("an eye and a target, or a camera of the scene");
    key.eye = field.member("eye").place();
    key.target = field.member("target").place();
    if (field.find("up") != nullptr) key.up = field.member("up").place();
    if (field.find("fov") != nullptr) {
        const double degrees = field.member("fov").number();
        if (!(degrees > 0.0 && degrees < 180.0)) field.member("fov").refuse("degrees in (0, 180)");
        key.yfov = glm::radians(degrees);
    }
    if (field.find("cut") != nullptr && !field.value["cut"].is_boolean()) field.member("cut").refuse("true or false");
    key.cut = field.find("cut") != nullptr && field.value["cut"].get<bool>();
    return key;
}

CameraPath read_path(const Json& json)
{
    const Field root{json, ""};
    root.expect_members({"fps", "keys"});
    double fps = 0.0;
    if (root.find("fps") != nullptr) {
        fps = root.member("fps").number();
        if (!(fps > 0.0 && fps <= 1e6)) root.member("fps").refuse("frames a second in (0, 1e6]");
    }
    if (root.find("keys") == nullptr || !json["keys"].is_array())
        throw Error(ErrorCode::bad_file, "it has no array of keys");
    CameraPath path;
    for (std::size_t i = 0; i < json["keys"].size(); ++i)
        path.keys.push_back(read_key({json["keys"][i], "keys[" + std::to_string(i) + "]"}, fps));
    validate(path);
    return path;
}

}  // namespace

CameraPath load_camera_path(const std::string& file)
{
    std::ifstream stream(file, std::ios::binary);
    if (!stream) throw Error(ErrorCode::not_found, "camera path '" + file + "' cannot be opened");
    const std::string text{std::istreambuf_iterator<char>(stream), {}};
    try {
        return read_path(Json::parse(text));
    } catch (const Json::exception& e) {
        throw Error(ErrorCode::bad_file, "camera path '" + file + "': no JSON: " + e.what());
    } catch (const Error& e) {
        throw Error(ErrorCode::bad_file, "camera path '" + file + "': " + e.what());
    }
}

}  // namespace rcs
