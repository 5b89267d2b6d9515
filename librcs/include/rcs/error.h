#pragma once

#include <stdexcept>
#include <string>

#include "rcs/api.h"

namespace rcs {

/// What kind of thing went wrong; each edge (command line, wire, C++ caller) maps it once.
enum class ErrorCode {
    bad_argument,    ///< an option or value outside its range
    not_found,       ///< a file, camera, view or layer that does not exist
    bad_file,        ///< a file that is damaged or not what it should be
    unsupported,     ///< well-formed, but asks for what this build cannot do
    gl_unavailable,  ///< no usable OpenGL 4.5 through EGL, or the GL reported an error
    io,              ///< reading or writing failed
    out_of_memory,
    cancelled,  ///< the progress callback asked to stop
    internal,   ///< a defect of ours
};

/// The one exception type that librcs throws. `what()` is one sentence that names the file or
/// field, the value, and the range that would have been accepted.
class RCS_API Error : public std::runtime_error {
public:
    /// @param message  one sentence
    Error(ErrorCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
    /// What kind of thing went wrong.
    ErrorCode code() const noexcept { return code_; }

private:
    ErrorCode code_;
};

}  // namespace rcs
