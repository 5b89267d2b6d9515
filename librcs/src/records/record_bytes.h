#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "rcs/record_file.h"

namespace rcs {

struct KeyedRecords {
    RecordKey key;
    std::vector<Record> records;
};

/// What is wrong with a record, such as "a normal", or nothing: it may be rendered with.
std::string_view defect_of(const Record& record);

/// A record file but for the checksum at its end. Little endian; a record's fields come in the order of the structure,
/// its radiance after how many values it has.
std::string to_bytes(const RecordKey& key, const std::vector<Record>& records);

/// @param path  for messages
/// @throws Error bad_file, unsupported: as read_records()
KeyedRecords parse_records(std::string_view bytes, const std::string& path);

}  // namespace rcs
