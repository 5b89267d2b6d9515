#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "process/clock.h"
#include "queue/database.h"
#include "queue/fair_share.h"
#include "queue/queue_file.h"
#include "rcs/v1/job.pb.h"
#include "rcs/v1/service.pb.h"

namespace rcs::service {

/// What is done about one kind of failure.
struct RetryPolicy {
    int tries = 1;              ///< that may fail so, >= 1; with the last one the frame has failed
    double wait_seconds = 1.0;  ///< before the second try; each further one waits four times as long, 300 s at most
};

struct QueueOptions {
    int max_unfinished_jobs = 10'000;  ///< a job beyond is refused
    int max_unfinished_frames = 100'000;
    int max_owner_frames = 0;  ///< unfinished ones of one owner; 0: no limit but that of all
    int max_starts = 20;       ///< of a frame in all, however they ended
    RetryPolicy passing{3, 1.0}, death{2, 1.0}, memory{2, 10.0}, time{1, 1.0};  ///< as the endings below
    bool announces_ends = false;  ///< of jobs: they are kept in unannounced()
    ShareOptions share = {};
};

/// What became of a frame that was started.
enum class Ending {
    failed,       ///< trying again would not help
    may_pass,     ///< of disk, OpenGL or an internal error
    died,         ///< its worker did, or hung
    over_memory,  ///< past the limit, or there was none left
    over_time,    ///< past the limit
    no_room,      ///< the disk had none: this was no try, it waits on
};

/// Which of them a worker's failure is.
Ending ending_of(v1::ErrorCode code);

struct FrameKey {
    std::uint64_t job = 0;
    int index = 0;  ///< within the job, from 0
    auto operator<=>(const FrameKey&) const = default;
};

/// A frame that may start.
struct NextFrame {
    FrameKey key;
    std::shared_ptr<const v1::Job> job;  ///< without its frames; none: what the queue holds of it is damaged
    v1::Frame frame;
    std::string scene_key;
    std::string owner;
};

struct Completed {
    std::string folder;  ///< beneath the state folder
    std::vector<v1::OutputFile> files;
    std::string stats_json;
    std::vector<std::string> warnings;
    double error_estimate = 0.0;
};

/// Jobs and frames on disk. Changes belong to a transaction, which the first one begins and commit() ends; once that
/// returns they survive the end of any process, and after a durable change also of the machine.
///
/// It has a clock of its own, for ages and ranks: the time that servers ran on it, which no setting of the wall's clock
/// moves. What is counted of jobs and frames is kept, and specs are parsed once, so that nothing takes longer with more
/// of them.
///
/// SQLite in WAL mode. A durable change (submit, an end, cancel) commits with synchronous=FULL: the log is on disk
/// before commit() returns. A frame's start commits with synchronous=NORMAL: the worst that losing it does is to start
/// it again.
class JobQueue {
public:
    /// Makes the database if there is none (queue_file.h). Frames that were running begin anew.
    /// @param state  its folder @throws ServiceError
    JobQueue(const std::string& state, const QueueOptions& options, Moment now);

    void set_options(const QueueOptions& options);

    struct Submitted {
        std::uint64_t job = 0;
        bool existed = false;
    };
    /// @param scene_key  equal for jobs whose scenes are equal and can be kept   @param blobs  digests that it needs
    /// @throws ServiceError limit, conflict
    Submitted submit(const v1::Job& job, const std::string& owner, const std::string& scene_key,
                     const std::set<std::string>& blobs, Moment now);
    /// @param folder  of its pictures, beneath the state folder
    void start(FrameKey key, const std::string& folder, Moment now);
    void complete(FrameKey key, const Completed& result, Moment now);
    void fail(FrameKey key, Ending ending, const v1::Error& error, Moment now);
    /// Ends frames that wait; running ones are to be stopped, and then end by fail() or complete().
    /// @return none: there is no such job
    std::optional<v1::JobState> cancel(std::uint64_t job, Moment now);
    /// Frames that failed or were cancelled wait again as if they were new. The job exists.
    /// @param numbers  of frames; empty: all of those   @return how many
    /// @throws ServiceError not_found, limit, conflict: it is just being cancelled, a job that it waits for failed
    std::size_t retry(std::uint64_t job, const std::vector<int>& numbers, Moment now);
    /// Whether frames of a job that exists may start. @return false: it was so
    bool pause(std::uint64_t job, bool paused, Moment now);
    bool pause_all(bool paused);
    int set_priority(std::uint64_t job, int priority, Moment now);  ///< @return what it was
    /// Back to the queue, as if it had not been started.
    void give_back(FrameKey key, Moment now);
    /// Puts down what the queue's clock says, so that little is lost when the server dies.
    void keep_clock(Moment now);
    /// Forgets a job that has ended.
    void remove(std::uint64_t job);

    bool has_changes() const { return transaction_ != Transaction::none; }
    /// Jobs whose state has changed since the last call.
    std::vector<std::uint64_t> take_changed() { return std::exchange(changed_, {}); }
    void commit();  ///< @throws ServiceError unavailable; then nothing has changed
    void roll_back();

