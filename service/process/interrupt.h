#pragma once

namespace rcs::service {

/// Lets SIGINT and SIGTERM ask for an orderly end; a second one ends the process at once. A write past
/// the allowed file size becomes an error instead of a signal.
void install_signal_handlers();

/// The signal that asked this process to stop, or 0.
int interrupt_signal();

/// @throws rcs::Error cancelled, if a signal came
void stop_if_interrupted();

}  // namespace rcs::service
