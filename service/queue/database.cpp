#include "queue/database.h"

#include <fcntl.h>
#include <unistd.h>

#include <sqlite3.h>

#include "queue/schema.h"
#include "wire/errors.h"

namespace rcs::service {
namespace {

void check(sqlite3* database, int code)
{
    if (code != SQLITE_OK) throw DatabaseError(database);
}

}  // namespace

DatabaseError::DatabaseError(sqlite3* database)
    : ServiceError(v1::ERROR_CODE_UNAVAILABLE, std::string("the queue's database: ") + sqlite3_errmsg(database))
{
    const int code = sqlite3_errcode(database) & 0xff;
    is_damage_ = code == SQLITE_CORRUPT || code == SQLITE_NOTADB;
}

Database::Database(const std::string& path)
{
    // SQLite gives its side files the mode of the main one.
    const int fd = path != ":memory:" ? ::open(path.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0600) : -1;
    if (fd >= 0) ::close(fd);
    if (sqlite3_open_v2(path.c_str(), &handle_, SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_EXRESCODE,
                        nullptr) != SQLITE_OK) {
        const std::string why = handle_ != nullptr ? sqlite3_errmsg(handle_) : "out of memory";
        sqlite3_close(handle_);
        throw ServiceError(v1::ERROR_CODE_UNAVAILABLE, "cannot open " + path + ": " + why);
    }
    add_row_sum(*this);
}

Database::~Database() { sqlite3_close(handle_); }

void Database::run(const char* sql) { check(handle_, sqlite3_exec(handle_, sql, nullptr, nullptr, nullptr)); }

std::int64_t Database::last_row() const { return sqlite3_last_insert_rowid(handle_); }

int Database::changed() const { return sqlite3_changes(handle_); }

Statement::Statement(const Database& database, const char* sql) : database_(database.handle())
{
    check(database_, sqlite3_prepare_v2(database_, sql, -1, &statement_, nullptr));
}

Statement::~Statement() { sqlite3_finalize(statement_); }

Statement& Statement::bind(std::int64_t value)
{
    check(database_, sqlite3_bind_int64(statement_, ++bound_, value));
    return *this;
}

Statement& Statement::bind(double value)
{
    check(database_, sqlite3_bind_double(statement_, ++bound_, value));
    return *this;
}

Statement& Statement::bind(std::string_view text)
{
    check(database_,
          sqlite3_bind_text(statement_, ++bound_, text.data(), static_cast<int>(text.size()), SQLITE_TRANSIENT));
    return *this;
}

Statement& Statement::bind_blob(std::string_view bytes)
{
    // An empty blob, not null.
    check(database_, sqlite3_bind_blob(statement_, ++bound_, bytes.empty() ? "" : bytes.data(),
                                       static_cast<int>(bytes.size()), SQLITE_TRANSIENT));
    return *this;
}

Statement& Statement::bind_null()
{
    check(database_, sqlite3_bind_null(statement_, ++bound_));
    return *this;
}

Statement& Statement::bind_column(const Statement& from, int column)
{
    check(database_, sqlite3_bind_value(statement_, ++bound_, sqlite3_column_value(from.statement_, column)));
    return *this;
}

bool Statement::step()
{
    const int code = sqlite3_step(statement_);
    if (code == SQLITE_ROW) return true;
    bound_ = 0;
    if (code != SQLITE_DONE) {
        const DatabaseError error(database_);
        sqlite3_reset(statement_);
        throw error;
    }
    sqlite3_reset(statement_);
    return false;
}

std::int64_t Statement::integer(int column) const { return sqlite3_column_int64(statement_, column); }

double Statement::real(int column) const { return sqlite3_column_double(statement_, column); }

std::string Statement::text(int column) const
{
    const void* bytes = sqlite3_column_blob(statement_, column);
    const int size = sqlite3_column_bytes(statement_, column);
    return bytes != nullptr ? std::string(static_cast<const char*>(bytes), static_cast<std::size_t>(size))
                            : std::string();
}

bool Statement::is_null(int column) const { return sqlite3_column_type(statement_, column) == SQLITE_NULL; }

}  // namespace rcs::service
