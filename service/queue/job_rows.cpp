// What is read from the queue; job_queue.cpp changes it.
#include <sstream>

#include "queue/job_queue.h"
#include "wire/errors.h"
#include "wire/framing.h"

namespace rcs::service {
namespace {

constexpr const char* kStatusColumns =
    "id, state, priority, scene, owner, submitted, started, finished, frames, completed, failed, active, "
    "error_code, error, cancelled, waited, seconds, estimate, entered, delivered, delivery_error, waits";
constexpr std::size_t kMostBytes = kMaxMessage - (64 << 10);  // of a list's jobs: the rest of the message takes little
constexpr std::uint32_t kFewFrames = 10;                      // whose statistics fit into a message
constexpr std::size_t kSpecsKept = 64;

v1::Error read_error(const Statement& row, int code_column)
{
    v1::Error error;
    error.set_code(static_cast<v1::ErrorCode>(row.integer(code_column)));
    error.set_message(row.text(code_column + 1));
    return error;
}

}  // namespace

/// @return none: it does not parse
std::shared_ptr<const v1::Job> JobQueue::spec(std::uint64_t job) const
{
    const auto known = specs_.find(job);
    if (known != specs_.end()) return known->second;
    Statement row(database_, "SELECT spec FROM jobs WHERE id=?");
    row.bind(static_cast<std::int64_t>(job)).step();
    const auto parsed = std::make_shared<v1::Job>();
    if (!parsed->ParseFromString(row.text(0))) return nullptr;
    if (specs_.size() >= kSpecsKept) specs_.clear();
    return specs_.emplace(job, parsed).first->second;
}

std::optional<NextFrame> JobQueue::next(Moment now)
{
    if (paused_) return std::nullopt;
    const auto job = share_.next(clock_ms(now), now.steady_ms);
    if (!job) return std::nullopt;
    // One whose pause is over, else the first that was never begun.
    for (const char* which : {"state=3 AND not_before<=? ORDER BY not_before", "state=1 AND ?>=0 ORDER BY idx"}) {
        Statement row(database_,
                      (std::string("SELECT idx, spec FROM frames WHERE job=? AND ") + which + " LIMIT 1").c_str());
        if (!row.bind(static_cast<std::int64_t>(*job)).bind(now.steady_ms).step()) continue;
        NextFrame next;
        next.key = {*job, static_cast<int>(row.integer(0))};
        if (next.frame.ParseFromString(row.text(1))) next.job = spec(*job);
        Statement of_job(database_, "SELECT scene_key, owner FROM jobs WHERE id=?");
        of_job.bind(static_cast<std::int64_t>(*job)).step();
        next.scene_key = of_job.text(0);
        next.owner = of_job.text(1);
        return next;
    }
    return std::nullopt;
}

v1::JobStatus JobQueue::read_status(const Statement& row) const
{
    v1::JobStatus status;
    status.set_job(static_cast<std::uint64_t>(row.integer(0)));
    status.set_state(static_cast<v1::JobState>(row.integer(1)));
    status.set_priority(static_cast<int>(row.integer(2)));
    status.set_scene(row.text(3));
    status.set_owner(row.text(4));
    status.set_submitted_ms(row.integer(5));
    status.set_started_ms(row.integer(6));
    status.set_finished_ms(row.integer(7));
    status.set_frames(static_cast<int>(row.integer(8)));
    status.set_frames_completed(static_cast<int>(row.integer(9)));
    status.set_frames_failed(static_cast<int>(row.integer(10)));
    status.set_frames_active(static_cast<int>(row.integer(11)));
    if (row.integer(12) != 0) *status.mutable_error() = read_error(row, 12);
    status.set_frames_cancelled(static_cast<int>(row.integer(14)));
    status.set_waited_seconds(1e-3 * static_cast<double>(row.integer(15)));
    status.set_busy_seconds(row.real(16));
    if (status.frames_completed() > 0) status.set_error_estimate(row.real(17) / status.frames_completed());
    status.set_frames_delivered(static_cast<int>(row.integer(19)));
    status.set_delivery_error(row.text(20));
    const int ended = status.frames_completed() + status.frames_failed() + status.frames_cancelled();
    status.set_fraction(static_cast<double>(ended) / status.frames());
    if (row.integer(21) > 0) {
        Statement after(database_, "SELECT after FROM job_after WHERE job=? AND NOT done");
        after.bind(row.integer(0));
        while (after.step()) status.add_waits_for(static_cast<std::uint64_t>(after.integer(0)));
    }
    Statement label(database_, "SELECT name, value FROM labels WHERE job=?");
    label.bind(row.integer(0));
    while (label.step()) (*status.mutable_labels())[label.text(0)] = label.text(1);
    return status;
}

std::optional<v1::JobStatus> JobQueue::status(std::uint64_t job) const
{
    Statement row(database_, (std::string("SELECT ") + kStatusColumns + " FROM jobs WHERE id=?").c_str());
    return row.bind(static_cast<std::int64_t>(job)).step() ? std::optional(read_status(row)) : std::nullopt;
}

std::string JobQueue::owner(std::uint64_t job) const
{
    Statement row(database_, "SELECT owner FROM jobs WHERE id=?");
    return row.bind(static_cast<std::int64_t>(job)).step() ? row.text(0) : "";
}

v1::ListReply JobQueue::list(const v1::ListRequest& request, const std::string& owner) const
{
    constexpr std::uint32_t kDefault = 100;
    const std::size_t limit = request.limit() != 0 ? request.limit() : kDefault;
    std::string states;
    for (const int state : request.states()) states.append(states.empty() ? "" : ",").append(std::to_string(state));
    std::string wanted = "id<? AND (?2='' OR owner=?2) AND (?3='' OR owner=?3)";
    if (!states.empty()) wanted += " AND state IN (" + states + ")";
    for (int i = 0; i < static_cast<int>(request.labels().size()); ++i)
        wanted += " AND EXISTS (SELECT 1 FROM labels WHERE job=id AND name=? AND value=?)";
    Statement row(
        database_,
        (std::string("SELECT ") + kStatusColumns + " FROM jobs WHERE " + wanted + " ORDER BY id DESC").c_str());
    row.bind(request.before() != 0 ? static_cast<std::int64_t>(request.before()) : INT64_MAX)
        .bind(owner)
        .bind(request.owner());
    for (const auto& [name, value] : request.labels()) row.bind(name).bind(value);
    v1::ListReply reply;
    std::size_t bytes = 0;
    while (row.step()) {
        v1::JobStatus status = read_status(row);
        bytes += status.ByteSizeLong() + 8;
        if (static_cast<std::size_t>(reply.jobs_size()) == limit || bytes > kMostBytes) {
            reply.set_more(true);
            break;
        }
        *reply.add_jobs() = std::move(status);
    }
    return reply;
}

v1::JobReply JobQueue::details(const v1::JobRequest& request) const
{
    constexpr std::uint32_t kDefault = 100;
    const std::uint32_t count = request.frames() != 0 ? request.frames() : kDefault;
    const auto id = static_cast<std::int64_t>(request.job());
    v1::JobReply reply;
    *reply.mutable_status() = *status(request.job());
    if (const auto job = spec(request.job())) *reply.mutable_job() = *job;
    if (reply.job().ByteSizeLong() > kMostBytes / 2) reply.mutable_job()->mutable_scene()->clear_files();

    std::string states;
    for (const int state : request.states()) states.append(states.empty() ? "" : ",").append(std::to_string(state));
    Statement row(database_,
                  ("SELECT idx, number, state, starts, error_code, error, started, finished, estimate, "
                   "stats, warnings, delivery FROM frames WHERE job=? " +
                   (states.empty() ? "" : "AND state IN (" + states + ") ") + "ORDER BY idx LIMIT ? OFFSET ?")
                      .c_str());
    row.bind(id).bind(std::int64_t{count}).bind(std::int64_t{request.first_frame()});
    std::size_t bytes = reply.ByteSizeLong();
    while (row.step()) {
        v1::FrameStatus frame;
        frame.set_number(static_cast<int>(row.integer(1)));
        frame.set_state(static_cast<v1::FrameState>(row.integer(2)));
        frame.set_attempts(static_cast<int>(row.integer(3)));
        if (row.integer(4) != 0) *frame.mutable_error() = read_error(row, 4);
        if (row.integer(7) != 0) frame.set_seconds(1e-3 * static_cast<double>(row.integer(7) - row.integer(6)));
        frame.set_error_estimate(row.real(8));
        frame.set_started_ms(row.integer(6));
        frame.set_finished_ms(row.integer(7));
        frame.set_delivered(row.integer(11) == 2);
        if (count <= kFewFrames) frame.set_stats_json(row.text(9));
        std::istringstream warnings(row.text(10));
        for (std::string line; std::getline(warnings, line);) frame.add_warnings(line);
        Statement file(database_, "SELECT name, size, sha256 FROM files WHERE job=? AND idx=?");
        file.bind(id).bind(row.integer(0));
        while (file.step()) {
            v1::OutputFile& made = *frame.add_files();
            made.set_name(file.text(0));
            made.set_size(static_cast<std::uint64_t>(file.integer(1)));
            made.set_sha256(file.text(2));
        }
        bytes += frame.ByteSizeLong() + 8;
        if (bytes > kMostBytes) break;
        *reply.add_frames() = std::move(frame);
    }
    return reply;
}

std::optional<int> JobQueue::index_of(std::uint64_t job, int frame_number) const
{
    Statement row(database_, "SELECT idx FROM frames WHERE job=? AND number=?");
    return row.bind(static_cast<std::int64_t>(job)).bind(std::int64_t{frame_number}).step()
               ? std::optional(static_cast<int>(row.integer(0)))
               : std::nullopt;
}

std::optional<std::pair<v1::OutputFile, std::string>> JobQueue::file(FrameKey key, const std::string& name) const
{
    Statement row(database_,
                  "SELECT i.size, i.sha256, f.folder FROM files i JOIN frames f ON f.job=i.job AND f.idx=i.idx "
                  "WHERE i.job=? AND i.idx=? AND i.name=?");
    if (!row.bind(static_cast<std::int64_t>(key.job)).bind(std::int64_t{key.index}).bind(name).step())
        return std::nullopt;
    v1::OutputFile file;
    file.set_name(name);
    file.set_size(static_cast<std::uint64_t>(row.integer(0)));
    file.set_sha256(row.text(1));
    return std::pair(file, row.text(2) + "/" + name);
}

std::string JobQueue::folder(FrameKey key) const
{
    Statement row(database_, "SELECT folder FROM frames WHERE job=? AND idx=? AND state=4");
    return row.bind(static_cast<std::int64_t>(key.job)).bind(std::int64_t{key.index}).step() ? row.text(0) : "";
}

bool JobQueue::is_cancelled(std::uint64_t job) const
{
    Statement row(database_, "SELECT state FROM jobs WHERE id=?");
    if (!row.bind(static_cast<std::int64_t>(job)).step()) return true;
    return row.integer(0) == v1::JOB_STATE_CANCEL_REQUESTED || row.integer(0) == v1::JOB_STATE_CANCELLED;
}

std::vector<FrameKey> JobQueue::active_frames() const
{
    std::vector<FrameKey> keys;
    Statement row(database_, "SELECT job, idx FROM frames WHERE state=2");
    while (row.step()) keys.push_back({static_cast<std::uint64_t>(row.integer(0)), static_cast<int>(row.integer(1))});
    return keys;
}

std::vector<JobQueue::Ended> JobQueue::ended_jobs() const
{
    std::vector<Ended> jobs;
    Statement row(
        database_,
        "SELECT id, ended, bytes FROM jobs WHERE ended>0 AND NOT EXISTS (SELECT 1 FROM frames WHERE job=id AND "
        "delivery=1) ORDER BY ended, id");
    while (row.step()) {
        jobs.push_back(
            {static_cast<std::uint64_t>(row.integer(0)), row.integer(1), static_cast<std::uint64_t>(row.integer(2))});
    }
    return jobs;
}

std::set<std::string> JobQueue::blobs_of(std::uint64_t job) const
{
    std::set<std::string> digests;
    Statement row(database_, "SELECT digest FROM job_blobs WHERE job=?");
    row.bind(static_cast<std::int64_t>(job));
    while (row.step()) digests.insert(row.text(0));
    return digests;
}

std::set<std::string> JobQueue::blobs_in_use() const
{
    std::set<std::string> digests;
    Statement row(database_, "SELECT DISTINCT job_blobs.digest FROM job_blobs JOIN jobs ON id=job WHERE ended=0");
    while (row.step()) digests.insert(row.text(0));
    return digests;
}

std::set<std::string> JobQueue::scenes_in_use() const
{
    std::set<std::string> keys;
    Statement row(database_, "SELECT DISTINCT scene_key FROM jobs WHERE ended=0");
    while (row.step()) keys.insert(row.text(0));
    return keys;
}

std::vector<std::string> JobQueue::folders_of(std::uint64_t job) const
{
    std::vector<std::string> folders;
    Statement row(database_, "SELECT folder FROM frames WHERE job=? AND state=4");
    row.bind(static_cast<std::int64_t>(job));
    while (row.step()) folders.push_back(row.text(0));
    return folders;
}

std::set<std::string> JobQueue::folders_in_use() const
{
    std::set<std::string> folders;
    Statement row(database_, "SELECT folder FROM frames WHERE state=4");
    while (row.step()) folders.insert(row.text(0));
    return folders;
}

}  // namespace rcs::service
