// Bytes as a record file, less its checksum: what is taken is written again as the same bytes, and can be spaced.
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "rcs/error.h"
#include "rcs/thread_pool.h"
#include "records/record_bytes.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    static rcs::ThreadPool pool(1);
    const std::string_view bytes(reinterpret_cast<const char*>(data), size);
    try {
        rcs::KeyedRecords file = rcs::parse_records(bytes, "a.records");
        if (rcs::to_bytes(file.key, file.records) != bytes) std::abort();
        rcs::limit_spacing(file.records, {}, pool);
    } catch (const rcs::Error& e) {
        if (e.code() != rcs::ErrorCode::bad_file && e.code() != rcs::ErrorCode::unsupported) std::abort();
    }
    return 0;
}
