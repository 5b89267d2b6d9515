#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "rcs/error.h"
#include "rcs/log.h"
#include "rcs/scene_choice.h"

namespace rcs::service {

struct Size {
    int width = 0;   ///< [px]
    int height = 0;  ///< [px]
};

// Texts to values. Each throws rcs::Error bad_argument; they also are the checks of the options above, so
// that a command line that parsed cannot fail here, and CLI11 puts the option's name before the message.
/// "640x480", each as the option table says.
Size parse_size(const std::string& text);
double parse_time(const std::string& text);
/// A time [s]; with a sign before it, from the picture's own.
struct MotionTime {
    double seconds = 0.0;
    bool is_relative = false;
};
MotionTime parse_motion_time(const std::string& text);
/// Frames a second: "24", "23.976" or "24000/1001".
double parse_fps(const std::string& text);
/// "1.5,0,-2".
glm::dvec3 parse_place(const std::string& text);
/// "0.1,-0.5", to the right and up, in heights of the picture.
glm::dvec2 parse_lens_shift(const std::string& text);
/// What --environment says: nothing, a constant, or the name of a file.
EnvironmentChoice parse_environment(const std::string& text);
std::optional<float> parse_exposure(const std::string& text);
LogLevel parse_log_level(const std::string& text);

/// "a, b, c".
std::string listed(const std::vector<std::string>& names);
/// What is wrong with a name that has to be one of `names`, and which was probably meant; or nothing.
/// @param kind  "layer"
std::string check_name(const std::string& kind, const std::string& name, const std::vector<std::string>& names);

/// One of the functions above as a check: what is wrong with `text`, or nothing.
template <typename Parse>
std::string check_text(const Parse& parse, const std::string& text)
{
    try {
        parse(text);
        return {};
    } catch (const Error& e) {
        return e.what();
    }
}

/// The same as a check of an option.
template <typename Parse>
std::function<std::string(const std::string&)> checked_by(const Parse& parse)
{
    return [parse](const std::string& text) { return check_text(parse, text); };
}

}  // namespace rcs::service
