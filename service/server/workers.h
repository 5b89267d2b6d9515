#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <optional>
#include <string>
#include <vector>

#include <sys/types.h>

#include "queue/job_queue.h"
#include "rcs/internal/worker.pb.h"
#include "server/config.h"
#include "server/frame_logs.h"
#include "server/log.h"
#include "wire/files.h"
#include "wire/framing.h"

namespace rcs::service {

/// A frame that a worker renders.
struct RunningFrame {
    FrameKey key;
    std::uint64_t task = 0;
    std::string folder;  ///< of its pictures, beneath the state folder
    std::int64_t started_ms = 0;
    std::int64_t deadline_ms = 0;
    std::int64_t cancelled_ms = 0;    ///< when its worker was asked to stop; 0: was not
    std::int64_t waits_since_ms = 0;  ///< when its picture was done and found no room on the disk; 0: it does not wait
    std::int64_t heard_ms = 0;        ///< when its worker last said anything, once it has begun
    bool begun = false;               ///< its worker has said so
    v1::Progress progress;
    std::string preview;  ///< JPEG
    std::vector<std::string> warnings;
    std::string making;  ///< where its worker writes; `folder` is where its pictures are kept
    FrameLog log;
};

/// How a frame ended, as its worker or its worker's end says it.
struct FrameEnd {
    RunningFrame frame;
    std::optional<internal::Done> done;
    Ending ending = Ending::failed;  ///< unless it is done
    v1::Error error;
};

inline constexpr const char* kResults = "results";      ///< folder of pictures in the state folder
inline constexpr const char* kWorkerHome = ".worker-";  ///< in that folder: those of workers begin with it

/// A worker process, and the socket to it.
struct Worker {
    pid_t pid = 0;  ///< its own, or of the srun that speaks for it
    Fd socket;
    FrameReader reader;
    std::string out;  ///< not yet written
    bool ready = false;
    bool ended = false;              ///< its number may be another process's by now
    bool has_place = false;          ///< it runs; before that Slurm has to give it a place
    bool leaving = false;            ///< nobody needs it
    std::string host;                ///< where it runs; "": here
    std::int64_t since_ms = 0;       ///< started
    std::string home;                ///< folder that it alone may write to, and its frames' folders in it
    std::string seal;                ///< from what it is kept
    std::vector<std::string> roots;  ///< beneath which it may read
    bool outdated = false;           ///< the roots are others now: it goes once it is idle
    std::string scene_key;           ///< of the scene that it keeps
    std::int64_t used_ms = 0;
    std::uint64_t memory = 0;  ///< resident [bytes]
    std::optional<RunningFrame> frame;
    std::optional<v1::Error> killed_for;
    std::int64_t goes_since_ms = 0;  ///< when it was told to end; 0: was not
};

/// The worker processes. They are started when there is none too many, live on from frame to frame, and are replaced
/// when they die; one that dies before it was ready is not replaced at once. One that takes too long to be ready, or to
/// begin with a frame, is killed.
class WorkerPool {
public:
    /// @param changed  told when a frame's progress did
    WorkerPool(const ServerConfig& config, const ServerLog& log);
    ~WorkerPool();  ///< kills them
    WorkerPool(const WorkerPool&) = delete;
    WorkerPool& operator=(const WorkerPool&) = delete;

    /// The configuration has changed.
    void adopt_config();
    /// Starts what is missing, kills what is past its limits, asks cancelled frames to stop.
    /// @param wanted  so many workers; more are let go once they have been idle for a while
    void tend(std::int64_t now, std::size_t wanted, const std::function<bool(std::uint64_t job)>& is_cancelled);
    /// When the first of those that hang is to be killed, if they do. [ms]
    std::int64_t next_deadline_ms() const;
    /// An idle worker, the one that keeps this scene if there is one.
    Worker* idle(const std::string& scene_key);
    bool has_idle() const;
    /// @param bytes  a framed internal::ToWorker
    void send(Worker& worker, const std::string& bytes);
    /// Reads and writes what can be. Ends of frames are appended to `ends`, jobs with news to `changed`.
    void serve(Worker& worker, bool readable, bool writable, std::vector<FrameEnd>& ends,
               std::vector<std::uint64_t>& changed);
    /// Takes leave of processes that have ended.
    void reap(std::vector<FrameEnd>& ends);
    /// Ends all of them; frames that ran are returned.
    std::vector<RunningFrame> stop();

    std::list<Worker>& workers() { return workers_; }
    const std::list<Worker>& workers() const { return workers_; }
    const RunningFrame* running(FrameKey key) const;
    bool any_waits_for_space() const;
    std::uint64_t restarts() const { return restarts_; }
    /// Why none is ready; "" where none is needed.
    std::string absence() const;
    /// Why workers do not start; "" while they do.
    const std::string& trouble() const { return trouble_; }

private:
    void spawn(std::int64_t now);
    bool hear_of_worker(Worker& worker, const internal::FromWorker& message);
    void handle(Worker& worker, internal::FromWorker& message, std::vector<FrameEnd>& ends,
                std::vector<std::uint64_t>& changed);
    FrameEnd end_of(RunningFrame frame, internal::FromWorker& message) const;
    void kill(Worker& worker, v1::ErrorCode code, const std::string& why);
    void let_go(std::int64_t now, std::size_t wanted);
    void tend_worker(Worker& worker, std::int64_t now);
    void tend_frame(Worker& worker, std::int64_t now, bool is_cancelled);

    const ServerConfig& config_;
    const ServerLog& log_;
    std::list<Worker> workers_;
    std::int64_t next_start_ms_ = 0;
    int failed_starts_ = 0;
    std::uint64_t restarts_ = 0;
    std::string trouble_;
};

}  // namespace rcs::service
