#pragma once

namespace rcs::service {

bool has_call_filter();
/// From now on system calls that a worker does not need fail with EPERM, in this thread and those that it starts: those
/// for network, programs, other processes, mounts, and the kernel's less guarded corners. Needs no_new_privs.
/// @return whether it worked
bool filter_calls();

}  // namespace rcs::service
