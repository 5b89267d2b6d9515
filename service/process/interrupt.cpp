#include "process/interrupt.h"

#include <csignal>

#include "rcs/error.h"

namespace rcs::service {
namespace {

volatile std::sig_atomic_t received_signal = 0;  // a handler can reach nothing but a global

extern "C" void remember_signal(int signal) { received_signal = signal; }

}  // namespace

void install_signal_handlers()
{
    struct sigaction action = {};
    action.sa_handler = remember_signal;
    action.sa_flags = SA_RESTART | static_cast<int>(SA_RESETHAND);  // the second one is deadly again
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    std::signal(SIGXFSZ, SIG_IGN);
}

int interrupt_signal() { return received_signal; }

void stop_if_interrupted()
{
    if (received_signal != 0) {
        throw Error(ErrorCode::cancelled, "interrupted, nothing was written");
    }
}

}  // namespace rcs::service
