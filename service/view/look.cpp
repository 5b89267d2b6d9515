#include "view/look.h"

#include <array>
#include <cmath>
#include <string>

#include <nlohmann/json.hpp>

#include "process/printable.h"
#include "rcs/error.h"

namespace rcs::service {
namespace {

using Json = nlohmann::json;

constexpr std::array<std::string_view, static_cast<std::size_t>(ViewLayer::count)> kLayerNames = {
    "picture", "indirect", "direct", "error", "records"};
constexpr double kFarthest = 1e12;                 // a camera stands no farther from zero [m]
constexpr double kMostWhole = 9007199254740992.0;  // that a page's numbers count to

[[noreturn]] void refuse(const std::string& field, const std::string& value, const std::string& expected)
{
    constexpr std::size_t kLongest = 32;  // of a value: the reason has to fit into a closing frame
    throw Error(ErrorCode::bad_argument,
                field + " is " + printable(value.substr(0, kLongest)) + ", expected " + expected);
}

const Json& member(const Json& object, const std::string& name)
{
    const auto found = object.find(name);
    if (found == object.end()) refuse(name, "missing", "a value");
    return *found;
}

double number(const Json& value, const std::string& field, double least, double most)
{
    const std::string range = "a number from " + std::to_string(static_cast<long long>(least)) + " to " +
                              std::to_string(static_cast<long long>(most));
    if (!value.is_number()) refuse(field, value.dump(-1, ' ', false, Json::error_handler_t::replace), range);
    const double found = value.get<double>();
    if (!(found >= least && found <= most)) refuse(field, value.dump(), range);
    return found;
}

double above_zero(const Json& value, const std::string& field, double most)
{
    const double found = number(value, field, 0.0, most);
    if (!(found > 0.0)) refuse(field, value.dump(), "more than 0");
    return found;
}

std::uint64_t count_of(const Json& value, const std::string& field)
{
    const double found = number(value, field, 0.0, kMostWhole);
    if (found != std::floor(found)) refuse(field, value.dump(), "a whole number");
    return static_cast<std::uint64_t>(found);
}

glm::dvec3 place(const Json& look, const std::string& field)
{
    const Json& value = member(look, field);
    if (!value.is_array() || value.size() != 3)
        refuse(field, value.dump(-1, ' ', false, Json::error_handler_t::replace), "three numbers");
    glm::dvec3 found{};
    for (int i = 0; i < 3; ++i) found[i] = number(value[static_cast<std::size_t>(i)], field, -kFarthest, kFarthest);
    return found;
}

ViewLayer layer(const Json& value)
{
    const std::string name = value.is_string() ? value.get<std::string>() : value.dump();
    for (std::size_t i = 0; i < kLayerNames.size(); ++i)
        if (kLayerNames[i] == name) return static_cast<ViewLayer>(i);
    refuse("layer", name, "picture, indirect, direct, error or records");
}

Look parse_look(const Json& json)
{
    Look look;
    look.number = count_of(member(json, "number"), "number");
    look.eye = place(json, "eye");
    look.target = place(json, "target");
    look.up = place(json, "up");
    look.fov = above_zero(member(json, "fov"), "fov", 179.0);
    look.error = above_zero(member(json, "error"), "error", 100.0);
    if (const Json& exposure = member(json, "exposure"); !exposure.is_null())
        look.exposure = number(exposure, "exposure", -64.0, 64.0);
    const double bounces = number(member(json, "bounces"), "bounces", 0.0, 64.0);
    if (bounces != std::floor(bounces)) refuse("bounces", json["bounces"].dump(), "a whole number");
    look.bounces = static_cast<int>(bounces);
    look.layer = layer(member(json, "layer"));
    const glm::dvec3 forward = look.target - look.eye;
    if (!(glm::length(glm::cross(forward, look.up)) > 1e-9 * glm::length(forward) * glm::length(look.up)))
        refuse("target", "at the eye, or straight up or down from it", "another direction");
    return look;
}

}  // namespace

std::string_view name_of(ViewLayer layer) { return kLayerNames[static_cast<std::size_t>(layer)]; }

bool same_picture(const Look& a, const Look& b)
{
    return a.eye == b.eye && a.target == b.target && a.up == b.up && a.fov == b.fov && a.error == b.error &&
           a.bounces == b.bounces;
}

Wish parse_wish(std::string_view text)
{
    const Json json = Json::parse(text, nullptr, false);
    if (!json.is_object() || json.size() != 1)
        throw Error(ErrorCode::bad_argument, "a message is no JSON object with one member");
    const auto entry = json.begin();
    const std::string& what = entry.key();
    const Json& value = entry.value();
    if (what == "look" || what == "pick") {
        if (!value.is_object()) refuse(what, "no object", "an object");
        if (what == "look") return parse_look(value);
        return Pick{number(member(value, "x"), "x", 0.0, 1.0), number(member(value, "y"), "y", 0.0, 1.0)};
    }
    if (what == "shown") return Shown{count_of(value, "shown")};
    if (what == "job") return SendJob{};
    if (what == "afresh") return Afresh{};
    refuse("a message", what, "look, shown, pick, job or afresh");
}

}  // namespace rcs::service
