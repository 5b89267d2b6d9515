#include "queue/salvage.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>

#include "queue/database.h"
#include "queue/job_queue.h"
#include "queue/queue_file.h"
#include "queue/schema.h"
#include "wire/errors.h"
#include "wire/files.h"
#include "wire/sha256.h"

namespace rcs::service {
namespace {

namespace fs = std::filesystem;

/// Columns of a table: those that each version has, and those of this one.
struct Columns {
    const char* table;
    const char* all;
    int count;
    const char* newer = "";
    int newer_count = 0;
};
constexpr Columns kJobs{"jobs",
                        "id, owner, key, digest, spec, scene, scene_key, priority, state, submitted, started, "
                        "finished, frames, error_code, error",
                        15, ", paused, stop, entered, waited, seconds, estimate, bytes", 7};
constexpr Columns kFrames{"frames",
                          "job, idx, number, spec, state, starts, tries, deaths, started, finished, error_code, "
                          "error, folder, estimate, stats, warnings",
                          16, ", time_limits, memory_limits, delivery", 3};
constexpr Columns kFiles{"files", "job, idx, name, size, sha256", 5};
constexpr Columns kBlobs{"job_blobs", "job, digest", 2};
constexpr Columns kAfter{"job_after", "job, after, done", 3};

class Salvage {
public:
    Salvage(const std::string& state, const std::string& old_path, Database& made, Moment now)
        : state_(state), made_(made), now_(now)
    {
        try {
            old_ = std::make_unique<Database>(old_path);
            const Statement readable(*old_, "SELECT sum FROM jobs");
            is_new_ = true;
        } catch (const ServiceError&) {
            // Nothing of it can be read, or an earlier version wrote it.
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

    int count(const Columns& columns) const { return columns.count + (is_new_ ? columns.newer_count : 0); }
    std::string names(const Columns& columns) const
    {
        return std::string(columns.all) + (is_new_ ? columns.newer : "");
    }
    /// Reads rows of a table; one whose cells are not as they were written counts as lost.
    template <typename Use>
    bool read(const Columns& columns, const char* where, std::initializer_list<std::int64_t> values, const Use& use)
    {
        std::string whole = "1";
        for (const SummedTable& table : summed_tables()) {
            if (is_new_ && std::string_view(table.name) == columns.table) whole = is_whole(table);
        }
        bool any = false;
        read("SELECT " + names(columns) + ", " + whole + " FROM " + columns.table + " WHERE " + where, values,
             [&](const Statement& row) {
                 if (row.integer(count(columns)) == 0) {
                     ++done_.lost;
                     return;
                 }
                 any = true;
                 use(row);
             });
        return any;
    }
    /// Takes a row over. @return false: there is such a one already
    bool copy(const Columns& columns, const Statement& row)
    {
        std::string values = "?";
        for (int i = 1; i < count(columns); ++i) values += ", ?";
        Statement to(made_, (std::string("INSERT OR IGNORE INTO ") + columns.table + " (" + names(columns) +
                             ") VALUES (" + values + ")")
                                .c_str());
        for (int i = 0; i < count(columns); ++i) to.bind_column(row, i);
        to.run();
        return made_.changed() > 0;
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

    void salvage_job(std::int64_t job)
    {
        std::int64_t frames = 0;
        bool cancel = false;
        read(kJobs, "id=?", {job}, [&](const Statement& row) {
            v1::Job spec;
            if (!spec.ParseFromString(row.text(4)) || !v1::JobState_IsValid(static_cast<int>(row.integer(8)))) {
                ++done_.lost;
                return;
            }
            if (!copy(kJobs, row)) return;  // its key is another one's
            Statement label(made_, "INSERT INTO labels (job, name, value) VALUES (?, ?, ?)");
            for (const auto& [name, value] : spec.labels()) label.bind(job).bind(name).bind(value).run();
            frames = row.integer(12);
            cancel = row.integer(8) == v1::JOB_STATE_CANCEL_REQUESTED;
        });
        if (frames == 0) return;
        ++done_.jobs;
        read(kBlobs, "job=?", {job}, [&](const Statement& row) { copy(kBlobs, row); });
        if (is_new_) read(kAfter, "job=?", {job}, [&](const Statement& row) { copy(kAfter, row); });
        for (std::int64_t index = 0; index < frames; ++index) salvage_frame(job, index);
        settle(job, cancel);
    }

    void salvage_frame(std::int64_t job, std::int64_t index)
    {
        bool found = false, has_pictures = true;
        read(kFrames, "job=? AND idx=?", {job, index}, [&](const Statement& row) {
            if (!v1::Frame().ParseFromString(row.text(3)) || !v1::FrameState_IsValid(static_cast<int>(row.integer(4))))
                return;
            found = copy(kFrames, row);
            if (found && row.integer(4) == v1::FRAME_STATE_COMPLETED)
                has_pictures = salvage_files(job, index, row.text(12));
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
        const bool any = read(kFiles, "job=? AND idx=?", {job, index}, [&](const Statement& row) {
            copy(kFiles, row);
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
                  "INSERT INTO frames (job, idx, number, spec, state, error_code, error) VALUES (?, ?, ?, ?, ?, "
                  "?, 'this frame was lost with the queue''s database; submit it again')")
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
        Statement traits(made_, "SELECT stop<>'', paused FROM jobs WHERE id=?");
        traits.bind(job).step();
        const v1::JobState state = state_of(counts, {cancel, traits.integer(0) != 0, traits.integer(1) != 0, warned});
        Statement(made_,
                  "UPDATE jobs SET state=?, active=?, completed=?, failed=?, cancelled=?, ended=?, finished=CASE WHEN "
                  "?6=0 THEN 0 ELSE finished END, waits=(SELECT count(*) FROM job_after WHERE job=id AND NOT done), "
                  "delivered=(SELECT count(*) FROM frames WHERE job=id AND delivery=2) WHERE id=?7")
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
    bool is_new_ = false;  ///< of this version: its rows have sums
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
