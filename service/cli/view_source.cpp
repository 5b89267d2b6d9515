#include "cli/view_source.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>
#include <utility>

#include "cli/arguments.h"
#include "rcs/error.h"
#include "rcs/number_range.h"
#include "rcs/scene_choice.h"

namespace rcs::service {
namespace {

// What the page chooses, or what only a view has; with blanks around.
constexpr std::string_view kNotPassedOn =
    " --camera --camera-path --eye --target --up --fov --size --target-error --bounces --exposure --port --open "
    "--keep-open --server --token-file --tls-ca --tls-certificate --tls-key --log-level --help ";

std::string place_text(glm::dvec3 place)
{
    return number_text(place.x) + "," + number_text(place.y) + "," + number_text(place.z);
}

const OptionInfo& option_of(std::string_view name)
{
    for (const OptionInfo& option : option_table())
        if (option.name == name && option.prefix.empty()) return option;
    throw Error(ErrorCode::internal, "there is no option " + std::string(name));
}

std::string given_options(const CLI::App& command)
{
    std::string given;
    for (const CLI::Option* option : command.get_options()) {
        const std::string name = option->get_name();
        if (option->count() == 0 || !name.starts_with("--") || kNotPassedOn.find(" " + name + " ") != kNotPassedOn.npos)
            continue;
        const bool is_flag = option->get_expected_max() == 0;
        for (const std::string& value : option->results())
            given.append(" ").append(name).append(is_flag ? "" : " " + shell_word(value));
    }
    return given;
}

}  // namespace

std::string shell_word(const std::string& text)
{
    constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./:,=+@%";
    if (!text.empty() && text.find_first_not_of(kPlain) == text.npos) return text;
    std::string word = "'";
    for (const char c : text) c == '\'' ? word.append("'\\''") : word.append(1, c);
    return word + "'";
}

ViewSource::ViewSource(const CLI::App& command, RenderArguments arguments)
    : arguments_(std::move(arguments)), given_(given_options(command))
{
}

RenderArguments ViewSource::arguments_of(const Look& look) const
{
    RenderArguments a = arguments_;
    a.scene.camera.clear();
    a.scene.camera_path.clear();
    a.scene.eye = place_text(look.eye);
    a.scene.target = place_text(look.target);
    a.scene.up = look.up == glm::dvec3(0.0, 1.0, 0.0) ? "" : place_text(look.up);
    a.scene.fov = look.fov;
    a.options.of(option_of("--target-error")) = number_text(look.error) + "%";
    a.options.of(option_of("--bounces")) = std::to_string(look.bounces);
    a.output.exposure = look.exposure ? number_text(*look.exposure) : "auto";
    a.output.files = {"view.png"};
    return a;
}

ViewRequest ViewSource::request_of(const Look& look, const Scene& scene) const
{
    RenderArguments a = arguments_of(look);
    ViewRequest request;
    request.camera = choose_camera(scene, camera_choice(a.scene, a.scene.time));
    request.options = final_options(a);
    // Layers change nothing of beauty.
    request.options.layers = {"direct", "indirect", "direct_error", "indirect_error", "depth"};
    const auto option = [&](const char* name, const std::string& value) {
        request.command.append(" ").append(name).append(" ").append(shell_word(value));
    };
    request.command = "rcsplat render " + shell_word(a.scene.scene) + given_;
    option("--eye", a.scene.eye);
    option("--target", a.scene.target);
    if (!a.scene.up.empty()) option("--up", a.scene.up);
    option("--fov", number_text(look.fov));
    option("--size", a.scene.size);
    option("--target-error", a.options.of(option_of("--target-error")));
    option("--bounces", std::to_string(look.bounces));
    option("--exposure", a.output.exposure);
    option("-o", "view.png");
    return request;
}

Look look_of(const Camera& camera, const Scene& scene, double distance)
{
    if (camera.projection != Projection::perspective)
        throw Error(ErrorCode::bad_argument, "camera \"" + camera.name + "\" is orthographic, which a view is not");
    Look look;
    const glm::dmat4& world = camera.world_from_view;
    const glm::dvec3 forward = -glm::dvec3(world[2]), upwards(world[1]);
    look.eye = glm::dvec3(world[3]) + scene.origin;
    look.target = look.eye + distance * forward;
    // A camera that stands upright goes on to do so.
    constexpr double kUpright = 1e-4;
    const glm::dvec3 up(0.0, 1.0, 0.0);
    const bool is_upright = std::abs(world[0].y) < kUpright && upwards.y > kUpright;
    look.up = is_upright ? up : upwards;
    constexpr double kShort = 1e9;  // an angle has no more digits than it was given
    look.fov = std::min(179.0, std::round(kShort * camera.yfov * 180.0 / std::numbers::pi) / kShort);
    return look;
}

}  // namespace rcs::service
