#pragma once

#include <chrono>

#include <CLI/CLI.hpp>

#include "cli/arguments.h"
#include "cli/progress_bar.h"
#include "output/stats_json.h"
#include "rcs/effect_plan.h"
#include "rcs/scene.h"
#include "rcs/session.h"
#include "rcs/thread_pool.h"

namespace rcs::service {

/// A report that names the command and lists all its options with the values they have.
/// @param render  of a command that takes the option table: what they came to
RunReport begin_report(const CLI::App& command, const SceneArguments& arguments, const ThreadPool& pool,
                       const RenderOptions* render = nullptr);

/// The scene with the sky that the command line asks for.
Scene load(const SceneArguments& arguments, ProgressBar& bar, RunReport& report);

/// With the threads that the command line asks for; a software GL gets as few.
Session begin_session(const SceneArguments& arguments, ProgressBar& bar);

const RayScene& build_rays(Session& session, const EffectChoice& effects, ProgressBar& bar, RunReport& report);

/// Writes and prints what was asked for; the last step of a command.
/// @param begin  when the command began
void deliver(RunReport& report, const ReportArguments& arguments, std::chrono::steady_clock::time_point begin);

}  // namespace rcs::service
