#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

namespace rcs::service {

struct ShareOptions {
    double ageing_seconds = 600.0;  ///< of waiting that count as one step of priority, > 0
    double slice_seconds = 60.0;    ///< of a worker, in which owners and jobs take turns, > 0
    int owner_running = 0;          ///< frames of one owner that run at a time; 0: as many as there are workers
};

/// What is left to do, for estimates.
struct ShareOutlook {
    struct Level {
        std::vector<double> left, sums;  ///< of its jobs, ascending; sums[i] of the first i [s]
        double before = 0.0;             ///< of levels that come first [s]
    };
    std::map<int, Level, std::greater<>> levels;
    double all = 0.0;
};

/// Whose frame is started next. Jobs of equal priority are a level. The level with the highest priority comes first,
/// each raised by a step for every `ageing_seconds` since a frame of it was started. Within a level owners share the
/// workers' time, and the jobs of an owner share his: whoever has had fewest slices of it comes first, in doubt who had
/// the last frame (his scene is loaded), then who came first. Who comes newly, or again, has had a slice less than the
/// others: what he left unused before is not made up for.
///
/// Knows unfinished jobs alone, by counts of their frames, and nothing of disks. A question takes the logarithm of
/// their number, besides looks at each of the 201 levels and at the owners of one.
class FairShare {
public:
    /// Of a job.
    struct Frames {
        std::int64_t queued = 0, retried = 0, active = 0;  ///< retried: wait after a failure
        std::int64_t retry_ms = 0;                         ///< when the first of those may start, by the steady clock
    };

    void set_options(const ShareOptions& options) { options_ = options; }

    /// @param held  no frame of it may start   @param entered_ms  when it came, by the queue's clock
    void add(std::uint64_t job, const std::string& owner, int priority, bool held, std::int64_t entered_ms);
    void forget(std::uint64_t job);
    /// @param clock_ms  now, or since when they wait, by the queue's clock
    void set_frames(std::uint64_t job, const Frames& frames, std::int64_t clock_ms);
    void set_held(std::uint64_t job, bool held, std::int64_t clock_ms);
    void set_priority(std::uint64_t job, int priority, std::int64_t clock_ms);
    /// What its frames took so far, for estimates.
    void set_history(std::uint64_t job, double seconds, std::int64_t frames);

    /// A frame was started. @return what it is expected to take, which was charged [s]
    double begin(std::uint64_t job, std::int64_t clock_ms);
    /// It took so long; `charged` is what begin() returned. @param completed  it counts for estimates
    void end(std::uint64_t job, double seconds, double charged, bool completed);

    /// @param steady_ms  of frames that wait after a failure
    std::optional<std::uint64_t> next(std::int64_t clock_ms, std::int64_t steady_ms);

    bool has(std::uint64_t job) const { return jobs_.contains(job); }
    std::int64_t entered_ms(std::uint64_t job) const { return jobs_.at(job).entered_ms; }
    const Frames& frames(std::uint64_t job) const { return jobs_.at(job).frames; }
    std::set<std::uint64_t> jobs() const;
    /// Unfinished frames.
    std::int64_t frames_of(const std::string& owner) const;
    /// When the first frame that waits after a failure, and that nothing else holds, may start. [steady ms]
    std::optional<std::int64_t> next_retry_ms() const;

    /// About so long until the job's last frame ends, and until all do, on so many workers. None: nothing is known yet.
    std::optional<double> eta_seconds(std::uint64_t job, int workers) const;
    std::optional<double> eta_seconds(int workers) const;

private:
    using Turn = std::pair<std::int64_t, std::uint64_t>;  ///< slices that a job has had, and its number
    struct Job {
        std::string owner;
        int priority = 0;
        bool held = false;
        std::int64_t entered_ms = 0;
        Frames frames;
        double used = 0.0;     ///< of its owner's time [s]
        double seconds = 0.0;  ///< that its completed frames took
        std::int64_t completed = 0;
        std::optional<Turn> turn;  ///< where it is among those that are ready
        bool sleeps = false;       ///< until its retry
        bool due = false;          ///< its retry may start
    };
    struct Owner {
        double used = 0.0;  ///< of the workers' time [s]
        std::int64_t waiting = 0, active = 0;
    };
    struct Level {
        std::int64_t since_ms = 0;  ///< a frame was started, or it had none to start
        std::string last_owner;
        std::uint64_t last_job = 0;
        std::map<std::string, std::set<Turn>> ready;  ///< jobs by owner
    };

    /// Made when it is asked for, valid until something changes.
    const ShareOutlook& outlook() const;
    std::int64_t slices(double used) const;
    void take_out(std::uint64_t number, Job& job);
    void put_in(std::uint64_t number, Job& job, std::int64_t clock_ms);
    /// Changes what a job's place hangs on.
    template <typename Value>
    void replace(std::uint64_t number, Value Job::* what, Value value, std::int64_t clock_ms);
    void join(const std::string& name, Owner& owner);
    std::optional<std::pair<std::int64_t, std::string>> owner_of_turn(const Level& level) const;
    std::uint64_t job_of_turn(const Level& level, const std::string& owner) const;
    double mean_seconds(const Job& job) const;
    double left_seconds(const Job& job) const;

    ShareOptions options_;
    std::unordered_map<std::uint64_t, Job> jobs_;
    std::map<std::string, Owner> owners_;
    std::map<int, Level> levels_;  ///< by priority; those with ready jobs
    std::set<std::pair<std::int64_t, std::uint64_t>> sleeping_;
    double seconds_ = 0.0;  ///< of all completed frames that are known of
    std::int64_t completed_ = 0;
    mutable std::optional<ShareOutlook> outlook_;
};

}  // namespace rcs::service
