#include "queue/salvage.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>

#include "queue/database.h"
#include "queue/job_queue.h"
#include "queue/queue_file.h"
#include "wire/errors.h"
#include "wire/files.h"
#include "wire/sha256.h"

namespace rcs::service {
namespace {

namespace fs = std::filesystem;

constexpr const char* kJobColumns =
    "id, owner, key, digest, spec, scene, scene_key, priority, state, submitted, started, finished, frames, "
    "error_code, "
    "error";
constexpr int kJobColumnCount = 15;
constexpr const char* kFrameColumns =
    "job, idx, number, spec, state, rank, starts, tries, deaths, started, finished, error_code, error, folder, "
    "estimate, stats, warnings";
constexpr int kFrameColumnCount = 17;
constexpr const char* kFileColumns = "job, idx, name, size, sha256";
constexpr int kFileColumnCount = 5;

std::string insert_into(const char* table, const char* columns, int count)
{
    std::string values = "?";
    for (int i = 1; i < count; ++i) values += ", ?";
    return std::string("INSERT OR IGNORE INTO ") + table + " (" + columns + ") VALUES (" + values + ")";
}

class Salvage {
public:
    Salvage(const std::string& state, const std::string& old_path, Database& made, Moment now)
        : state_(state), made_(made), now_(now)
    {
        try {
            old_ = std::make_unique<Database>(old_path);
        } catch (const ServiceError&) {
            // Nothing of it can be read.
        }
    }

    Salvaged run(std::uint64_t numbers)
    {
        done_.numbers = std::max({numbers, largest("SELECT max(id) FROM jobs"),
                                  largest("SELECT max(seq) FROM sqlite_sequence"), largest_folder()});
        made_.run("BEGIN IMMEDIATE");
        for (std::uint64_t job = 1; old_ && job <= done_.numbers; ++job) salvage_job(static_cast<std::int64_t>(job));
        made_.run("DELETE FROM sqlite_sequence");
        Statement(made_, "INSERT INTO sqlite_sequence (name, seq) VALUES ('jobs', ?)")
            .bind(static_cast<std::int64_t>(done_.numbers))
            .run();
        made_.run("COMMIT");
        return done_;
    }

private:
    /// Reads rows of the old database; one that cannot be read counts as lost.
    template <typename Use>
    bool read(const std::string& sql, std::initializer_list<std::int64_t> values, const Use& use)
    {
        std::optional<Statement> row;
        const auto step = [&] {
            try {
                if (!row) {
                    row.emplace(*old_, sql.c_str());
                    for (const std::int64_t value : values) row->bind(value);
                }
                return row->step();
            } catch (const ServiceError&) {
                ++done_.lost;
                return false;
            }
        };
        bool any = false;
        for (; step(); any = true) use(*row);
        return any;
    }

    std::uint64_t largest(const char* sql)
    {
        std::uint64_t found = 0;
        if (old_) read(sql, {}, [&](const Statement& row) { found = static_cast<std::uint64_t>(row.integer(0)); });
        constexpr std::uint64_t kPlausible = std::uint64_t{1} << 32;  // damage may say anything
        return found < kPlausible ? found : 0;
    }

    /// Results lie in folders that begin with their job's number.
    std::uint64_t largest_folder() const
    {
        std::uint64_t found = 0;
        std::error_code ignored;
        for (const auto& entry : fs::directory_iterator(state_ + "/results", ignored)) {
            found = std::max<std::uint64_t>(found, std::strtoull(entry.path().filename().c_str(), nullptr, 10));
        }
        return found;
    }

    template <typename Statement>
    static void copy(Statement& to, const Statement& from, int columns)
    {
        for (int i = 0; i < columns; ++i) to.bind_column(from, i);
        to.run();
    }

    void salvage_job(std::int64_t job)
    {
        std::int64_t frames = 0;
        bool cancel = false;
        read(std::string("SELECT ") + kJobColumns + " FROM jobs WHERE id=?", {job}, [&](const Statement& row) {
            v1::Job spec;
            if (!spec.ParseFromString(row.text(4)) || !v1::JobState_IsValid(static_cast<int>(row.integer(8)))) {
                ++done_.lost;
                return;
            }
            Statement insert(made_, insert_into("jobs", kJobColumns, kJobColumnCount).c_str());
            copy(insert, row, kJobColumnCount);
            if (made_.changed() == 0) return;  // its key is another one's
            Statement label(made_, "INSERT INTO labels (job, name, value) VALUES (?, ?, ?)");
            for (const auto& [name, value] : spec.labels()) label.bind(job).bind(name).bind(value).run();
            frames = row.integer(12);
            cancel = row.integer(8) == v1::JOB_STATE_CANCEL_REQUESTED;
        });
        if (frames == 0) return;
        ++done_.jobs;
        read("SELECT job, digest FROM job_blobs WHERE job=?", {job}, [&](const Statement& row) {
            Statement insert(made_, "INSERT OR IGNORE INTO job_blobs (job, digest) VALUES (?, ?)");
            copy(insert, row, 2);
        });
        for (std::int64_t index = 0; index < frames; ++index) salvage_frame(job, index);
        settle(job, cancel);
    }

