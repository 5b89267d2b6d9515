#include "cli/batch_settings.h"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "rcs/rcs.h"

namespace rcs::service {
namespace {

/// By its bytes; one that is no file by its name.
std::string ocio_text(const ToneMapper* mapper)
{
    if (mapper == nullptr) return "built-in";
    const std::string name = mapper->config_name();
    std::error_code ignored;
    return std::filesystem::is_regular_file(name, ignored) ? file_hash(name) : name;
}

}  // namespace

bool keeps_records(const BatchArguments& arguments, bool is_animated)
{
    // What changes has to be gathered again, and nobody knows beforehand how much that takes.
    const bool is_hurried = arguments.deadline_ms && is_animated;
    return !arguments.independent && !arguments.on_server && !is_hurried;
}

std::string kept_by(const OutputFile& file)
{
    std::string text = "format " + std::to_string(static_cast<int>(file.options.format));
    if (is_exr(file)) text += " layers";
    for (const std::string& layer : file.options.layers) text += " " + layer;
    return text;
}

Dependencies settings_of_frames(const BatchArguments& arguments, bool is_animated, const RenderOptions& options,
                                const std::vector<OutputFile>& files, const ToneMapper* mapper)
{
    Dependencies settings{{"version", kVersion}};
    for (const auto& [name, text] : list_options(options))
        settings.emplace_back(name, arguments.deadline_ms && name == "target-error" ? "what a deadline leaves" : text);
    settings.emplace_back("effects", arguments.render.effects);
    settings.emplace_back("records of other frames", keeps_records(arguments, is_animated) ? "used" : "none");
    if (!std::all_of(files.begin(), files.end(), is_exr)) {  // those keep what is not shown by any
        settings.emplace_back("colour configuration", ocio_text(mapper));
        settings.emplace_back("display", mapper->display() + ", " + mapper->view());
    }
    if (arguments.shutter.blurs()) settings.emplace_back("shutter", number_text(arguments.shutter.open));
    settings.emplace_back("motion", arguments.render.motion_time + " " + arguments.render.motion_camera);
    return settings;
}

}  // namespace rcs::service
