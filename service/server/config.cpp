#include "server/config.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <thread>
#include <utility>

#include <grp.h>
#include <unistd.h>

#include "process/program.h"
#include "rcs/error.h"

namespace rcs::service {
namespace {

constexpr int kCoresOfAWorker = 8;

[[noreturn]] void refuse_setting(const std::string& what) { throw Error(ErrorCode::bad_argument, what); }

/// @throws rcs::Error not_found
std::string true_folder(const char* option, const std::string& folder)
{
    std::error_code problem;
    const auto found = std::filesystem::canonical(folder, problem);
    if (problem || !std::filesystem::is_directory(found))
        throw Error(ErrorCode::not_found, std::string(option) + " " + folder + " is no folder");
    return found.string();
}

double machine_memory_mb()
{
    return 1e-6 * static_cast<double>(::sysconf(_SC_PHYS_PAGES)) * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

void complete_local(ServerConfig& c)
{
    const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
    if (c.workers == 0) c.workers = std::max(1, cores / kCoresOfAWorker);
    if (c.threads == 0) c.threads = std::max(1, cores / c.workers);
    if (c.memory_limit_mb == 0.0) c.memory_limit_mb = 0.8 * machine_memory_mb() / c.workers;
    if (!c.srun_options.empty()) refuse_setting("--srun-options needs --engine slurm");
}

void complete_slurm(ServerConfig& c)
{
    if (find_program("srun").empty()) throw Error(ErrorCode::not_found, "--engine slurm: there is no srun in $PATH");
    if (c.workers == 0) c.workers = 1;
    if (c.memory_limit_mb == 0.0) c.memory_limit_mb = std::numeric_limits<double>::infinity();
}

}  // namespace

std::string default_state()
{
    for (const auto& [variable, within] :
         {std::pair("STATE_DIRECTORY", ""), {"XDG_STATE_HOME", "/rcsplat"}, {"HOME", "/.local/state/rcsplat"}}) {
        const char* folder = std::getenv(variable);
        if (folder != nullptr && *folder == '/') return std::string(folder) + within;
    }
    return {};
}

std::string ServerConfig::adopt_reloadable(const ServerConfig& fresh)
{
    ServerConfig old = *this;
    *this = fresh;
    std::string left_out;
    const auto keep = [&](auto& mine, auto& before, const char* option) {
        if (mine != before) left_out.append(left_out.empty() ? "" : ",").append(option);
        mine = before;
    };
    keep(socket, old.socket, "--socket"), keep(group, old.group, "--group"), keep(state, old.state, "--state");
    keep(deliver_root, old.deliver_root, "--deliver-root");
    keep(listen, old.listen, "--listen"), keep(http, old.http, "--http");
    keep(engine, old.engine, "--engine"), keep(srun_options, old.srun_options, "--srun-options");
    keep(workers, old.workers, "--workers"), keep(threads, old.threads, "--threads");
    return left_out;
}

void complete(ServerConfig& c)
{
    if (c.socket.empty() || c.socket.size() > 107)
        refuse_setting("--socket has " + std::to_string(c.socket.size()) + " bytes, expected [1, 107]");
    if (c.state.empty())
        refuse_setting("--state is missing, and neither $XDG_STATE_HOME nor $HOME says where the queue is to be kept");
    if (c.state.front() != '/') c.state = std::filesystem::absolute(c.state).string();
    c.engine == WorkerEngine::slurm ? complete_slurm(c) : complete_local(c);
    for (std::string& root : c.roots) root = true_folder("--root", root);
    if (!c.deliver_root.empty()) c.deliver_root = true_folder("--deliver-root", c.deliver_root);
    if (!c.on_completion.empty() && (c.on_completion.front() != '/' || ::access(c.on_completion.c_str(), X_OK) != 0))
        throw Error(ErrorCode::not_found, "--on-completion " + c.on_completion + " is no program by its full path");
    c.queue.announces_ends = !c.on_completion.empty();
    if (!c.group.empty() && ::getgrnam(c.group.c_str()) == nullptr)
        throw Error(ErrorCode::not_found, "--group " + c.group + " is no group");
    if (c.tls_certificate.empty() != c.tls_key.empty())
        refuse_setting("--tls-certificate and --tls-key need each other");
    if (!c.client_ca.empty() && c.tls_certificate.empty()) refuse_setting("--client-ca needs --tls-certificate");
    if (!c.listen.empty() && !is_loopback(parse_host_port(c.listen).host) && c.tls_certificate.empty()) {
        refuse_setting("--listen " + c.listen + " is beyond loopback and needs --tls-certificate and --tls-key");
    }
    if (!c.http.empty() && !is_loopback(parse_host_port(c.http).host))
        refuse_setting("--http " + c.http + " is beyond loopback");
}

}  // namespace rcs::service
