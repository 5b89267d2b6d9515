#pragma once

#include <string>
#include <vector>

namespace rcs::service {

class Database;

/// SQL that makes the tables of each version from those of the one before; the database itself says which it has.
const std::vector<std::string>& schema_steps();
inline constexpr int kSchema = 3;

/// A table whose rows have sums: of every cell but the sums themselves.
struct SummedTable {
    const char* name;
    const char* key;      ///< its primary key's columns
    const char* columns;  ///< of `sum`; what the job was asked for has a sum of its own, as it is long and stays
};
const std::vector<SummedTable>& summed_tables();

/// Where the cells of a row are what they were when it was written: "row_sum(...)=sum".
std::string is_whole(const SummedTable& table);

/// Makes the function row_sum(...) known, a hash of its arguments of 64 bits, which triggers of the tables use.
void add_row_sum(Database& database);

}  // namespace rcs::service
