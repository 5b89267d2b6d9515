// What follows the ends of frames and jobs: deliveries, announcements.
#include "queue/job_queue.h"

namespace rcs::service {

std::vector<JobQueue::Undelivered> JobQueue::undelivered(int most) const
{
    std::vector<Undelivered> frames;
    Statement row(database_, "SELECT job, idx, folder FROM frames WHERE delivery=1 ORDER BY job, idx LIMIT ?");
    row.bind(std::int64_t{most});
    while (row.step()) {
        frames.push_back({{static_cast<std::uint64_t>(row.integer(0)), static_cast<int>(row.integer(1))}, row.text(2)});
    }
    return frames;
}

v1::FrameStatus JobQueue::files_of(FrameKey key) const
{
    v1::FrameStatus frame;
    Statement row(database_,
                  "SELECT f.number, i.name FROM frames f JOIN files i ON i.job=f.job AND i.idx=f.idx WHERE f.job=? AND "
                  "f.idx=?");
    row.bind(static_cast<std::int64_t>(key.job)).bind(std::int64_t{key.index});
    while (row.step()) {
        frame.set_number(static_cast<int>(row.integer(0)));
        frame.add_files()->set_name(row.text(1));
    }
    return frame;
}

void JobQueue::end_delivery(FrameKey key, const std::string& error)
{
    const auto job = static_cast<std::int64_t>(key.job);
    begin(Transaction::plain);
    if (error.empty()) {
        Statement(database_, "UPDATE frames SET delivery=2 WHERE job=? AND idx=? AND delivery=1")
            .bind(job)
            .bind(std::int64_t{key.index})
            .run();
        Statement(database_, "UPDATE jobs SET delivered=delivered+?, delivery_error='' WHERE id=?")
            .bind(std::int64_t{database_.changed()})
            .bind(job)
            .run();
    } else {
        Statement(database_, "UPDATE jobs SET delivery_error=? WHERE id=?").bind(error).bind(job).run();
    }
    changed_.push_back(key.job);
}

std::vector<std::uint64_t> JobQueue::unannounced(int most) const
{
    std::vector<std::uint64_t> jobs;
    Statement row(database_, "SELECT id FROM jobs WHERE announce=1 ORDER BY id LIMIT ?");
    row.bind(std::int64_t{most});
    while (row.step()) jobs.push_back(static_cast<std::uint64_t>(row.integer(0)));
    return jobs;
}

void JobQueue::end_announcement(std::uint64_t job)
{
    begin(Transaction::plain);
    Statement(database_, "UPDATE jobs SET announce=0 WHERE id=?").bind(static_cast<std::int64_t>(job)).run();
}

}  // namespace rcs::service
