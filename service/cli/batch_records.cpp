#include "cli/batch_records.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "rcs/error.h"
#include "rcs/record_file.h"

namespace rcs::service {

SharedRecords::SharedRecords(std::string file, TaskKind task) : file_(std::move(file)), task_(task)
{
    if (!file_.empty() && task_ != TaskKind::part) check_record_path(file_);
}

bool SharedRecords::begin(Session& session, const RenderOptions& options, bool is_animated, bool is_last,
                          const LogFunction& log)
{
    if (!are_wanted()) return false;
    std::error_code ignored;
    if (!std::filesystem::exists(file_, ignored)) {
        begun_ = true;
        if (task_ == TaskKind::part)
            log(LogLevel::warning, "record file '" + file_ + "' does not exist: this part begins without records");
        return false;
    }
    try {
        session.begin_with(read_records(file_, record_key(session.scene(), options)));
        begun_ = true;
        return true;
    } catch (const Error& e) {
        if (e.code() == ErrorCode::bad_file && is_animated && !is_last) return false;
        // What an overture finds of an earlier one, it makes anew.
        begun_ = e.code() == ErrorCode::bad_file && (is_animated || task_ == TaskKind::overture);
        if (!begun_) throw;
        log(LogLevel::info, e.what());
        return false;
    }
}

void SharedRecords::save(const Session& session, const RenderOptions& options) const
{
    if (file_.empty() || !begun_ || task_ == TaskKind::part) return;
    std::vector<Record> records = session.records();
    std::uint32_t last = 0;
    for (const Record& r : records) last = std::max(last, r.watch.state);
    // Nobody has looked at the others since the scene was changed.
    std::erase_if(records, [&](const Record& r) { return !r.watch.seen.empty() && r.watch.state != last; });
    write_records(file_, record_key(session.scene(), options), records);
}

}  // namespace rcs::service
