#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "process/clock.h"
#include "queue/blob_store.h"
#include "queue/job_queue.h"
#include "rcs/v1/service.pb.h"
#include "server/completion_command.h"
#include "server/config.h"
#include "server/deliverer.h"
#include "server/frame_logs.h"
#include "server/log.h"
#include "server/workers.h"

namespace rcs::service {

/// On whose behalf a request comes.
struct Caller {
    std::string owner;                          ///< "uid:1000", "token", "certificate:NAME"
    bool sees_all = false;                      ///< the server's own user; others see their own jobs alone
    std::weak_ptr<const void> connection = {};  ///< while it lasts
};

/// Since the server's start.
struct Counters {
    std::uint64_t jobs_submitted = 0, jobs_repeated = 0, frames_completed = 0, frames_failed = 0, frames_retried = 0,
                  requests = 0, errors = 0, jobs_expired = 0;
    std::atomic<std::uint64_t> connections = 0, connections_refused = 0;  ///< counted where clients arrive as well
    double frame_seconds = 0.0;
};

/// What the server does, apart from its connections: queue, files and workers.
class Service {
public:
    Service(const ServerConfig& config, const ServerLog& log);

    /// The answer to a request, errors as such. Watching is the connection's business.
    /// @throws ServiceError unavailable: the database failed, and its transaction is to be rolled back
    v1::Response answer(const v1::Request& request, const Caller& caller);
    /// The job as it is now, with what runs of it. @throws ServiceError not_found, forbidden
    v1::JobStatus status(std::uint64_t job, const Caller& caller) const;

    /// Puts down how frames ended; they are kept until commit() worked.
    void take(std::vector<FrameEnd> ends);
    /// Makes the changes of this turn last. @return jobs of which a frame has ended, now or in a turn that was undone
    /// @throws ServiceError unavailable: they are undone
    std::vector<std::uint64_t> commit();
    void roll_back();

    /// Gives frames to idle workers.
    void schedule();
    /// Looks after workers, and removes what is too old. @return when to come again [ms]
    std::int64_t tend();
    /// No new jobs or frames from now on.
    void stop() { stopping_ = true; }
    bool is_idle() const;  ///< no frame runs, no end waits to be put down, no job is being announced
    /// Ends the workers; what ran goes back to the queue.
    void end();

    v1::HealthReply health() const;
    /// Where a picture lies. @param name  "": the small one that its worker made   @throws ServiceError not_found
    std::string picture_path(std::uint64_t job, int frame, const std::string& name) const;
    v1::StatsReply stats(bool prometheus) const;
    WorkerPool& workers() { return workers_; }
    const JobQueue& queue() const { return queue_; }
    Counters& counters() { return counters_; }
    void adopt_config();
    /// Of a completed frame's picture. @throws ServiceError not_found
    v1::FetchReply fetch_small_picture(const v1::FetchRequest& request) const;
    v1::FetchReply fetch(const v1::FetchRequest& request, const Caller& caller) const;
    v1::PreviewReply preview(const v1::PreviewRequest& request, const Caller& caller) const;

private:
    v1::Response reply_to(const v1::Request& request, const Caller& caller);
    v1::BlobStatusReply held(const v1::BlobStatusRequest& request, const Caller& caller);
    v1::BlobPutReply put(const v1::BlobPutRequest& request, const Caller& caller);
    v1::CancelReply cancel(const v1::CancelRequest& request, const Caller& caller);
    v1::RetryReply retry(const v1::RetryRequest& request, const Caller& caller);
    v1::PauseReply pause(const v1::PauseRequest& request, const Caller& caller);
    v1::PriorityReply set_priority(const v1::PriorityRequest& request, const Caller& caller);
    v1::LogsReply logs(const v1::LogsRequest& request, const Caller& caller) const;
    v1::ListReply list(const v1::ListRequest& request, const Caller& caller) const;
    v1::JobReply details(const v1::JobRequest& request, const Caller& caller) const;
    v1::SubmitReply submit(const v1::SubmitRequest& request, const Caller& caller);
    void check_may_see(std::uint64_t job, const Caller& caller) const;
    double free_mb() const;  ///< on the fuller of the disks of queue and pictures
    void add_outlook(v1::JobStatus& status) const;
    void check_space() const;
    void watch_space();
    bool frames_run() const;  ///< or have ended and wait to be put down
    /// Why no frames are started now, for want of room; "": they are.
    std::string reason_to_wait() const;
    void deliver(std::int64_t now);
    void give_to_deliverer(const JobQueue::Undelivered& frame);
    void announce(std::int64_t now);
    void put_down(const FrameEnd& end);
    internal::Task task_of(const NextFrame& next, const std::string& home);
    bool start_one(Moment now);
    std::size_t workers_wanted(Moment now);
    void expire(Moment now);
    void expire_jobs(std::int64_t oldest_ms);
    std::int64_t queue_clock_ms() const { return queue_.clock_ms(read_clocks()); }
    void tidy_results();
    std::string path_of(const std::string& folder) const { return config_.state + "/" + folder; }

    const ServerConfig& config_;
    const ServerLog& log_;
    Fd lock_;  ///< on the state folder: one server alone
    JobQueue queue_;
    BlobStore blobs_;
    FrameLogs logs_;
    WorkerPool workers_;
    std::optional<Deliverer> deliverer_;
    std::set<FrameKey> being_delivered_;
    std::int64_t deliver_after_ms_ = 0, delivery_pause_ms_ = 0;
    CompletionCommand completion_command_;
    Counters counters_;
    std::vector<FrameEnd> unsaved_;       ///< put down in the next turn
    std::vector<FrameEnd> of_this_turn_;  ///< put down, not yet committed
    std::uint64_t next_task_ = 1;
    std::int64_t started_ms_, next_expiry_ms_ = 0;  ///< by the steady clock
    std::string pause_;                             ///< for want of space, as the log was told
    std::string not_scheduled_;                     ///< why the last attempt to start a frame failed; "": it did not
    std::int64_t schedule_after_ms_ = 0;
    bool stopping_ = false;
};

}  // namespace rcs::service
