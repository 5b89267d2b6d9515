#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "process/clock.h"

/// The queue's database as a file in the state folder: made, checked, brought to the newest version.
namespace rcs::service {

class Database;

/// STATE/marker. Should the database be lost, it says that there was one, and which numbers are taken.
struct Marker {
    std::string id;             ///< of the database that belongs here, as its table `meta` has it
    std::uint64_t numbers = 0;  ///< no job has a larger one
};
/// @return none: there is none, or it cannot be read
std::optional<Marker> read_marker(const std::string& state);
/// @throws ServiceError unavailable, internal; then the old one stands
void write_marker(const std::string& state, const Marker& marker);

std::string queue_path(const std::string& state);

/// Makes the database if there was none, or finds it whole: SQLite's own check, the tables, the marker.
/// @throws ServiceError bad_file: it is lost, damaged or another folder's; unsupported: of a newer version
Marker prepare_queue(const std::string& state, Moment now);

/// Makes the tables of the newest version in an empty database, which will belong to the marker.
void make_tables(Database& database, const Marker& marker, Moment now);

}  // namespace rcs::service
