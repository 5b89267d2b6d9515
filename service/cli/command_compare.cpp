#include "cli/commands.h"

#include <cmath>
#include <cstdio>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "output/stats_json.h"
#include "rcs/image_io.h"
#include "rcs/metrics.h"
#include "rcs/version.h"

namespace rcs::service {
namespace {

struct CompareArguments {
    std::string image, reference;
    std::string layer = "beauty";
    bool json = false;
};

void print_table(const CompareArguments& arguments, const ErrorMetrics& metrics)
{
    std::printf("%s against %s, layer %s, %zu pixels", arguments.image.c_str(), arguments.reference.c_str(),
                arguments.layer.c_str(), metrics.pixels);
    if (metrics.not_finite > 0) {
        std::printf(" (%zu more are not finite)", metrics.not_finite);
    }
    std::printf("\n\n");
    for (const MetricRow& row : metric_table()) {
        std::printf("%-15s ", row.words);
        if (std::isnan(metrics.*row.value))
            std::printf("not defined: %s", row.why_undefined);
        else
            std::printf(row.format, row.scale * metrics.*row.value);
        std::printf("\n");
    }
}

void compare(const CompareArguments& arguments)
{
    const LayeredImage image = read_image(arguments.image);
    const LayeredImage reference = read_image(arguments.reference);
    const ErrorMetrics metrics = compare_images(image, reference, arguments.layer);
    if (!arguments.json) {
        print_table(arguments, metrics);
        return;
    }
    nlohmann::ordered_json json{{"version", kVersion},
                                {"command", "compare"},
                                {"image", arguments.image},
                                {"reference", arguments.reference},
                                {"layer", arguments.layer}};
    json.update(to_json(metrics));
    std::printf("%s\n", json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace).c_str());
}

}  // namespace

void add_compare_command(CLI::App& app, Action& action)
{
    CLI::App& command = *app.add_subcommand("compare", "Prints error metrics between two images");
    const auto arguments = std::make_shared<CompareArguments>();
    command.add_option("image", arguments->image, "The image to judge: EXR, PNG, JPEG")->required()->type_name("A");
    command
        .add_option("reference", arguments->reference,
                    "What it should be; one traced with --stride is compared at its own pixels")
        ->required()
        ->type_name("B");
    command.add_option("--layer", arguments->layer, "Layer to compare")->type_name("NAME")->capture_default_str();
    command.add_flag("--json", arguments->json, "Print JSON");
    command.footer(
        "Relative errors are of luminance I against R, with eps = 0.01 mean(R): relMSE is the mean of\n"
        "(I-R)^2 / (R^2 + eps^2); MRE, median and p95 are of |I-R| / (R + eps). FLIP is that of Andersson et al. "
        "2020.\nLow frequency is the mean of |(I-R) / (R + eps)| after a blur of 8 pixels, what one sees as clouds; "
        "beside it\nhow many times that of white noise of the same MRE.\n\n"
        "Example: rcsplat compare picture.exr reference.exr --layer indirect");
    command.callback([arguments, &action] { action = [arguments] { compare(*arguments); }; });
}

}  // namespace rcs::service
