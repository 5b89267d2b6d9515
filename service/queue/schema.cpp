#include "queue/schema.h"

#include <array>
#include <bit>
#include <cstdint>
#include <sstream>
#include <string_view>

#include <sqlite3.h>

#include "queue/database.h"

namespace rcs::service {
namespace {

constexpr const char* kFirst = R"sql(
CREATE TABLE jobs (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    owner TEXT NOT NULL,
    key TEXT,
    digest BLOB NOT NULL,
    spec BLOB NOT NULL,
    scene TEXT NOT NULL,
    scene_key TEXT NOT NULL,
    priority INTEGER NOT NULL,
    state INTEGER NOT NULL,
    submitted INTEGER NOT NULL,
    started INTEGER NOT NULL DEFAULT 0,
    finished INTEGER NOT NULL DEFAULT 0,
    frames INTEGER NOT NULL,
    completed INTEGER NOT NULL DEFAULT 0,
    failed INTEGER NOT NULL DEFAULT 0,
    active INTEGER NOT NULL DEFAULT 0,
    error_code INTEGER NOT NULL DEFAULT 0,
    error TEXT NOT NULL DEFAULT '',
    UNIQUE (owner, key)
);
CREATE INDEX jobs_by_state ON jobs (state);
CREATE TABLE frames (
    job INTEGER NOT NULL REFERENCES jobs (id),
    idx INTEGER NOT NULL,
    number INTEGER NOT NULL,
    spec BLOB NOT NULL,
    state INTEGER NOT NULL,
    rank REAL NOT NULL,
    not_before INTEGER NOT NULL DEFAULT 0,
    starts INTEGER NOT NULL DEFAULT 0,
    tries INTEGER NOT NULL DEFAULT 0,
    deaths INTEGER NOT NULL DEFAULT 0,
    started INTEGER NOT NULL DEFAULT 0,
    finished INTEGER NOT NULL DEFAULT 0,
    error_code INTEGER NOT NULL DEFAULT 0,
    error TEXT NOT NULL DEFAULT '',
    folder TEXT NOT NULL DEFAULT '',
    estimate REAL NOT NULL DEFAULT 0,
    stats TEXT NOT NULL DEFAULT '',
    warnings TEXT NOT NULL DEFAULT '',
    PRIMARY KEY (job, idx)
) WITHOUT ROWID;
CREATE INDEX frames_waiting ON frames (rank DESC, job, idx) WHERE state IN (1, 3);
CREATE INDEX frames_active ON frames (state) WHERE state = 2;
CREATE UNIQUE INDEX frames_by_number ON frames (job, number);
CREATE TABLE files (
    job INTEGER NOT NULL,
    idx INTEGER NOT NULL,
    name TEXT NOT NULL,
    size INTEGER NOT NULL,
    sha256 BLOB NOT NULL,
    PRIMARY KEY (job, idx, name)
) WITHOUT ROWID;
CREATE TABLE job_blobs (
    job INTEGER NOT NULL,
    digest BLOB NOT NULL,
    PRIMARY KEY (job, digest)
) WITHOUT ROWID;
)sql";

// `ended` is by the queue's clock, which `meta` keeps; submitted, started and finished are to be shown.
constexpr const char* kSecond = R"sql(
ALTER TABLE jobs ADD COLUMN cancelled INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN ended INTEGER NOT NULL DEFAULT 0;
CREATE INDEX jobs_ended ON jobs (ended, id) WHERE ended > 0;
CREATE INDEX frames_retried ON frames (not_before) WHERE state = 3;
CREATE TABLE labels (
    job INTEGER NOT NULL,
    name TEXT NOT NULL,
    value TEXT NOT NULL,
    PRIMARY KEY (job, name)
) WITHOUT ROWID;
CREATE TABLE meta (
    name TEXT PRIMARY KEY,
    value NOT NULL
) WITHOUT ROWID;
)sql";

// Of jobs: `waits` for so many others, `stop` says why the queue ended it, `entered` is by the queue's clock, `waited`
// until its first start [ms], `seconds` and `estimate` and `bytes` are sums over completed frames, `announce` is 1
// until its end was made known. Of frames: `delivery` is 1 while its files are to be delivered, 2 once they are.
constexpr const char* kThird = R"sql(
DROP INDEX frames_waiting;
DROP INDEX frames_retried;
ALTER TABLE jobs ADD COLUMN paused INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN waits INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN stop TEXT NOT NULL DEFAULT '';
ALTER TABLE jobs ADD COLUMN entered INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN waited INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN seconds REAL NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN estimate REAL NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN bytes INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN delivered INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN delivery_error TEXT NOT NULL DEFAULT '';
ALTER TABLE jobs ADD COLUMN announce INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN sum INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN spec_sum INTEGER NOT NULL DEFAULT 0;
ALTER TABLE frames DROP COLUMN rank;
ALTER TABLE frames ADD COLUMN time_limits INTEGER NOT NULL DEFAULT 0;
ALTER TABLE frames ADD COLUMN memory_limits INTEGER NOT NULL DEFAULT 0;
ALTER TABLE frames ADD COLUMN delivery INTEGER NOT NULL DEFAULT 0;
ALTER TABLE frames ADD COLUMN sum INTEGER NOT NULL DEFAULT 0;
ALTER TABLE files ADD COLUMN sum INTEGER NOT NULL DEFAULT 0;
ALTER TABLE job_blobs ADD COLUMN sum INTEGER NOT NULL DEFAULT 0;
ALTER TABLE labels ADD COLUMN sum INTEGER NOT NULL DEFAULT 0;
CREATE INDEX frames_by_state ON frames (job, state, idx);
CREATE INDEX frames_retried ON frames (job, not_before) WHERE state = 3;
CREATE INDEX frames_undelivered ON frames (job, idx) WHERE delivery = 1;
CREATE INDEX jobs_unfinished ON jobs (id) WHERE ended = 0;
CREATE INDEX jobs_announced ON jobs (id) WHERE announce = 1;
CREATE TABLE failures (
    job INTEGER NOT NULL,
    reason TEXT NOT NULL,
    frames INTEGER NOT NULL,
    PRIMARY KEY (job, reason)
) WITHOUT ROWID;
CREATE TABLE job_after (
    job INTEGER NOT NULL,
    after INTEGER NOT NULL,
    done INTEGER NOT NULL DEFAULT 0,
    sum INTEGER NOT NULL DEFAULT 0,
    PRIMARY KEY (job, after)
) WITHOUT ROWID;
CREATE INDEX jobs_waiting_for ON job_after (after);
)sql";

