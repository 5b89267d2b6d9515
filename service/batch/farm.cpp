#include "batch/farm.h"

#include <algorithm>

#include <nlohmann/json.hpp>

#include "rcs/error.h"
#include "rcs/version.h"
#include "report/encoding.h"

namespace rcs::service {
namespace {

constexpr int kMostSlurmParts = 1000;  // MaxArraySize - 1, unless a cluster is set up otherwise

constexpr const char* kEngines[] = {"local", "slurm", "openjd"};

/// As a shell reads it back.
std::string quoted(const std::string& word)
{
    std::string text = "'";
    for (const char c : word) text += c == '\'' ? "'\\''" : std::string(1, c);
    return text + "'";
}

std::string task_script(const FarmJob& job)
{
    std::string command;
    for (const std::string& word : job.words) command.append(command.empty() ? "" : " ").append(quoted(word));
    return fill_page(farm_sources().at("task.sh"), {{"directory", quoted(job.directory)},
                                                    {"parts", std::to_string(job.parts)},
                                                    {"command", command},
                                                    {"overture", job.overture ? "task \"overture/$parts\"" : ":"}});
}

std::string submit_script(const FarmJob& job)
{
    const std::string overture = "overture=$(sbatch $common --job-name=" + job.name +
                                 "-overture --output=logs/overture.log \"$@\" ./task overture)";
    return fill_page(farm_sources().at("submit.sh"),
                     {{"folder", quoted(job.folder)},
                      {"cpus", job.threads > 0 ? "--cpus-per-task=" + std::to_string(job.threads) : ""},
                      {"name", job.name},
                      {"parts", std::to_string(job.parts)},
                      {"overture", job.overture ? overture : "overture="},
                      {"after_overture", job.overture ? "--dependency=afterany:\"${overture%%;*}\"" : ""}});
}

std::string job_template(const FarmJob& job)
{
    const char* overture =
        "  - name: Overture\n"
        "    script:\n"
        "      actions:\n"
        "        onRun:\n"
        "          command: sh\n"
        "          args: [\"{{Param.Job}}/task\", \"overture\"]\n"
        "          cancelation: {mode: NOTIFY_THEN_TERMINATE, notifyPeriodInSeconds: 30}\n";
    return fill_page(farm_sources().at("template.yaml"),
                     {{"name", job.name},
                      {"parts", std::to_string(job.parts)},
                      {"overture", job.overture ? overture : ""},
                      {"after_overture", job.overture ? "    dependencies: [{dependsOn: Overture}]\n" : ""},
                      {"Param.Job", "{{Param.Job}}"},
                      {"Task.Param.Part", "{{Task.Param.Part}}"}});
}

std::string description(const FarmJob& job)
{
    const nlohmann::ordered_json json{
        {"rcsplat", kVersion},     {"engine", kEngines[static_cast<std::size_t>(job.engine)]},
        {"name", job.name},        {"directory", job.directory},
        {"command", job.words},    {"parts", job.parts},
        {"overture", job.overture}};
    return json.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace

Engine parse_engine(const std::string& text)
{
    const auto found = std::find(std::begin(kEngines), std::end(kEngines), text);
    if (found == std::end(kEngines)) throw Error(ErrorCode::bad_argument, text + " is not one of local, slurm, openjd");
    return static_cast<Engine>(found - std::begin(kEngines));
}

std::map<std::string, std::string> farm_files(const FarmJob& job)
{
    std::map<std::string, std::string> files{{"task", task_script(job)}, {"job.json", description(job)}};
    if (job.engine == Engine::slurm && job.parts > kMostSlurmParts)
        throw Error(ErrorCode::bad_argument, "--chunk makes " + std::to_string(job.parts) + " parts, more than the " +
                                                 std::to_string(kMostSlurmParts) + " that an array of Slurm takes");
    if (job.engine == Engine::slurm) files.emplace("submit", submit_script(job));
    if (job.engine == Engine::openjd) files.emplace("template.yaml", job_template(job));
    return files;
}

std::vector<std::string> start_command(const FarmJob& job)
{
    if (job.engine == Engine::openjd) return {};
    if (job.engine == Engine::slurm) return {"/bin/sh", job.folder + "/submit"};
    return {"/bin/sh", job.folder + "/task", "all"};
}

}  // namespace rcs::service
