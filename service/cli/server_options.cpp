#include "cli/server_options.h"

#include "cli/number.h"

namespace rcs::service {

void add_server_options(CLI::App& command, ServerConfig& c)
{
    c.socket = default_socket();
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
    command.add_option("--token-file", c.token_file, "Secret of TCP clients; default: DIR/token, made when needed")
        ->type_name("FILE");
    command.add_option("--tls-certificate", c.tls_certificate, "Certificate chain of TCP [PEM]")->type_name("FILE");
    command.add_option("--tls-key", c.tls_key, "Its key [PEM]")->type_name("FILE");
    command.add_option("--client-ca", c.client_ca, "Authority whose certificates stand for the token [PEM]")
        ->type_name("FILE");
    command.add_option("--http", c.http, "Show a read-only status page on this address of this machine")
        ->type_name("HOST:PORT");
    add_number(command, "--workers", c.workers, {0, 64}, "Worker processes; 0 takes one for each 8 cores");
    add_number(command, "--threads", c.threads, {0, 1024}, "Threads of a worker; 0 shares the cores out");
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
    add_number(command, "--ageing", c.queue.ageing_seconds, {0, 1e9, true},
               "Waiting that counts as one step of priority [s]");
    add_number(command, "--tries", c.queue.max_tries, {1, 100}, "Tries of a frame whose failure may pass");
    add_number(command, "--max-jobs", c.queue.max_unfinished_jobs, {1, 10'000'000},
               "Unfinished jobs; more are refused");
    add_number(command, "--max-frames", c.queue.max_unfinished_frames, {1, 100'000'000},
               "Unfinished frames; more are refused");
    add_number(command, "--max-megapixels", c.max_pixels_millions, {1, 268}, "Pixels of a frame [millions]");
    add_number(command, "--max-connections", c.max_connections, {1, 10'000}, "Connections at a time");
    add_number(command, "--message-seconds", c.message_seconds, {0, 3600, true},
               "From the first byte of a message to its last, and for a client to take what it asked for [s]");
    command.add_flag("--debug", c.log_debug, "Log more");
    command.add_flag(
        "--recover", c.recover,
        "Where the queue's database is lost or damaged, go on with what can be read of it and all pictures; "
        "without it the server does not start then");
}

}  // namespace rcs::service
