#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <variant>

#include <spawn.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/describe.h"
#include "cli/job_of_arguments.h"
#include "cli/job_run.h"
#include "cli/memory_need.h"
#include "cli/number.h"
#include "cli/outputs.h"
#include "cli/progress_bar.h"
#include "cli/run_support.h"
#include "cli/server_arguments.h"
#include "cli/view_source.h"
#include "process/exit_code.h"
#include "process/interrupt.h"
#include "process/process.h"
#include "rcs/rcs.h"
#include "view/desk.h"
#include "view/viewer.h"
#include "view/web.h"
#include "wire/errors.h"

namespace rcs::service {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kMostPort = 65535;
constexpr int kLongestSide = 4096;                // of a picture that a page takes several times a second [px]
constexpr auto kGrace = std::chrono::seconds(5);  // after the last page has gone: it may only have been loaded anew
constexpr std::size_t kMostRecords = 200'000;     // of those kept, which take about a kilobyte each
constexpr const char* kUsualError = "10%";
// Options of a render that a view has none of, or that its page chooses otherwise.
constexpr const char* kLeftOut[] = {"--size", "--crop", "--f-stop", "--focus", "--budget"};

struct ViewArguments {
    RenderArguments render;
    ServerArguments server;
    bool has_server = false;
    int port = 0;
    bool opens = false, keeps_open = false;
};

void check_view(const RenderOptions& options, const LogFunction& log)
{
    if (std::max(options.width, options.height) > kLongestSide)
        throw Error(ErrorCode::bad_argument, "--size: a view is at most " + std::to_string(kLongestSide) +
                                                 " px wide and high, asked for are " + std::to_string(options.width) +
                                                 "x" + std::to_string(options.height));
    check_memory(options, {"view.png"}, log);
    if (std::holds_alternative<TargetIndirectError>(options.quality))
        throw Error(ErrorCode::bad_argument, "--target-error: a view aims at the error of its picture, such as 10%");
}

std::string page_text(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

Json to_json(glm::dvec3 v) { return {v.x, v.y, v.z}; }

Json to_json(const Look& look)
{
    return {{"eye", to_json(look.eye)}, {"target", to_json(look.target)}, {"up", to_json(look.up)}, {"fov", look.fov}};
}

/// Half the diagonal of the scene [m].
double radius_of(const Scene& scene)
{
    const Bounds box = bounds_of(scene);
    const double radius = 0.5 * glm::length(box.max - box.min);
    return std::isfinite(radius) && radius > 0.0 ? radius : 1.0;
}

/// What a page is told first.
Json greeting(const ViewArguments& arguments, const RenderOptions& options, const Scene& scene, const Camera& first)
{
    const double radius = radius_of(scene);
    const Size size = parse_size(arguments.render.scene.size);
    Json hello = {{"scene", arguments.render.scene.scene},
                  {"radius", radius},
                  {"size", {size.width, size.height}},
                  {"error", 100.0 * target_error(options)},
                  {"bounces", options.bounces},
                  {"start", to_json(look_of(first, scene, 0.5 * radius))},
                  {"cameras", Json::array()},
                  {"server", arguments.has_server ? Json(arguments.server.address) : Json(nullptr)}};
    const auto exposure = parse_exposure(arguments.render.output.exposure);
    hello["exposure"] = exposure ? Json(*exposure) : Json(nullptr);
    for (const Camera& camera : scene.cameras) {
        if (camera.projection != Projection::perspective) continue;
        Json entry = to_json(look_of(camera, scene, 0.5 * radius));
        entry["name"] = camera.name;
        hello["cameras"].push_back(std::move(entry));
    }
    return {{"hello", hello}};
}

/// Sends what is seen to a render server, one at a time.
class JobSender {
public:
    JobSender(const ViewArguments& arguments, const ViewSource& source, const std::unique_ptr<ViewServer>& page)
        : arguments_(arguments), source_(source), page_(page)
    {
    }

    void send(const Look& look)
    {
        if (!arguments_.has_server) return tell({{"error", "no --server was given"}});
        {
            const std::scoped_lock lock(mutex_);
            if (std::exchange(is_busy_, true)) return tell({{"error", "the last one is still on its way"}});
        }
        thread_ = std::jthread([this, look] {
            const Json outcome = submit_look(look);
            {
                const std::scoped_lock lock(mutex_);
                is_busy_ = false;
            }
            tell(outcome);
        });
    }

private:
    void tell(const Json& outcome) const { page_->tell(page_text({{"job", outcome}})); }

    Json submit_look(const Look& look) const
    {
        try {
            const RenderArguments arguments = source_.arguments_of(look);
            RequestedJob requested = request_job(arguments, {}, false);
            *requested.job.add_frames() = request_frame(arguments, 0, arguments.scene.time);
            Client client = connect(arguments_.server);
            ProgressBar quiet(LogLevel::warning, true);
            return {{"number", submit(client, requested, quiet).job()}};
        } catch (const std::exception& e) {
            return {{"error", e.what()}};
        }
    }

    const ViewArguments& arguments_;
    const ViewSource& source_;
    const std::unique_ptr<ViewServer>& page_;
    std::mutex mutex_;
    bool is_busy_ = false;
    std::jthread thread_;
};

/// @throws Ended: there is nothing that would
void open_browser(std::string address)
{
    std::string program = "xdg-open";
    char* const words[] = {program.data(), address.data(), nullptr};
    pid_t child = 0;
    if (const int failed = ::posix_spawnp(&child, program.c_str(), nullptr, nullptr, words, environ); failed != 0)
        throw Ended(kFailed, "--open: xdg-open cannot be started: " + std::string(std::strerror(failed)));
}

/// Until the last page has gone, or a signal came.
void serve(const ViewArguments& arguments, const ViewSource& source, Session& session, const Camera& first,
           ToneMapper& mapper)
{
    Desk desk;
    std::unique_ptr<ViewServer> page;  // outlives jobs that tell it of themselves
    JobSender jobs(arguments, source, page);
    const Scene& scene = session.scene();
    const std::string hello = page_text(greeting(arguments, final_options(source.arguments_of({})), scene, first));
    Viewer viewer(session, mapper, desk, [&](const Look& look) { return source.request_of(look, scene); },
                  {[&](std::string frame) { page->show(std::move(frame)); },
                   [&](const std::string& why) { page->tell(page_text({{"failed", why}})); }});
    const auto wished = [&](const Wish& wish) {
        if (const auto* look = std::get_if<Look>(&wish)) return desk.put(*look);
        if (const auto* shown = std::get_if<Shown>(&wish)) return desk.put(*shown);
        if (std::holds_alternative<Afresh>(wish)) return desk.put_afresh();
        if (const auto* pick = std::get_if<Pick>(&wish)) {
            const auto point = viewer.pick(*pick);
            return page->tell(page_text({{"picked", point ? to_json(*point + scene.origin) : Json(nullptr)}}));
        }
        if (const auto look = desk.last()) jobs.send(*look);
    };
    const auto greet = [&] {
        desk.come();
        return hello;
    };
    page = std::make_unique<ViewServer>(arguments.port, Visits{greet, [&] { desk.go(); }, wished});
    const struct Ending {
        ViewServer& server;
        ~Ending() { server.stop(); }  // before what its visits are told of ends
    } ending{*page};
    const std::string address = address_of(page->door());
    std::printf("%s\n", address.c_str());
    std::fflush(stdout);
    if (arguments.opens) open_browser(address);
    viewer.run(arguments.keeps_open ? std::nullopt : std::optional<Desk::Clock::duration>(kGrace));
}

void run_view(ViewArguments arguments, const CLI::App& command)
{
    ProgressBar bar(parse_log_level(arguments.render.report.log_level), false);
    std::string& target = arguments.render.options.of(*std::find_if(
        option_table().begin(), option_table().end(), [](const OptionInfo& o) { return o.name == "--target-error"; }));
    if (target.empty()) target = kUsualError;
    check_view(final_options(arguments.render), bar.log());
    ToneMapper mapper(parse_tone_map(arguments.render.output), bar.log());
    const SceneArguments& scene = arguments.render.scene;
    Session session({.threads = scene.threads, .keep_records = true, .most_records = kMostRecords, .log = bar.log()});
    limit_gl_threads(session.pool().size());
    RunReport report;
    session.show(load(scene, bar, report));
    const Camera first = choose_camera(session.scene(), camera_choice(scene, scene.time));
    build_rays(session, final_options(arguments.render).effects, bar, report);
    session.gl();
    bar.finish();
    const ViewSource source(command, arguments.render);
    serve(arguments, source, session, first, mapper);
    stop_if_interrupted();
}

}  // namespace

void add_view_command(CLI::App& app, Action& action)
{
    CLI::App& command = *app.add_subcommand("view", "Shows a scene live, in a page of this machine");
    const auto arguments = std::make_shared<ViewArguments>();
    add_scene_arguments(command, arguments->render.scene, {640, 400});
    const RenderOptions defaults;
    for (const OptionInfo& option : option_table()) {
        const bool is_left_out = std::find(std::begin(kLeftOut), std::end(kLeftOut), option.name) != std::end(kLeftOut);
        const bool is_setting = quality_of(option) == Quality(QualitySettings{}).index();
        if (!is_left_out && !is_setting && option.prefix.empty())
            add_table_option(command, option, defaults, arguments->render.options);
    }
    command.get_option("--target-error")->default_str(kUsualError);
    add_display_arguments(command, arguments->render.output);
    command.option_defaults()->group(option_group::kPage);
    add_number(command, "--port", arguments->port, {0, kMostPort}, "Port on 127.0.0.1; 0 takes any that is free");
    command.add_flag("--open", arguments->opens, "Open the page in the desktop's browser");
    command.add_flag("--keep-open", arguments->keeps_open, "Go on when the page is closed, until a signal comes");
    command.option_defaults()->group(option_group::kMachine);
    add_log_level(command, arguments->render.report);
    add_server_arguments(command, arguments->server);
    command.get_option("--server")
        ->envname("")
        ->default_str("")
        ->description("Render server that takes what is seen as a job: a socket or HOST:PORT");
    command.footer("Example: rcsplat view sponza.glb --camera atrium --open");
    command.callback([arguments, &command, &action] {
        arguments->has_server = command.get_option("--server")->count() > 0;
        action = [arguments, &command] { run_view(*arguments, command); };
    });
}

}  // namespace rcs::service
