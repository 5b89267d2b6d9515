#include "cli/server_options.h"

#include <cstdlib>
#include <string>

#include "cli/describe.h"
#include "cli/number.h"
#include "cli/parse.h"
#include "rcs/error.h"

namespace rcs::service {
namespace {

/// Where systemd made the service a folder, in that.
std::string server_socket()
{
    const char* runtime = std::getenv("RUNTIME_DIRECTORY");
    return runtime != nullptr && *runtime == '/' ? std::string(runtime) + "/socket" : default_socket();
}

void add_queue_options(CLI::App& command, QueueOptions& q)
{
    add_number(command, "--ageing", q.share.ageing_seconds, {0, 1e9, true},
               "Waiting that counts as one step of priority [s]");
    add_number(command, "--slice", q.share.slice_seconds, {0, 1e6, true},
               "Time of a worker in which owners, and the jobs of an owner, take turns [s]");
    add_number(command, "--owner-running", q.share.owner_running, {0, 1024},
               "Frames of one owner that run at a time; 0: as many as there are workers");
    add_number(command, "--owner-frames", q.max_owner_frames, {0, 100'000'000},
               "Unfinished frames of one owner; more are refused; 0: as many as --max-frames");
    const auto add_tries = [&](const char* name, RetryPolicy& policy, const char* help) {
        add_number(command, name, policy.tries, {1, 100}, help);
    };
    add_tries("--tries", q.passing, "Tries of a frame that fails for want of disk or OpenGL, or by a defect");
    add_tries("--tries-death", q.death, "Tries of a frame whose worker dies or hangs");
    add_tries("--tries-memory", q.memory, "Tries of a frame that takes too much memory");
    add_tries("--tries-time", q.time, "Tries of a frame that takes too long");
    add_number(command, "--max-jobs", q.max_unfinished_jobs, {1, 10'000'000}, "Unfinished jobs; more are refused");
    add_number(command, "--max-frames", q.max_unfinished_frames, {1, 100'000'000},
               "Unfinished frames; more are refused");
}

void add_aftermath_options(CLI::App& command, ServerConfig& c)
{
    command
        .add_option("--deliver-root", c.deliver_root,
                    "Folder beneath which jobs may have their pictures copied (submit --deliver)")
        ->type_name("DIR");
    command
        .add_option("--on-completion", c.on_completion,
                    "Program that is run, without a shell, for each job that has ended; it hears of it by RCSPLAT_JOB, "
                    "RCSPLAT_STATE and more in its environment")
        ->type_name("FILE");
    add_number(command, "--on-completion-seconds", c.on_completion_seconds, {0, 86400, true},
               "Time that it may take, after which it is killed [s]");
}

WorkerEngine parse_worker_engine(const std::string& text)
{
    if (text == "local") return WorkerEngine::local;
    if (text == "slurm") return WorkerEngine::slurm;
    throw Error(ErrorCode::bad_argument, text + " is not one of local, slurm");
}

void add_slurm_options(CLI::App& command, ServerConfig& c)
{
    command
        .add_option_function<std::string>(
            "--engine", [&c](const std::string& text) { c.engine = parse_worker_engine(text); },
            "Where workers run: on this machine, or where Slurm has room; it starts them by srun while frames wait")
        ->type_name("local|slurm")
        ->check(checked_by(parse_worker_engine), "");
    command
        .add_option("--srun-options", c.srun_options,
                    "What srun is told of them as well, as in \"--partition=render --mem=16G\"; --threads asks for as "
                    "many processors")
        ->type_name("TEXT");
    add_number(command, "--worker-idle", c.worker_idle, {0, 1e6},
               "After which a worker of Slurm that no frame needs is let go [s]");
}

void add_limits(CLI::App& command, ServerConfig& c)
{
    command.option_defaults()->group(option_group::kLimits);
    add_number(command, "--time-limit", c.time_limit, {0, 1e6, true}, "Wall time of a frame, after which it fails [s]");
    add_number(command, "--memory-limit", c.memory_limit_mb, {0, 1e9},
               "Memory of a worker, beyond which its frame fails [MB]; 0 "
               "shares 80 % of the machine's out");
    add_number(command, "--worker-start", c.worker_start, {0, 1e6, true},
               "Time that a worker may take to be ready or to begin with a frame, after which it is replaced [s]");
    add_number(command, "--stop-grace", c.stop_grace, {0, 3600},
               "Time that running frames get to end when the server is told to stop [s]");
    add_number(command, "--min-free", c.min_free_mb, {0, 1e9},
               "Space to leave on the state's disk: below, jobs and uploads are refused; below half, no frame is "
               "started [MB]");
    add_number(command, "--keep-days", c.keep_days, {0, 36500},
               "How long jobs that have ended and their pictures stay [days]");
    add_number(command, "--keep-gb", c.keep_gb, {0, 1e6}, "Pictures beyond so much go, the oldest first [GB]");
    add_queue_options(command, c.queue);
    add_number(command, "--max-megapixels", c.max_pixels_millions, {1, 268}, "Pixels of a frame [millions]");
    add_number(command, "--max-connections", c.max_connections, {1, 10'000}, "Connections at a time");
    add_number(command, "--message-seconds", c.message_seconds, {0, 3600, true},
               "From the first byte of a message to its last, and for a client to take what it asked for [s]");
}

}  // namespace

void add_server_options(CLI::App& command, ServerConfig& c)
{
    c.socket = server_socket();
    c.state = default_state();
    command.add_option("--socket", c.socket, "Unix socket to listen on")->type_name("PATH")->capture_default_str();
    command.add_option("--group", c.group, "Group whose members may connect, beside the server's own user")
        ->type_name("NAME");
    command.add_option("--state", c.state, "Folder of queue, uploads and pictures")
        ->type_name("DIR")
        ->capture_default_str();
    command
        .add_option("--root", c.roots, "Folder beneath which jobs may name scenes by path; may be given several times")
        ->type_name("DIR")
        ->allow_extra_args(false);
    command
        .add_option("--listen", c.listen, "Also listen on TCP; clients show the token, and beyond loopback speak TLS")
        ->type_name("HOST:PORT");
    command.option_defaults()->group(option_group::kServer);
    command.add_option("--token-file", c.token_file, "Secret of TCP clients; default: DIR/token, made when needed")
        ->type_name("FILE");
    command.add_option("--tls-certificate", c.tls_certificate, "Certificate chain of TCP [PEM]")->type_name("FILE");
    command.add_option("--tls-key", c.tls_key, "Its key [PEM]")->type_name("FILE");
    command.add_option("--client-ca", c.client_ca, "Authority whose certificates stand for the token [PEM]")
        ->type_name("FILE");
    command.option_defaults()->group(option_group::kServe);
    command.add_option("--http", c.http, "Show a read-only status page on this address of this machine")
        ->type_name("HOST:PORT");
    add_number(command, "--workers", c.workers, {0, 64}, "Worker processes; 0 takes one for each 8 cores");
    add_number(command, "--threads", c.threads, {0, 1024}, "Threads of a worker; 0 shares the cores out");
    add_slurm_options(command, c);
    add_limits(command, c);
    command.option_defaults()->group(option_group::kServe);
    add_aftermath_options(command, c);
    command.add_flag("--debug", c.log_debug, "Log more");
    command.add_flag(
        "--recover", c.recover,
        "Where the queue's database is lost or damaged, go on with what can be read of it and all pictures; "
        "without it the server does not start then");
}

}  // namespace rcs::service
