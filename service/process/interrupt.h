#pragma once

namespace rcs::service {

/// Lets SIGINT and SIGTERM ask for an orderly end; a second one ends the process at once. A write past
/// the allowed file size becomes an error instead of a signal.
void install_signal_handlers();

/// For work that takes its time to end in order: SIGTERM may come as often as it likes (schedulers send it twice), and
/// SIGUSR1 asks for a word on how far it is.
void install_batch_signal_handlers();

/// The signal that asked this process to stop, or 0.
int interrupt_signal();

/// Whether SIGUSR1 came since this was asked last.
bool take_report_request();

/// @throws rcs::Error cancelled, if a signal came
void stop_if_interrupted();

}  // namespace rcs::service
