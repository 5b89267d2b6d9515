#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include <glm/glm.hpp>

namespace rcs::service {

/// What of a picture is shown.
enum class ViewLayer {
    picture,
    indirect,  ///< light of other surfaces and the sky alone
    direct,    ///< light of lamps alone
    error,     ///< the estimate, as heat
    records,   ///< where they lie, as dots
    count
};
/// "picture", "indirect", "direct", "error" or "records".
std::string_view name_of(ViewLayer layer);

/// What a page wants to see.
struct Look {
    std::uint64_t number = 0;                    ///< counted by the page
    glm::dvec3 eye{0.0, 0.0, 1.0}, target{0.0};  ///< in the space of the scene's file [m]
    glm::dvec3 up{0.0, 1.0, 0.0};
    double fov = 45.0;               ///< vertically [degrees], in (0, 179]
    double error = 10.0;             ///< to reach at rest [%], in (0, 100]
    std::optional<double> exposure;  ///< [EV], in [-64, 64]; none: automatic
    int bounces = 1;                 ///< in [0, 64]
    ViewLayer layer = ViewLayer::picture;
};
/// Whether what is rendered is the same, however it is shown.
bool same_picture(const Look& a, const Look& b);

/// A frame has been drawn.
struct Shown {
    std::uint64_t frame = 0;
};
/// What lies at a place of the picture last shown?
struct Pick {
    double x = 0.0, y = 0.0;  ///< parts of its width and height, in [0, 1]
};
/// Send what is seen to the render server.
struct SendJob {};
/// Forget all light, and look again.
struct Afresh {};
using Wish = std::variant<Look, Shown, Pick, SendJob, Afresh>;

/// A message of the page: a JSON object with one member, "look", "shown", "pick", "job" or "afresh".
/// @throws rcs::Error bad_argument: the field, its value and its range, in one line
Wish parse_wish(std::string_view text);

}  // namespace rcs::service
