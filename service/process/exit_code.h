#pragma once

#include <stdexcept>
#include <string>

/// What a command's exit code says; those from 64 to 78 are sysexits.h's.
namespace rcs::service {

inline constexpr int kFailed = 1;        ///< some of it, or for a reason that has no code of its own
inline constexpr int kBadUsage = 2;      ///< the command line
inline constexpr int kWarned = 80;       ///< all is done, but a warning says that pictures may not be what was meant
inline constexpr int kSignalBase = 128;  ///< the shell's convention: 130 is SIGINT

/// The end of a command that has done what it could.
class Ended : public std::runtime_error {
public:
    Ended(int code, const std::string& message) : std::runtime_error(message), code_(code) {}
    int code() const noexcept { return code_; }

private:
    int code_;
};

}  // namespace rcs::service
