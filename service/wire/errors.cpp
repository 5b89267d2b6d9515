#include "wire/errors.h"

#include <cstddef>

#include "process/exit_code.h"

namespace rcs::service {
namespace {

/// Length of the UTF-8 sequence at `i` (RFC 3629); 0 if there is none.
std::size_t sequence_length(const std::string& text, std::size_t i)
{
    const auto byte = [&](std::size_t k) { return k < text.size() ? static_cast<unsigned char>(text[k]) : 0u; };
    const unsigned first = byte(i);
    const std::size_t length = first < 0x80   ? 1
                               : first < 0xc2 ? 0
                               : first < 0xe0 ? 2
                               : first < 0xf0 ? 3
                               : first < 0xf5 ? 4
                                              : 0;
    for (std::size_t k = 1; k < length; ++k) {
        const unsigned least = k > 1 ? 0x80 : first == 0xe0 ? 0xa0 : first == 0xf0 ? 0x90 : 0x80;
        const unsigned most = k > 1 ? 0xbf : first == 0xed ? 0x9f : first == 0xf4 ? 0x8f : 0xbf;
        if (byte(i + k) < least || byte(i + k) > most) return 0;
    }
    return length;
}

}  // namespace

v1::ErrorCode to_wire(ErrorCode code)
{
    switch (code) {
        case ErrorCode::bad_argument:
            return v1::ERROR_CODE_BAD_ARGUMENT;
        case ErrorCode::not_found:
            return v1::ERROR_CODE_NOT_FOUND;
        case ErrorCode::bad_file:
            return v1::ERROR_CODE_BAD_FILE;
        case ErrorCode::unsupported:
            return v1::ERROR_CODE_UNSUPPORTED;
        case ErrorCode::gl_unavailable:
            return v1::ERROR_CODE_GL_UNAVAILABLE;
        case ErrorCode::io:
            return v1::ERROR_CODE_IO;
        case ErrorCode::out_of_memory:
            return v1::ERROR_CODE_OUT_OF_MEMORY;
        case ErrorCode::cancelled:
            return v1::ERROR_CODE_CANCELLED;
        case ErrorCode::internal:
            return v1::ERROR_CODE_INTERNAL;
    }
    return v1::ERROR_CODE_INTERNAL;
}

ErrorCode from_wire(v1::ErrorCode code)
{
    switch (code) {
        case v1::ERROR_CODE_BAD_ARGUMENT:
        case v1::ERROR_CODE_CONFLICT:
            return ErrorCode::bad_argument;
        case v1::ERROR_CODE_NOT_FOUND:
            return ErrorCode::not_found;
        case v1::ERROR_CODE_BAD_FILE:
            return ErrorCode::bad_file;
        case v1::ERROR_CODE_UNSUPPORTED:
        case v1::ERROR_CODE_VERSION:
            return ErrorCode::unsupported;
        case v1::ERROR_CODE_GL_UNAVAILABLE:
            return ErrorCode::gl_unavailable;
        case v1::ERROR_CODE_CANCELLED:
            return ErrorCode::cancelled;
        case v1::ERROR_CODE_OUT_OF_MEMORY:
        case v1::ERROR_CODE_MEMORY_LIMIT:
            return ErrorCode::out_of_memory;
        case v1::ERROR_CODE_INTERNAL:
        case v1::ERROR_CODE_WORKER_DIED:
            return ErrorCode::internal;
        default:
            return ErrorCode::io;  // what keeps the service from its work
    }
}

int exit_code(v1::ErrorCode code)
{
    switch (code) {
        case v1::ERROR_CODE_UNAVAILABLE:
            return kTryAgain;
        case v1::ERROR_CODE_PROTOCOL:
        case v1::ERROR_CODE_VERSION:
            return kProtocol;
        case v1::ERROR_CODE_UNAUTHENTICATED:
        case v1::ERROR_CODE_FORBIDDEN:
        case v1::ERROR_CODE_LIMIT:
            return kNotPermitted;
        case v1::ERROR_CODE_CONFLICT:
        case v1::ERROR_CODE_TIME_LIMIT:
        case v1::ERROR_CODE_DEPENDENCY:
            return kFailed;
        default:
            return exit_code(from_wire(code));
    }
}

v1::Error error_message(v1::ErrorCode code, const std::string& sentence)
{
    v1::Error error;
    error.set_code(code);
    error.set_message(utf8_text(sentence));
    return error;
}

std::string utf8_text(const std::string& text)
{
    std::string valid;
    for (std::size_t i = 0; i < text.size();) {
        const std::size_t length = sequence_length(text, i);
        valid += length > 0 ? text.substr(i, length) : "?";
        i += length > 0 ? length : 1;
    }
    return valid;
}

}  // namespace rcs::service
