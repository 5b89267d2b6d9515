#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "batch/flicker.h"
#include "cli/commands.h"
#include "rcs/error.h"
#include "rcs/image_io.h"
#include "rcs/version.h"
#include "report/encoding.h"

namespace rcs::service {
namespace {

struct FlickerArguments {
    std::vector<std::string> files;
    std::string layer = "beauty";
    bool json = false;
};

FlickerFrame read_frame(const std::string& file, const std::string& layer)
{
    const LayeredImage image = read_image(file);
    if (!image.layers.contains(layer)) throw Error(ErrorCode::not_found, file + " has no layer '" + layer + "'");
    return flicker_frame(image, layer);
}

void print_flicker(const FlickerArguments& arguments)
{
    std::vector<FlickerFrame> frames;
    for (const std::string& file : arguments.files) frames.push_back(read_frame(file, arguments.layer));
    const Flicker flicker = measure_flicker(frames);
    if (flicker.points == 0) throw Error(ErrorCode::not_found, "no point can be followed through all of the frames");
    const bool followed =
        std::any_of(frames.begin() + 1, frames.end(), [](const auto& f) { return f.motion.has_value(); });
    if (arguments.json) {
        nlohmann::ordered_json steps = nlohmann::ordered_json::array();
        for (const std::optional<double>& step : flicker.steps)
            steps.push_back(step ? nlohmann::ordered_json(*step) : nlohmann::ordered_json(nullptr));
        const nlohmann::ordered_json sudden = flicker.sudden
                                                  ? nlohmann::ordered_json{{"mean", flicker.sudden->mean},
                                                                           {"median", flicker.sudden->median},
                                                                           {"p95", flicker.sudden->p95}}
                                                  : nlohmann::ordered_json(nullptr);
        const nlohmann::ordered_json json{{"version", kVersion},
                                          {"command", "flicker"},
                                          {"frames", frames.size()},
                                          {"layer", arguments.layer},
                                          {"followed", followed},
                                          {"points", flicker.points},
                                          {"mean", flicker.all.mean},
                                          {"median", flicker.all.median},
                                          {"p95", flicker.all.p95},
                                          {"sudden", sudden},
                                          {"steps", steps}};
        std::printf("%s\n", json.dump(2).c_str());
        return;
    }
    std::printf("%zu frames, layer %s, %zu points %s\n\n", frames.size(), arguments.layer.c_str(), flicker.points,
                followed ? "followed by the layer motion" : "that stay in their pixels");
    std::printf("temporal standard deviation over mean, and what of it is from frame to frame, not steady change\n");
    const auto print = [&](const char* name, double Deviations::* which) {
        std::printf("%-16s%-10s%s\n", name, percent_text(flicker.all.*which).c_str(),
                    flicker.sudden ? percent_text((*flicker.sudden).*which).c_str() : "needs three frames");
    };
    print("mean", &Deviations::mean);
    print("median", &Deviations::median);
    print("p95", &Deviations::p95);
}

}  // namespace

void add_flicker_command(CLI::App& app, Action& action)
{
    CLI::App& command =
        *app.add_subcommand("flicker", "Measures how much light changes in time where nothing says that it should");
    const auto arguments = std::make_shared<FlickerArguments>();
    command
        .add_option("frames", arguments->files,
                    "Pictures in their order; EXR files with the layer motion are followed where things move")
        ->required()
        ->expected(2, 10'000)
        ->type_name("FRAME");
    command.add_option("--layer", arguments->layer, "Layer to look at; irradiance leaves textures out")
        ->type_name("NAME")
        ->capture_default_str();
    command.add_flag("--json", arguments->json, "Print JSON, with the change of each frame from the one before");
    command.footer("Example: rcsplat flicker frames/atrium.*.exr --layer irradiance");
    command.callback([arguments, &action] { action = [arguments] { print_flicker(*arguments); }; });
}

}  // namespace rcs::service
