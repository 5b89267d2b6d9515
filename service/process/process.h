#pragma once

#include <cstdint>

#include <sys/types.h>

namespace rcs::service {

/// A software GL brings threads of its own; they are to be as few as ours. What the user set stands.
void limit_gl_threads(int threads);

/// From now on memory that is freed is kept for what comes next: a picture's buffers come and go in every stage, and to
/// have their pages back from the system each time costs processor time.
void keep_freed_memory();
/// Returns what is kept, before a process waits for long.
void give_back_freed_memory();

/// Memory that this process may still take: what the machine, its control group and its own limit leave. [bytes]
double available_memory();

/// Of a process on this machine; 0: unknown. [bytes]
std::uint64_t resident_memory(pid_t pid);

/// Processor time since some point in the past [s].
struct ProcessorTime {
    double own = 0.0;     ///< of this process
    double others = 0.0;  ///< of all others on the machine
};
ProcessorTime processor_time();

/// Since the process was started: what loading its libraries took is time that a user waits as well. [s]
double seconds_of_process();

}  // namespace rcs::service
