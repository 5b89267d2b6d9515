#include "cli/commands.h"

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include <CLI/CLI.hpp>

#include "cli/arguments.h"
#include "cli/describe.h"
#include "cli/outputs.h"
#include "cli/progress_bar.h"
#include "cli/run_support.h"
#include "cli/shutter.h"
#include "cli/table_options.h"
#include "rcs/rcs.h"

namespace rcs::service {
namespace {

struct ReferenceArguments {
    SceneArguments scene;
    OutputArguments output;
    ReportArguments report;
    ReferenceOptions options;
    Shutter shutter;
    OptionTexts texts;  ///< of what the table says
};

/// What the table's options ask for. @throws rcs::Error bad_argument
RenderOptions table_options(const ReferenceArguments& arguments)
{
    const Size size = parse_size(arguments.scene.size);
    RenderOptions asked;
    asked.width = size.width, asked.height = size.height, asked.aa = arguments.options.aa;
    asked = read_options(arguments.texts, asked);
    validate_named(asked);
    return asked;
}

View view_of(const RenderOptions& asked, Camera camera)
{
    View view{std::move(camera), asked.width, asked.height};
    if (!asked.crop) return view;
    view.width = asked.crop->width, view.height = asked.crop->height;
    view.corner = {asked.crop->x, asked.crop->y}, view.whole = {asked.width, asked.height};
    return view;
}

LayeredImage trace(Session& session, const View& view, const ReferenceArguments& arguments, const RenderOptions& asked,
                   const ProgressFunction& progress)
{
    std::function<Lens(const Camera&)> lens;
    if (asked.f_stop) lens = [&](const Camera& camera) { return lens_of(camera, *asked.f_stop, *asked.focus); };
    if (arguments.shutter.blurs()) {
        const CameraSource source(arguments.scene);
        return render_reference(session,
                                moments_of(arguments.scene, source, session, arguments.shutter, *arguments.scene.time),
                                view, arguments.options, lens, progress);
    }
    ReferenceOptions own = arguments.options;
    if (lens) own.lens = lens(view.camera);
    return render_reference(session.rays(EffectChoice{}), view, own, session.pool(), progress);
}

void trace_reference(const ReferenceArguments& arguments, const CLI::App& command)
{
    const auto begin = std::chrono::steady_clock::now();
    ProgressBar bar(parse_log_level(arguments.report.log_level), arguments.report.quiet);
    // What others are judged by keeps all its digits.
    const OutputFiles outputs = output_files(parse_outputs(arguments.output, PixelFormat::full_float),
                                             parse_tone_map(arguments.output), bar.log());
    check_text_path(arguments.report.stats_file);
    const RenderOptions asked = table_options(arguments);

    Session session = begin_session(arguments.scene, bar);
    ThreadPool& pool = session.pool();
    RunReport report = begin_report(command, arguments.scene, pool);
    session.show(load(arguments.scene, bar, report));
    const View view =
        view_of(asked, choose_camera(session.scene(), camera_choice(arguments.scene, arguments.scene.time)));
    report.camera = view.camera.name;
    build_rays(session, EffectChoice{}, bar, report);

    LayeredImage image =
        timed(report, "reference", [&] { return trace(session, view, arguments, asked, bar.progress()); });
    const Image& beauty = image.layers.at("beauty");
    report.paths = static_cast<std::uint64_t>(beauty.width) * static_cast<std::uint64_t>(beauty.height) *
                   static_cast<std::uint64_t>(std::stoi(image.metadata.at("rcs:samples")));
    image.metadata["rcs:version"] = kVersion;
    image.metadata["rcs:scene"] = arguments.scene.scene;
    image.metadata["rcs:camera"] = view.camera.name;
    image.metadata["rcs:environment"] = arguments.scene.environment;
    outputs.write(image, pool, bar.progress(), report);
    bar.finish();
    deliver(report, arguments.report, begin);
}

}  // namespace

void add_reference_command(CLI::App& app, Action& action)
{
    CLI::App& command =
        *app.add_subcommand("reference", "Path traces the same light, slowly: the truth that render is judged by");
    const auto arguments = std::make_shared<ReferenceArguments>();
    ReferenceOptions& options = arguments->options;
    const RenderOptions render_defaults;
    add_scene_arguments(command, arguments->scene, {render_defaults.width, render_defaults.height});
    for (const char* key : {"crop", "f_stop", "focus"})
        add_table_option(command, find_option(key), render_defaults, arguments->texts);
    command.option_defaults()->group(option_group::kQuality);
    add_number(command, "--spp", options.samples, {16, 1048576}, "Paths a pixel, rounded up to a multiple of 16");
    add_number(command, find_option("bounces"), options.bounces);
    // Of the table's samples a pixel it has the range, but no more samples.
    add_number(
        command, "--aa", options.aa, find_option("aa").range,
        "1 begins the paths of --spp at the pixel's centre; more spreads them over the pixel and filters textures "
        "as render does with so many samples");
    add_number(command, "--stride", options.stride, {1, 16384},
               "Trace every so many pixels of every so many rows; compare then takes the same pixels");
    add_number(command, find_option("seed"), options.seed);
    add_shutter(command, arguments->shutter,
                "Motion blur: part of the time from frame to frame that is seen, around the frame's own, such as 0.5; "
                "the paths are of 64 moments of it");
    add_fps(command, arguments->shutter.fps, "Frames a second that --shutter is a part of");
    command.get_option("--shutter")->needs("--time");
    command.get_option("--fps")->needs("--shutter");
    add_output_arguments(command, arguments->output, Renderer::reference);
    add_report_arguments(command, arguments->report);
    command.footer("Example: rcsplat reference demo:cornell --size 256x256 --spp 4096 -o reference.exr");
    command.callback(
        [arguments, &command, &action] { action = [arguments, &command] { trace_reference(*arguments, command); }; });
}

}  // namespace rcs::service
