#include "queue/queue_file.h"

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <set>

#include <fcntl.h>
#include <unistd.h>

#include "queue/database.h"
#include "queue/schema.h"
#include "rcs/v1/job.pb.h"
#include "wire/errors.h"
#include "wire/files.h"
#include "wire/sha256.h"

namespace rcs::service {
namespace {

namespace fs = std::filesystem;

constexpr const char* kMarkerFormat = "rcsplat-state 1\nid %32[0-9a-f]\nnumbers %llu\n";

[[noreturn]] void refuse(const std::string& what)
{
    throw ServiceError(v1::ERROR_CODE_BAD_FILE,
                       what + "; started with --recover the server keeps what can be read of it, and all pictures");
}

std::string marker_path(const std::string& state) { return state + "/marker"; }

std::int64_t number(const Database& database, const char* sql)
{
    Statement row(database, sql);
    return row.step() ? row.integer(0) : 0;
}

std::set<std::string> tables_of(const Database& database)
{
    std::set<std::string> tables;
    Statement row(database, "SELECT sql FROM sqlite_master WHERE sql IS NOT NULL AND name NOT LIKE 'sqlite_%'");
    while (row.step()) tables.insert(row.text(0));
    return tables;
}

/// What the queue had before version 2 kept it.
void fill_second(Database& database)
{
    database.run(
        "UPDATE jobs SET ended=finished, "
        "cancelled=(SELECT count(*) FROM frames WHERE job=id AND frames.state=6); UPDATE frames SET not_before=0");
    Statement row(database, "SELECT id, spec FROM jobs");
    Statement label(database, "INSERT INTO labels (job, name, value) VALUES (?, ?, ?)");
    while (row.step()) {
        v1::Job spec;
        spec.ParseFromString(row.text(1));
        for (const auto& [name, value] : spec.labels()) label.bind(row.integer(0)).bind(name).bind(value).run();
    }
}

/// What the queue had before version 3 kept it; the sums are made by the way.
void fill_third(Database& database)
{
    database.run(
        "UPDATE frames SET state=state; UPDATE files SET size=size; UPDATE job_blobs SET digest=digest;"
        "UPDATE labels SET value=value;"
        "UPDATE jobs SET spec_sum=row_sum(spec), entered=submitted, waited=max(0, started-submitted),"
        "bytes=(SELECT coalesce(sum(size), 0) FROM files WHERE job=id),"
        "(seconds, estimate)=(SELECT coalesce(sum(1e-3*(f.finished-f.started)), 0), coalesce(sum(f.estimate), 0) "
        "FROM frames f WHERE f.job=jobs.id AND f.state=4)");
}

void write_meta(Database& database, const Marker& marker, Moment now)
{
    Statement meta(database, "INSERT INTO meta (name, value) VALUES (?, ?)");
    meta.bind("id").bind(marker.id).run();
    meta.bind("clock").bind(now.wall_ms).run();
}

/// @throws ServiceError bad_file
void check_whole(const Database& database, const std::string& path, std::int64_t version)
{
    Statement check(database, "PRAGMA quick_check(1)");
    check.step();
    if (check.text(0) != "ok") refuse("the queue's database " + path + " is damaged (" + check.text(0) + ")");
    Database expected(":memory:");
    for (std::int64_t i = 0; i < version; ++i) expected.run(schema_steps().at(static_cast<std::size_t>(i)).c_str());
    if (tables_of(expected) != tables_of(database))
        refuse("the queue's database " + path + " does not have the tables of its version");
    if (version < kSchema) return;
    for (const SummedTable& table : summed_tables()) {
        Statement row(
            database,
            (std::string("SELECT 1 FROM ") + table.name + " WHERE NOT (" + is_whole(table) + ") LIMIT 1").c_str());
        if (row.step())
            refuse("the queue's database " + path + " is damaged (a row of " + table.name +
                   " is not as it was written)");
    }
}

/// Brings an older version's tables to the newest.
Marker upgraded(Database& database, const std::string& state, Marker marker, std::int64_t version, Moment now)
{
    marker.numbers = static_cast<std::uint64_t>(number(database, "SELECT max(seq) FROM sqlite_sequence"));
    write_marker(state, marker);
    database.run("BEGIN IMMEDIATE");
    for (std::int64_t i = version; i < kSchema; ++i) {
        database.run(schema_steps().at(static_cast<std::size_t>(i)).c_str());
        if (i == 1) fill_second(database);
        if (i == 1) write_meta(database, marker, now);
        if (i == 2) fill_third(database);
    }
    database.run(("PRAGMA user_version=" + std::to_string(kSchema)).c_str());
    database.run("COMMIT");
    return marker;
}

}  // namespace

std::string queue_path(const std::string& state) { return state + "/queue.db"; }

std::optional<Marker> read_marker(const std::string& state)
{
    std::ifstream file(marker_path(state));
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    char id[33] = {};
    unsigned long long numbers = 0;
    if (std::sscanf(text.c_str(), kMarkerFormat, id, &numbers) != 2) return std::nullopt;
    return Marker{id, numbers};
}

void write_marker(const std::string& state, const Marker& marker)
{
    const std::string path = marker_path(state), making = path + ".part";
    {
        const Fd file(::open(making.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0600));
        if (!file) fail_file("write", making);
        write_all(file.get(), "rcsplat-state 1\nid " + marker.id + "\nnumbers " + std::to_string(marker.numbers) + "\n",
                  making);
        if (::fsync(file.get()) != 0) fail_file("write", making);
    }
    if (::rename(making.c_str(), path.c_str()) != 0) fail_file("rename", making);
    sync_path(state);
}

void make_tables(Database& database, const Marker& marker, Moment now)
{
    database.run("BEGIN IMMEDIATE");
    for (const std::string& step : schema_steps()) database.run(step.c_str());
    write_meta(database, marker, now);
    database.run(("PRAGMA user_version=" + std::to_string(kSchema)).c_str());
    database.run("COMMIT");
}

Marker prepare_queue(const std::string& state, Moment now)
{
    const std::string path = queue_path(state);
    std::error_code ignored;
    std::optional<Marker> marker = read_marker(state);
    const bool was_used = (marker && marker->numbers > 0) ||
                          fs::directory_iterator(state + "/results", ignored) != fs::directory_iterator();
    if (was_used && !fs::exists(path, ignored)) refuse("the queue's database " + path + " is lost");
    try {
        Database database(path);
        const std::int64_t version = number(database, "PRAGMA user_version");
        if (version == 0 && tables_of(database).empty()) {
            if (was_used) refuse("the queue's database " + path + " is empty");
            if (!marker) write_marker(state, *(marker = Marker{random_id(), 0}));
            database.run("PRAGMA journal_mode=WAL");
            make_tables(database, *marker, now);
            return *marker;
        }
        if (version > kSchema) {
            throw ServiceError(v1::ERROR_CODE_UNSUPPORTED, path + " has version " + std::to_string(version) +
                                                               " of the queue, expected " + std::to_string(kSchema));
        }
        check_whole(database, path, version);
        if (version >= 2) {
            Statement id(database, "SELECT value FROM meta WHERE name='id'");
            if (!marker) refuse("the state folder's marker " + marker_path(state) + " is lost or damaged");
            if (!id.step() || id.text(0) != marker->id)
                refuse("the queue's database " + path + " is that of another state folder");
        }
        if (version == kSchema) return *marker;
        return upgraded(database, state, marker.value_or(Marker{random_id(), 0}), version, now);
    } catch (const DatabaseError& e) {
        if (!e.is_damage()) throw;
        refuse("the queue's database " + path + " is damaged (" + e.what() + ")");
    }
}

}  // namespace rcs::service
