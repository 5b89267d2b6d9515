#pragma once

namespace rcs::service {

/// A software GL brings threads of its own; they are to be as few as ours. What the user set stands.
void limit_gl_threads(int threads);

/// Since the process was started: what loading its libraries took is time that a user waits as well. [s]
double seconds_of_process();

}  // namespace rcs::service