    // Reading; sees uncommitted changes too.
    std::optional<NextFrame> next(Moment now);
    /// When the next frame that waits after a failure may start, by the steady clock; none if none waits. [ms]
    std::optional<std::int64_t> next_retry_ms() const { return share_.next_retry_ms(); }
    bool is_paused() const { return paused_; }  ///< all of it
    const FairShare& share() const { return share_; }
    std::optional<v1::JobStatus> status(std::uint64_t job) const;
    std::string owner(std::uint64_t job) const;  ///< "" if there is no such job
    v1::ListReply list(const v1::ListRequest& request, const std::string& owner) const;
    v1::JobReply details(const v1::JobRequest& request) const;  ///< of a job that exists
    std::optional<int> index_of(std::uint64_t job, int frame_number) const;
    /// A picture file and its path beneath the state folder. None unless it is there.
    std::optional<std::pair<v1::OutputFile, std::string>> file(FrameKey key, const std::string& name) const;
    std::string folder(FrameKey key) const;      ///< of a completed frame's pictures; "" if it is none
    bool is_cancelled(std::uint64_t job) const;  ///< or was asked to
    std::vector<FrameKey> active_frames() const;
    std::uint64_t count(v1::FrameState state) const { return tally_.frames.at(static_cast<std::size_t>(state)); }
    std::uint64_t count(v1::JobState state) const { return tally_.jobs.at(static_cast<std::size_t>(state)); }
    std::int64_t clock_ms(Moment now) const { return clock_begin_ms_ + now.steady_ms; }  ///< the queue's own

    struct Ended {
        std::uint64_t job = 0;
        std::int64_t ended_ms = 0;  ///< by the queue's clock
        std::uint64_t bytes = 0;    ///< of its pictures
    };
    std::vector<Ended> ended_jobs() const;  ///< the oldest first
    std::set<std::string> blobs_of(std::uint64_t job) const;
    std::set<std::string> blobs_in_use() const;    ///< digests that unfinished jobs need
    std::set<std::string> scenes_in_use() const;   ///< keys
    std::set<std::string> folders_in_use() const;  ///< of completed frames

    /// Files of a completed frame that are to be delivered.
    struct Undelivered {
        FrameKey key;
        std::string folder;  ///< beneath the state folder
    };
    std::vector<Undelivered> undelivered(int most) const;
    v1::FrameStatus files_of(FrameKey key) const;  ///< its number and files
    std::shared_ptr<const v1::Job> job(std::uint64_t job) const { return spec(job); }
    /// @param error  why they are not there; "": they are
    void end_delivery(FrameKey key, const std::string& error);
    /// Jobs that have ended, where that is to be announced and was not.
    std::vector<std::uint64_t> unannounced(int most) const;
    void end_announcement(std::uint64_t job);
    std::vector<std::string> folders_of(std::uint64_t job) const;
    /// Of frames that an earlier server started and that did not end.
    const std::vector<std::string>& unfinished_folders() const { return unfinished_folders_; }

private:
    enum class Transaction { none, plain, durable };
    /// How many there are, by state.
    struct Tally {
        std::array<std::uint64_t, v1::JobState_ARRAYSIZE> jobs{};
        std::array<std::uint64_t, v1::FrameState_ARRAYSIZE> frames{};
    };
    struct Running {
        std::int64_t started_ms = 0;  ///< by the steady clock
        double charged = 0.0;         ///< to its owner [s]
    };
    void begin(Transaction kind);
    void check_room(std::uint64_t jobs, std::uint64_t frames, const std::string& owner) const;
    void wait_for(std::uint64_t job, const v1::Job& asked, Moment now);
    void wait_no_longer(std::uint64_t job, std::uint64_t after, Moment now);
    void tell_those_that_wait(const v1::JobStatus& done, Moment now, std::vector<std::uint64_t>& ended);
    void look_after_waiting(Moment now);
    void reserve_number();
    std::int64_t insert_job(const v1::Job& job, const std::string& owner, const std::string& digest,
                            const std::string& scene_key, Moment now);
    void insert_frames(const v1::Job& job, std::int64_t id, Moment now);
    void count_all();
    void load_share();
    void recover(FrameKey key, Moment now);
    bool may_try_again(FrameKey key, Ending ending, double& wait);
    double set_frame(FrameKey key, v1::FrameState state, const v1::Error& error, std::int64_t not_before, Moment now);
    void move_frames(std::uint64_t job, v1::FrameState from, v1::FrameState to, std::uint64_t count, Moment now);
    void count_failure(std::uint64_t job, const v1::Error& error, Moment now);
    void end_waiting(std::uint64_t job, const v1::Error& why, bool failed, Moment now);
    std::string reason_of_end(std::uint64_t job) const;
    std::int64_t wait_again(std::uint64_t job, const std::vector<int>& numbers, Moment now);
    std::int64_t unfinished_before(std::uint64_t job) const;
    void hold(std::uint64_t job, Moment now);
    bool settle_one(std::uint64_t job, Moment now);
    void settle(std::uint64_t job, Moment now);
    void settle_after(std::vector<std::uint64_t> ended, Moment now);
    v1::JobStatus read_status(const Statement& row) const;
    std::shared_ptr<const v1::Job> spec(std::uint64_t job) const;

    std::string state_;
    Marker marker_;
    mutable Database database_;
    QueueOptions options_;
    Transaction transaction_ = Transaction::none;
    std::int64_t clock_begin_ms_ = 0;  ///< the queue's clock where the steady one says 0
    Tally tally_, committed_;          ///< of this transaction, and before it
    FairShare share_;
    std::vector<std::uint64_t> changed_;
    bool paused_ = false;
    std::map<FrameKey, Running> running_;  ///< frames of this server
    std::vector<std::string> unfinished_folders_;
    mutable std::map<std::uint64_t, std::shared_ptr<const v1::Job>> specs_;  ///< parsed lately
};

bool has_ended(v1::JobState state);

/// A job's frames, by what became of them.
struct FrameCounts {
    std::int64_t waiting = 0, active = 0, completed = 0, failed = 0, cancelled = 0;
};
/// What else its state depends on.
struct JobTraits {
    bool cancel = false;   ///< was asked for, or the queue did
    bool stopped = false;  ///< by the queue, with a reason
    bool paused = false;
    bool warned = false;  ///< some frame has warnings
};
v1::JobState state_of(const FrameCounts& counts, const JobTraits& traits);

}  // namespace rcs::service
