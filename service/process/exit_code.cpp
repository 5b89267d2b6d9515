#include "process/exit_code.h"

#include "process/interrupt.h"

namespace rcs::service {

int exit_code(ErrorCode code)
{
    switch (code) {
        case ErrorCode::bad_argument:
            return kBadUsage;
        case ErrorCode::not_found:
            return kNoInput;
        case ErrorCode::bad_file:
        case ErrorCode::unsupported:
            return kBadData;
        case ErrorCode::gl_unavailable:
            return kUnavailable;
        case ErrorCode::io:
            return kCannotWrite;
        case ErrorCode::out_of_memory:
            return kTryAgain;
        case ErrorCode::cancelled:
            return interrupt_signal() != 0 ? kSignalBase + interrupt_signal() : kFailed;
        case ErrorCode::internal:
            return kInternal;
    }
    return kInternal;
}

}  // namespace rcs::service