    void salvage_frame(std::int64_t job, std::int64_t index)
    {
        bool found = false, has_pictures = true;
        read(std::string("SELECT ") + kFrameColumns + " FROM frames WHERE job=? AND idx=?", {job, index},
             [&](const Statement& row) {
                 if (!v1::Frame().ParseFromString(row.text(3)) ||
                     !v1::FrameState_IsValid(static_cast<int>(row.integer(4))))
                     return;
                 Statement insert(made_, insert_into("frames", kFrameColumns, kFrameColumnCount).c_str());
                 copy(insert, row, kFrameColumnCount);
                 found = made_.changed() > 0;
                 if (found && row.integer(4) == v1::FRAME_STATE_COMPLETED)
                     has_pictures = salvage_files(job, index, row.text(13));
             });
        if (!found) {
            ++done_.lost;
            insert_lost_frame(job, index);
            return;
        }
        ++done_.frames;
        if (has_pictures) return;
        ++done_.again;
        Statement(made_, "DELETE FROM files WHERE job=? AND idx=?").bind(job).bind(index).run();
        Statement(made_, "UPDATE frames SET state=1, folder='', finished=0 WHERE job=? AND idx=?")
            .bind(job)
            .bind(index)
            .run();
    }

    /// @return whether all the frame's pictures are there
    bool salvage_files(std::int64_t job, std::int64_t index, const std::string& folder)
    {
        bool whole = true;
        const bool any = read(std::string("SELECT ") + kFileColumns + " FROM files WHERE job=? AND idx=?", {job, index},
                              [&](const Statement& row) {
                                  Statement insert(made_, insert_into("files", kFileColumns, kFileColumnCount).c_str());
                                  copy(insert, row, kFileColumnCount);
                                  std::error_code ignored;
                                  const auto size = fs::file_size(state_ + "/" + folder + "/" + row.text(2), ignored);
                                  whole = whole && !ignored && size == static_cast<std::uintmax_t>(row.integer(3));
                              });
        return any && whole;
    }

    /// It stands for a row that is lost, so that its job does not seem complete.
    void insert_lost_frame(std::int64_t job, std::int64_t index)
    {
        Statement free(made_, "SELECT coalesce(max(number)+1, 0) FROM frames WHERE job=?");
        free.bind(job).step();
        Statement(made_,
                  "INSERT INTO frames (job, idx, number, spec, state, rank, error_code, error) VALUES (?, ?, ?, ?, ?, "
                  "0, ?, 'this frame was lost with the queue''s database; submit it again')")
            .bind(job)
            .bind(index)
            .bind(free.integer(0))
            .bind_blob("")
            .bind(std::int64_t{v1::FRAME_STATE_FAILED})
            .bind(std::int64_t{v1::ERROR_CODE_INTERNAL})
            .run();
    }

    void settle(std::int64_t job, bool cancel)
    {
        FrameCounts counts;
        Statement row(made_, "SELECT state, count(*), max(warnings<>'') FROM frames WHERE job=? GROUP BY state");
        row.bind(job);
        bool warned = false;
        while (row.step()) {
            const auto state = static_cast<v1::FrameState>(row.integer(0));
            (state == v1::FRAME_STATE_ACTIVE      ? counts.active
             : state == v1::FRAME_STATE_COMPLETED ? counts.completed
             : state == v1::FRAME_STATE_FAILED    ? counts.failed
             : state == v1::FRAME_STATE_CANCELLED ? counts.cancelled
                                                  : counts.waiting) += row.integer(1);
            warned = warned || row.integer(2) != 0;
        }
        const v1::JobState state = state_of(counts, cancel, warned);
        Statement(made_,
                  "UPDATE jobs SET state=?, active=?, completed=?, failed=?, cancelled=?, ended=?, finished=CASE WHEN "
                  "?6=0 THEN 0 ELSE finished END WHERE id=?")
            .bind(std::int64_t{state})
            .bind(counts.active)
            .bind(counts.completed)
            .bind(counts.failed)
            .bind(counts.cancelled)
            .bind(has_ended(state) ? now_.wall_ms : std::int64_t{0})
            .bind(job)
            .run();
        if (counts.failed > 0) {
            Statement(made_,
                      "UPDATE jobs SET (error_code, error) = (SELECT error_code, error FROM frames WHERE job=?1 AND "
                      "state=5 ORDER BY idx LIMIT 1) WHERE id=?1 AND error_code=0")
                .bind(job)
                .run();
        }
    }

    std::string state_;
    std::unique_ptr<Database> old_;
    Database& made_;
    Moment now_;
    Salvaged done_;
};

void rename_file(const std::string& from, const std::string& to)
{
    std::error_code problem;
    fs::rename(from, to, problem);
    if (problem && problem != std::errc::no_such_file_or_directory)
        throw ServiceError(v1::ERROR_CODE_INTERNAL, "cannot rename " + from + ": " + problem.message());
}

}  // namespace

Salvaged salvage_queue(const std::string& state, Moment now)
{
    // The old files lie here until all is done: a salvage that is broken off finds them again.
    const std::string damaged = state + "/damaged", path = queue_path(state), making = path + ".new";
    make_private_folder(state + "/aside");
    make_private_folder(damaged);
    for (const char* ending : {"", "-wal", "-shm"}) rename_file(path + ending, damaged + "/queue.db" + ending);
    std::error_code ignored;
    for (const char* ending : {"", "-wal", "-shm", "-journal"}) fs::remove(making + ending, ignored);
    Marker marker{random_id(), read_marker(state).value_or(Marker()).numbers};
    Salvaged done;
    {
        Database made(making);
        make_tables(made, marker, now);
        done = Salvage(state, damaged + "/queue.db", made, now).run(marker.numbers);
        marker.numbers = done.numbers;
    }
    write_marker(state, marker);
    sync_path(making);
    rename_file(making, path);
    const std::string aside = state + "/aside/queue." + marker.id;
    rename_file(damaged, aside);
    set_modified(aside, now.wall_ms);  // which the new queue's clock begins with
    sync_path(state);
    return done;
}

}  // namespace rcs::service
