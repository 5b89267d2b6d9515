#include "rcs/camera_path.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>

#include <glm/gtc/constants.hpp>

#include "rcs/error.h"
#include "rcs/number_range.h"

namespace rcs {
namespace {

/// As scenes may reach.
constexpr NumberRange kPlaces{-1e18, 1e18};

[[noreturn]] void refuse(const std::string& what) { throw Error(ErrorCode::bad_argument, what); }

void check_places(const std::string& field, glm::dvec3 p)
{
    for (const double part : {p.x, p.y, p.z}) check_number(field, part, kPlaces);
}

/// Refuses what no camera can look along.
void check_aim(const std::string& key, glm::dvec3 eye, glm::dvec3 target, glm::dvec3 up)
{
    constexpr double kLeastSine = 1e-6;  // of the angle between the way up and the way ahead
    const glm::dvec3 ahead = target - eye;
    if (!(glm::length(ahead) > 1e-12 * glm::length(eye))) refuse(key + "target is the same place as eye");
    if (!(glm::length(up) > 0.0)) refuse(key + "up is 0,0,0, expected a direction");
    if (!(glm::length(glm::cross(glm::normalize(ahead), glm::normalize(up))) > kLeastSine))
        refuse(key + "up runs along the way from eye to target, expected another direction");
}

/// Whether a stretch of the spline goes on from the key before.
bool goes_on(const CameraPath& path, std::size_t key)
{
    return key > 0 && key < path.keys.size() && !path.keys[key].cut && path.keys[key].camera.empty() &&
           path.keys[key - 1].camera.empty();
}

/// The slope of a value at a key.
template <typename Value>
Value tangent(const CameraPath& path, std::size_t key, Value CameraKey::* value)
{
    const CameraKey& from = path.keys[goes_on(path, key) ? key - 1 : key];
    const CameraKey& to = path.keys[goes_on(path, key + 1) ? key + 1 : key];
    return (to.*value - from.*value) / (to.time - from.time);
}

/// The value between a key and the next one. @param t  part of the way, in [0, 1)
template <typename Value>
Value between(const CameraPath& path, std::size_t key, double t, Value CameraKey::* value)
{
    const CameraKey &from = path.keys[key], &to = path.keys[key + 1];
    const double span = to.time - from.time, t2 = t * t, t3 = t2 * t;
    return (2 * t3 - 3 * t2 + 1) * (from.*value) + span * (t3 - 2 * t2 + t) * tangent(path, key, value) +
           (3 * t2 - 2 * t3) * (to.*value) + span * (t3 - t2) * tangent(path, key + 1, value);
}

}  // namespace

void validate(const CameraPath& path)
{
    if (path.keys.empty()) refuse("keys is empty, expected at least one");
    for (std::size_t i = 0; i < path.keys.size(); ++i) {
        const CameraKey& key = path.keys[i];
        const std::string name = "keys[" + std::to_string(i) + "].";
        check_number(name + "time", key.time, kPlaces);
        if (i > 0 && !(key.time > path.keys[i - 1].time))
            refuse(name + "time is " + number_text(key.time) + ", expected more than that of the key before, " +
                   number_text(path.keys[i - 1].time));
        if (!key.camera.empty()) continue;
        check_places(name + "eye", key.eye);
        check_places(name + "target", key.target);
        check_places(name + "up", key.up);
        if (!(key.yfov > 0.0 && key.yfov < glm::pi<double>()))
            refuse(name + "fov is " + number_text(glm::degrees(key.yfov)) + " degrees, expected a value in (0, 180)");
        check_aim(name, key.eye, key.target, key.up);
    }
}

CameraChoice camera_at(const CameraPath& path, double time)
{
    const auto next = std::upper_bound(path.keys.begin(), path.keys.end(), time,
                                       [](double t, const CameraKey& key) { return t < key.time; });
    const auto passed = static_cast<std::size_t>(std::distance(path.keys.begin(), next));
    const std::size_t key = passed == 0 ? 0 : passed - 1;
    CameraKey now = path.keys[key];
    if (!now.camera.empty()) return {now.camera, {}, {}};
    if (passed > 0 && goes_on(path, key + 1)) {
        const double t = (time - now.time) / (path.keys[key + 1].time - now.time);
        const auto [least, most] = std::minmax(now.yfov, path.keys[key + 1].yfov);
        now.eye = between(path, key, t, &CameraKey::eye);
        now.target = between(path, key, t, &CameraKey::target);
        now.up = between(path, key, t, &CameraKey::up);
        now.yfov = std::clamp(between(path, key, t, &CameraKey::yfov), least, most);
    }
    check_aim("the camera path at " + number_text(time) + " s: ", now.eye, now.target, now.up);
    return {{}, look_at_camera("path", now.eye, now.target, now.yfov, now.up), {}};
}

}  // namespace rcs
