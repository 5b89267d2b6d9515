#include "process/interrupt.h"

#include <csignal>

#include "rcs/error.h"

namespace rcs::service {
namespace {

volatile std::sig_atomic_t received_signal = 0;  // a handler can reach nothing but a global

volatile std::sig_atomic_t report_wanted = 0;

extern "C" void remember_signal(int signal) { received_signal = signal; }
extern "C" void remember_report(int) { report_wanted = 1; }

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

void install_batch_signal_handlers()
{
    struct sigaction action = {};
    action.sa_flags = SA_RESTART;
    sigemptyset(&action.sa_mask);
    action.sa_handler = remember_signal;
    sigaction(SIGTERM, &action, nullptr);
    action.sa_handler = remember_report;
    sigaction(SIGUSR1, &action, nullptr);
}

bool take_report_request()
{
    const bool wanted = report_wanted != 0;
    report_wanted = 0;
    return wanted;
}

int interrupt_signal() { return received_signal; }

void stop_if_interrupted()
{
    if (received_signal != 0) {
        throw Error(ErrorCode::cancelled, "interrupted, nothing was written");
    }
}

}  // namespace rcs::service
