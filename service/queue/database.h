#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "wire/errors.h"

struct sqlite3;
struct sqlite3_stmt;

namespace rcs::service {

/// What SQLite says. Unavailable: a full disk is the usual reason, and passes.
class DatabaseError : public ServiceError {
public:
    explicit DatabaseError(sqlite3* database);
    bool is_damage() const { return is_damage_; }  ///< the file is none of SQLite's, or not as SQLite left it

private:
    bool is_damage_;
};

/// An SQLite file. What fails throws DatabaseError.
class Database {
public:
    /// @param path  made if it is not there, readable by its owner alone
    explicit Database(const std::string& path);
    ~Database();
    Database(const Database&) = delete;
    Database& operator=(const Database&) = delete;

    /// Statements without results.
    void run(const char* sql);
    std::int64_t last_row() const;
    /// Rows that the last statement changed.
    int changed() const;

    sqlite3* handle() const { return handle_; }

private:
    sqlite3* handle_ = nullptr;
};

/// A prepared statement; parameters and columns count from 0, in the order of the text.
class Statement {
public:
    Statement(const Database& database, const char* sql);
    ~Statement();
    Statement(const Statement&) = delete;
    Statement& operator=(const Statement&) = delete;

    Statement& bind(std::int64_t value);
    Statement& bind(double value);
    Statement& bind(std::string_view text);
    Statement& bind_blob(std::string_view bytes);
    Statement& bind_null();
    Statement& bind_column(const Statement& from, int column);  ///< a value of whatever kind

    /// Takes the next row. @return false: there is none; the statement can be bound and stepped again
    bool step();
    /// Of a statement without rows.
    void run()
    {
        while (step()) {
        }
    }

    std::int64_t integer(int column) const;
    double real(int column) const;
    std::string text(int column) const;  ///< also of blobs; "" for null
    bool is_null(int column) const;

private:
    sqlite3* database_;
    sqlite3_stmt* statement_ = nullptr;
    int bound_ = 0;
};

}  // namespace rcs::service
