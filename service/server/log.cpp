#include "server/log.h"

#include <algorithm>
#include <cstdio>

#include <unistd.h>

#include "process/clock.h"
#include "process/printable.h"

namespace rcs::service {
namespace {

const char* name_of(Level level)
{
    switch (level) {
        case Level::debug:
            return "debug";
        case Level::info:
            return "info";
        case Level::warning:
            return "warning";
        case Level::error:
            return "error";
    }
    return "";
}

std::string quoted(const std::string& value)
{
    bool plain = !value.empty();
    std::string text = "\"";
    std::size_t control_end = 0;
    for (std::size_t i = 0; i < value.size(); ++i) {
        const char c = value[i];
        const auto byte = static_cast<unsigned char>(c);
        plain = plain && byte > ' ' && byte < 0x7f && c != '"' && c != '=' && c != '\\';
        control_end = std::max(control_end, i + control_length(value, i));
        if (i < control_end) {
            char code[8];
            std::snprintf(code, sizeof code, "\\x%02x", byte);
            text += code;
        } else {
            if (c == '"' || c == '\\') text += '\\';
            text += c;
        }
    }
    return plain ? value : text + "\"";
}

}  // namespace

void ServerLog::write(Level level, std::string_view event, const std::vector<LogField>& fields) const
{
    if (level == Level::debug && !debug_) return;
    std::string line = "time=" + utc_text(read_clocks().wall_ms) + " level=" + name_of(level) + " event=";
    line += event;
    for (const LogField& field : fields) line.append(" ").append(field.name).append("=").append(quoted(field.value));
    line += '\n';
    // One write for a line, so that those of workers do not mix with it. Whoever reads may be gone; the queue goes on.
    [[maybe_unused]] const ssize_t ignored = ::write(STDERR_FILENO, line.data(), line.size());
}

}  // namespace rcs::service
