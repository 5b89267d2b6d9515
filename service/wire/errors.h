#pragma once

#include <stdexcept>
#include <string>

#include "rcs/error.h"
#include "rcs/v1/job.pb.h"

namespace rcs::service {

/// What goes wrong between client, server and worker. `what()` is one sentence.
class ServiceError : public std::runtime_error {
public:
    ServiceError(v1::ErrorCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
    v1::ErrorCode code() const noexcept { return code_; }

private:
    v1::ErrorCode code_;
};

v1::ErrorCode to_wire(ErrorCode code);
/// The nearest one that the library has.
ErrorCode from_wire(v1::ErrorCode code);

/// What a command ends with that such an error ended.
int exit_code(v1::ErrorCode code);

v1::Error error_message(v1::ErrorCode code, const std::string& sentence);

/// Texts of a file or a name may be no UTF-8, which a message's strings have to be: such bytes become '?'.
std::string utf8_text(const std::string& text);

}  // namespace rcs::service
