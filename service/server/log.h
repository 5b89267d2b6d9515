#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace rcs::service {

/// One line of the server's log on stderr, as "time=... level=info event=job_submitted job=3 owner=uid:1000". Values
/// that hold anything but plain characters are quoted, and what came from outside cannot begin a new line. Tokens are
/// never logged.
enum class Level { debug, info, warning, error };

struct LogField {
    std::string_view name;
    std::string value;
    LogField(std::string_view name_, std::string value_) : name(name_), value(std::move(value_)) {}
    LogField(std::string_view name_, const char* value_) : name(name_), value(value_) {}
    template <typename Number>
        requires std::is_arithmetic_v<Number>
    LogField(std::string_view name_, Number value_) : name(name_), value(std::to_string(value_))
    {
    }
};

class ServerLog {
public:
    void set_debug(bool debug) { debug_ = debug; }
    void write(Level level, std::string_view event, const std::vector<LogField>& fields = {}) const;
    void info(std::string_view event, const std::vector<LogField>& fields = {}) const
    {
        write(Level::info, event, fields);
    }

private:
    std::atomic<bool> debug_ = false;
};

}  // namespace rcs::service
