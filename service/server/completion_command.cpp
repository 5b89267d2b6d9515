#include "server/completion_command.h"

#include <algorithm>
#include <csignal>
#include <cstring>
#include <string_view>

#include <sys/wait.h>
#include <unistd.h>

#include "process/program.h"

namespace rcs::service {
namespace {

constexpr std::size_t kCommandsAtATime = 4;

std::string state_name(v1::JobState state)
{
    std::string name = v1::JobState_Name(state).substr(sizeof "JOB_STATE_" - 1);
    std::transform(name.begin(), name.end(), name.begin(),
                   [](char c) { return c == '_' ? '-' : static_cast<char>(c - 'A' + 'a'); });
    return name;
}

/// This process's environment, with what is told of the job.
std::vector<std::string> environment_of(const v1::JobStatus& job)
{
    std::vector<std::string> all;
    for (char** entry = environ; *entry != nullptr; ++entry) {
        if (!std::string_view(*entry).starts_with("RCSPLAT_")) all.emplace_back(*entry);
    }
    all.push_back("RCSPLAT_JOB=" + std::to_string(job.job()));
    all.push_back("RCSPLAT_STATE=" + state_name(job.state()));
    all.push_back("RCSPLAT_OWNER=" + job.owner());
    all.push_back("RCSPLAT_SCENE=" + job.scene());
    all.push_back("RCSPLAT_FRAMES=" + std::to_string(job.frames()));
    all.push_back("RCSPLAT_COMPLETED=" + std::to_string(job.frames_completed()));
    all.push_back("RCSPLAT_FAILED=" + std::to_string(job.frames_failed()));
    all.push_back("RCSPLAT_REASON=" + job.error().message());
    for (std::string& entry : all) entry.erase(std::find(entry.begin(), entry.end(), '\0'), entry.end());
    return all;
}

}  // namespace

CompletionCommand::CompletionCommand(const ServerConfig& config, const ServerLog& log) : config_(config), log_(log) {}

CompletionCommand::~CompletionCommand()
{
    for (const Running& running : running_) {
        if (running.pid == 0) continue;
        ::kill(-running.pid, SIGKILL);
        ::waitpid(running.pid, nullptr, 0);
    }
}

bool CompletionCommand::is_idle() const { return running_.empty(); }
bool CompletionCommand::has_room() const { return running_.size() < kCommandsAtATime; }

bool CompletionCommand::runs_for(std::uint64_t job) const
{
    return std::any_of(running_.begin(), running_.end(), [job](const Running& running) { return running.job == job; });
}

void CompletionCommand::start(const v1::JobStatus& job, std::int64_t now_ms)
{
    int error = 0;
    const pid_t pid = start_program({{config_.on_completion}, environment_of(job), "", true}, error);
    if (pid == 0) {
        log_.write(Level::error, "on_completion_not_started",
                   {{"job", job.job()}, {"command", config_.on_completion}, {"why", std::strerror(error)}});
    }
    running_.push_back(
        {job.job(), pid, now_ms + static_cast<std::int64_t>(1e3 * config_.on_completion_seconds), false});
}

std::vector<std::uint64_t> CompletionCommand::take(std::int64_t now_ms)
{
    std::vector<std::uint64_t> ended;
    for (auto running = running_.begin(); running != running_.end();) {
        int status = 0;
        const bool has_ended = running->pid == 0 || ::waitpid(running->pid, &status, WNOHANG) == running->pid;
        if (!has_ended && now_ms >= running->until_ms && !running->killed) {
            running->killed = true;
            ::kill(-running->pid, SIGKILL);
        }
        if (!has_ended) {
            ++running;
            continue;
        }
        const Level level = running->pid == 0 || status == 0 ? Level::info : Level::warning;
        log_.write(level, "on_completion_ended",
                   {{"job", running->job},
                    {"code", WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status)},
                    {"took_too_long", running->killed}});
        ended.push_back(running->job);
        running = running_.erase(running);
    }
    return ended;
}

}  // namespace rcs::service