std::vector<std::string> split(const char* list)
{
    std::vector<std::string> parts;
    std::istringstream text(list);
    for (std::string part; std::getline(text >> std::ws, part, ',');) parts.push_back(part);
    return parts;
}

/// What keeps a table's sums.
std::string triggers_of(const SummedTable& table)
{
    const std::string name = table.name, columns = table.columns;
    std::string row;
    for (const std::string& key : split(table.key))
        row.append(row.empty() ? "" : " AND ").append(key).append("=NEW.").append(key);
    const std::string set = "UPDATE " + name + " SET sum=row_sum(" + columns + ")",
                      where = " WHERE " + row + "; END;\n";
    const bool is_jobs = name == "jobs";
    return "CREATE TRIGGER " + name + "_added AFTER INSERT ON " + name + " BEGIN " + set +
           (is_jobs ? ", spec_sum=row_sum(spec)" : "") + where +  //
           "CREATE TRIGGER " + name + "_changed AFTER UPDATE OF " + columns + " ON " + name + " BEGIN " + set + where;
}

/// FNV-1a of the kinds and bytes of its arguments.
void row_sum(sqlite3_context* context, int count, sqlite3_value** values)
{
    std::uint64_t hash = 0xcbf29ce484222325;
    const auto add = [&](std::string_view bytes) {
        for (const char byte : bytes) hash = (hash ^ static_cast<unsigned char>(byte)) * 0x100000001b3;
    };
    for (int i = 0; i < count; ++i) {
        // Whole numbers as SQLite writes them; a text's or blob's length says where it ends.
        const int kind = sqlite3_value_type(values[i]);
        if (kind == SQLITE_FLOAT) {  // as a text it would lose its last bits
            const auto bits = std::bit_cast<std::array<char, sizeof(double)>>(sqlite3_value_double(values[i]));
            add({bits.data(), bits.size()});
            continue;
        }
        const auto* bytes = static_cast<const char*>(sqlite3_value_blob(values[i]));
        const auto size = static_cast<std::size_t>(sqlite3_value_bytes(values[i]));
        add(std::to_string(kind) + ":" + std::to_string(size) + ":");
        if (bytes != nullptr) add({bytes, size});
    }
    sqlite3_result_int64(context, static_cast<std::int64_t>(hash));
}

}  // namespace

const std::vector<SummedTable>& summed_tables()
{
    static const std::vector<SummedTable> tables{
        {"jobs", "id",
         "id, owner, key, digest, scene, scene_key, priority, state, submitted, started, finished, frames, completed, "
         "failed, active, error_code, error, cancelled, ended, paused, waits, stop, entered, waited, seconds, "
         "estimate, "
         "bytes, delivered, delivery_error, announce"},
        {"frames", "job, idx",
         "job, idx, number, spec, state, not_before, starts, tries, deaths, started, finished, error_code, error, "
         "folder, estimate, stats, warnings, time_limits, memory_limits, delivery"},
        {"files", "job, idx, name", "job, idx, name, size, sha256"},
        {"job_blobs", "job, digest", "job, digest"},
        {"labels", "job, name", "job, name, value"},
        {"job_after", "job, after", "job, after, done"}};
    return tables;
}

const std::vector<std::string>& schema_steps()
{
    static const std::vector<std::string> steps = [] {
        std::string third = kThird;
        for (const SummedTable& table : summed_tables()) third += triggers_of(table);
        return std::vector<std::string>{kFirst, kSecond, third};
    }();
    return steps;
}

std::string is_whole(const SummedTable& table)
{
    const std::string whole = std::string("row_sum(") + table.columns + ")=sum";
    return std::string_view(table.name) == "jobs" ? whole + " AND row_sum(spec)=spec_sum" : whole;
}

void add_row_sum(Database& database)
{
    sqlite3_create_function_v2(database.handle(), "row_sum", -1, SQLITE_UTF8 | SQLITE_DETERMINISTIC, nullptr, row_sum,
                               nullptr, nullptr, nullptr);
}

}  // namespace rcs::service
