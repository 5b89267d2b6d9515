#pragma once

#include <stdexcept>
#include <string>

#include "rcs/error.h"

/// What a command's exit code says; those from 64 to 78 are sysexits.h's.
namespace rcs::service {

inline constexpr int kFailed = 1;    ///< some of it, or for a reason that has no code of its own
inline constexpr int kBadUsage = 2;  ///< the command line
inline constexpr int kBadData =
    65;  ///< a scene or another file that is read is damaged, or asks for what is not offered
inline constexpr int kNoInput = 66;       ///< a file, camera, view or layer that does not exist
inline constexpr int kUnavailable = 69;   ///< no usable OpenGL
inline constexpr int kInternal = 70;      ///< a defect of ours
inline constexpr int kCannotWrite = 73;   ///< or read: the disk
inline constexpr int kTryAgain = 75;      ///< out of memory, no server, its disk is full: the same may work later
inline constexpr int kProtocol = 76;      ///< who answers speaks otherwise
inline constexpr int kNotPermitted = 77;  ///< by the server: who asks, what belongs to others, beyond its limits
inline constexpr int kBadConfig = 78;     ///< a colour configuration that is refused
inline constexpr int kWarned = 80;        ///< all is done, but a warning says that pictures may not be what was meant
inline constexpr int kSignalBase = 128;   ///< the shell's convention: 130 is SIGINT

/// What a command ends with for an error that nothing else is said about.
int exit_code(ErrorCode code);

/// The end of a command that has done what it could.
class Ended : public std::runtime_error {
public:
    Ended(int code, const std::string& message) : std::runtime_error(message), code_(code) {}
    int code() const noexcept { return code_; }

private:
    int code_;
};

}  // namespace rcs::service
