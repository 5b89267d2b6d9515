#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "queue/blob_store.h"
#include "queue/job_queue.h"
#include "wire/address.h"

namespace rcs::service {

/// Who starts workers: the server, on its own machine, or Slurm on any.
enum class WorkerEngine { local, slurm };

/// What a server is told, by flags or by a file of the same names.
struct ServerConfig {
    std::string socket;              ///< path; its folder is made for the owner alone where it is missing
    std::string group;               ///< whose members may connect too
    std::string state;               ///< folder of queue, uploads and pictures
    std::vector<std::string> roots;  ///< beneath which jobs may name scenes by path
    std::string listen;              ///< "HOST:PORT" of TCP; "" listens on the socket alone
    std::string http;                ///< "HOST:PORT" of the status page; loopback
    std::string token_file;          ///< that TCP clients show; "": STATE/token, made when needed
    std::string tls_certificate, tls_key, client_ca;

    WorkerEngine engine = WorkerEngine::local;
    std::string srun_options;      ///< what srun is told as well, words apart by blanks
    double worker_idle = 60.0;     ///< after which a worker that nobody needs is let go; of Slurm's alone [s]
    int workers = 0;               ///< 0: one for each 8 cores; of Slurm's one
    int threads = 0;               ///< of a worker; 0: shares the cores; of Slurm's: what it gives
    double time_limit = 3600.0;    ///< of a frame [s]
    double memory_limit_mb = 0.0;  ///< of a worker [MB]; 0: 80 % of the machine's, shared; of Slurm's: its own
    double worker_start = 60.0;    ///< that a worker may take to be ready, and to begin with a frame [s]
    double stop_grace = 10.0;      ///< that running frames get when the server is told to stop [s]
    double min_free_mb =
        256.0;                ///< on the state's disk: below, jobs and uploads are refused, below half frames wait [MB]
    double keep_days = 14.0;  ///< pictures and jobs that have ended
    double keep_gb = 50.0;    ///< of pictures; beyond, the oldest go
    int max_connections = 256;
    double message_seconds = 30.0;  ///< from the first byte of a message to its last, and for what is sent to be taken
    int max_pixels_millions = 64;   ///< of a frame
    std::string deliver_root;       ///< beneath which jobs may have pictures copied; "": nowhere
    std::string on_completion;      ///< program for jobs that have ended; "": none
    double on_completion_seconds = 60.0;  ///< that it may take
    bool log_debug = false;
    bool recover = false;  ///< salvage the queue where its database is lost or damaged
    QueueOptions queue;
    BlobLimits blobs;

    /// Takes over what a running server can change. @return the options that differ and are left as they were
    std::string adopt_reloadable(const ServerConfig& fresh);
};

/// Fills in what follows from the machine, and checks what can be. @throws rcs::Error bad_argument, not_found
void complete(ServerConfig& config);

/// $STATE_DIRECTORY, which systemd says, else $XDG_STATE_HOME/rcsplat, else ~/.local/state/rcsplat; "" where none of
/// the variables holds an absolute path.
std::string default_state();

}  // namespace rcs::service
