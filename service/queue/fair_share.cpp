#include "queue/fair_share.h"

#include <algorithm>
#include <cmath>

namespace rcs::service {
namespace {

constexpr double kUnknown = 1.0;  // what a frame is taken to need while none has ended [s]

}  // namespace

std::int64_t FairShare::slices(double used) const
{
    return static_cast<std::int64_t>(std::floor(used / options_.slice_seconds));
}

void FairShare::add(std::uint64_t job, const std::string& owner, int priority, bool held, std::int64_t entered_ms)
{
    outlook_.reset();
    Job& made = jobs_[job];
    take_out(job, made);
    made.entered_ms = entered_ms;
    made.owner = owner;
    made.priority = priority;
    made.held = held;
}

void FairShare::forget(std::uint64_t job)
{
    const auto found = jobs_.find(job);
    if (found == jobs_.end()) return;
    set_frames(job, {}, 0);
    jobs_.erase(found);
    outlook_.reset();
}

void FairShare::take_out(std::uint64_t number, Job& job)
{
    if (job.sleeps) sleeping_.erase({job.frames.retry_ms, number});
    job.sleeps = false;
    if (!job.turn) return;
    const auto level = levels_.find(job.priority);
    const auto ready = level->second.ready.find(job.owner);
    ready->second.erase(*job.turn);
    job.turn.reset();
    if (ready->second.empty()) level->second.ready.erase(ready);
    if (level->second.ready.empty()) levels_.erase(level);
}

void FairShare::put_in(std::uint64_t number, Job& job, std::int64_t clock_ms)
{
    if (job.held) return;
    if (job.frames.queued == 0 && !job.due) {
        job.sleeps = job.frames.retried > 0;
        if (job.sleeps) sleeping_.emplace(job.frames.retry_ms, number);
        return;
    }
    const auto [level, is_new] = levels_.try_emplace(job.priority);
    if (is_new) level->second.since_ms = clock_ms;
    std::set<Turn>& ready = level->second.ready[job.owner];
    if (!ready.empty())
        job.used = std::max(job.used, options_.slice_seconds * static_cast<double>(ready.begin()->first - 1));
    job.turn = Turn{slices(job.used), number};
    ready.insert(*job.turn);
}

/// An owner that had no frames has some.
void FairShare::join(const std::string& name, Owner& owner)
{
    std::optional<double> least;
    for (const auto& [other, with] : owners_) {
        if (other != name && with.waiting + with.active > 0) least = std::min(least.value_or(with.used), with.used);
    }
    if (least) owner.used = std::max(owner.used, *least - options_.slice_seconds);
}

void FairShare::set_frames(std::uint64_t job, const Frames& frames, std::int64_t clock_ms)
{
    outlook_.reset();
    Job& changed = jobs_.at(job);
    Owner& owner = owners_[changed.owner];
    if (owner.waiting + owner.active == 0 && frames.queued + frames.retried + frames.active > 0)
        join(changed.owner, owner);
    owner.waiting += frames.queued + frames.retried - changed.frames.queued - changed.frames.retried;
    owner.active += frames.active - changed.frames.active;
    const bool stays = changed.turn.has_value() && frames.queued > 0;
    if (!stays) take_out(job, changed);
    changed.frames = frames;
    changed.due = false;
    if (!stays) put_in(job, changed, clock_ms);
}

template <typename Value>
void FairShare::replace(std::uint64_t number, Value Job::* what, Value value, std::int64_t clock_ms)
{
    outlook_.reset();
    Job& job = jobs_.at(number);
    take_out(number, job);
    job.*what = value;
    put_in(number, job, clock_ms);
}

void FairShare::set_held(std::uint64_t job, bool held, std::int64_t clock_ms)
{
    replace(job, &Job::held, held, clock_ms);
}

void FairShare::set_priority(std::uint64_t job, int priority, std::int64_t clock_ms)
{
    replace(job, &Job::priority, priority, clock_ms);
}

void FairShare::set_history(std::uint64_t job, double seconds, std::int64_t frames)
{
    outlook_.reset();
    Job& known = jobs_.at(job);
    seconds_ += seconds - known.seconds;
    completed_ += frames - known.completed;
    known.seconds = seconds;
    known.completed = frames;
}

double FairShare::begin(std::uint64_t job, std::int64_t clock_ms)
{
    Job& begun = jobs_.at(job);
    if (const auto level = levels_.find(begun.priority); level != levels_.end()) {
        level->second.since_ms = clock_ms;
        level->second.last_owner = begun.owner;
        level->second.last_job = job;
    }
    const double expected = mean_seconds(begun);
    end(job, expected, 0.0, false);
    return expected;
}

void FairShare::end(std::uint64_t job, double seconds, double charged, bool completed)
{
    outlook_.reset();
    const auto found = jobs_.find(job);
    if (found == jobs_.end()) return;
    Job& ended = found->second;
    owners_[ended.owner].used += seconds - charged;
    ended.used += seconds - charged;
    if (completed) {
        ended.seconds += seconds;
        ++ended.completed;
        seconds_ += seconds;
        ++completed_;
    }
    if (!ended.turn || slices(ended.used) == ended.turn->first) return;
    std::set<Turn>& ready = levels_.at(ended.priority).ready.at(ended.owner);
    ready.erase(*ended.turn);
    ended.turn->first = slices(ended.used);
    ready.insert(*ended.turn);
}

/// @return his slices, and who; none: all have as many frames running as they may
std::optional<std::pair<std::int64_t, std::string>> FairShare::owner_of_turn(const Level& level) const
{
    std::optional<std::pair<std::int64_t, std::string>> best;
    for (const auto& [name, ready] : level.ready) {
        const Owner& owner = owners_.at(name);
        if (options_.owner_running > 0 && owner.active >= options_.owner_running) continue;
        const std::int64_t had = slices(owner.used);
        if (!best || had < best->first || (had == best->first && name == level.last_owner)) best = {had, name};
    }
    return best;
}

std::uint64_t FairShare::job_of_turn(const Level& level, const std::string& owner) const
{
    const std::set<Turn>& ready = level.ready.at(owner);
    const std::int64_t least = ready.begin()->first;
    return ready.contains({least, level.last_job}) ? level.last_job : ready.begin()->second;
}

std::optional<std::uint64_t> FairShare::next(std::int64_t clock_ms, std::int64_t steady_ms)
{
    // A frame whose pause is over is as good as one that never failed.
    while (!sleeping_.empty() && sleeping_.begin()->first <= steady_ms) {
        const std::uint64_t number = sleeping_.begin()->second;
        Job& job = jobs_.at(number);
        take_out(number, job);
        job.due = true;
        put_in(number, job, clock_ms);
    }
    double best = 0.0;
    const Level* chosen = nullptr;
    std::string owner;
    for (const auto& [priority, level] : levels_) {
        const double rank = priority - 1e-3 * static_cast<double>(level.since_ms) / options_.ageing_seconds;
        if (chosen != nullptr && rank <= best) continue;
        const auto turn = owner_of_turn(level);
        if (!turn) continue;
        best = rank;
        chosen = &level;
        owner = turn->second;
    }
    if (chosen == nullptr) return std::nullopt;
    return job_of_turn(*chosen, owner);
}

std::set<std::uint64_t> FairShare::jobs() const
{
    std::set<std::uint64_t> numbers;
    for (const auto& [number, job] : jobs_) numbers.insert(number);
    return numbers;
}

std::int64_t FairShare::frames_of(const std::string& owner) const
{
    const auto found = owners_.find(owner);
    return found == owners_.end() ? 0 : found->second.waiting + found->second.active;
}

std::optional<std::int64_t> FairShare::next_retry_ms() const
{
    return sleeping_.empty() ? std::nullopt : std::optional(sleeping_.begin()->first);
}

double FairShare::mean_seconds(const Job& job) const
{
    if (job.completed > 0) return job.seconds / static_cast<double>(job.completed);
    return completed_ > 0 ? seconds_ / static_cast<double>(completed_) : kUnknown;
}

double FairShare::left_seconds(const Job& job) const
{
    const Frames& frames = job.frames;
    return mean_seconds(job) *
           (static_cast<double>(frames.queued + frames.retried) + 0.5 * static_cast<double>(frames.active));
}

const ShareOutlook& FairShare::outlook() const
{
    if (outlook_) return *outlook_;
    ShareOutlook& made = outlook_.emplace();
    for (const auto& [number, job] : jobs_) {
        if (!job.held) made.levels[job.priority].left.push_back(left_seconds(job));
    }
    for (auto& [priority, level] : made.levels) {
        std::sort(level.left.begin(), level.left.end());
        level.before = made.all;
        level.sums.push_back(0.0);
        for (const double left : level.left) level.sums.push_back(level.sums.back() + left);
        made.all += level.sums.back();
    }
    return made;
}

std::optional<double> FairShare::eta_seconds(std::uint64_t job, int workers) const
{
    const auto found = jobs_.find(job);
    if (found == jobs_.end() || found->second.held || completed_ == 0 || workers == 0) return std::nullopt;
    const double own = left_seconds(found->second);
    const ShareOutlook::Level& level = outlook().levels.at(found->second.priority);
    // Those of equal priority take turns with it until one of both has ended.
    const auto shorter =
        static_cast<std::size_t>(std::upper_bound(level.left.begin(), level.left.end(), own) - level.left.begin());
    const double beside = level.sums[shorter] + own * static_cast<double>(level.left.size() - shorter);
    return (level.before + beside) / workers;
}

std::optional<double> FairShare::eta_seconds(int workers) const
{
    if (completed_ == 0 || workers == 0) return std::nullopt;
    return outlook().all / workers;
}

}  // namespace rcs::service
