#pragma once

#include <string>
#include <vector>

/// Takes from a process what it does not need, before it reads what strangers sent (docs/seal.md).
namespace rcs::service {

/// What a sealed process may still reach: files, or folders with all in them. Those that are missing are left out.
struct Reach {
    std::vector<std::string> read;
    std::vector<std::string> devices;  ///< read and written, not made
    std::vector<std::string> write;    ///< as well as read; folders, in which it makes, renames and removes
};

/// Which walls stand.
struct Seal {
    int landlock = 0;    ///< version of Landlock's interface: files outside Reach are closed; 0: none, files are open
    bool calls = false;  ///< no network, no programs, no other process (seccomp)

    bool is_whole() const { return landlock > 0 && calls; }
};
/// For people: "files (Landlock 7), network, programs and processes", or what is missing.
std::string describe(const Seal& seal);

/// What the running kernel can do.
Seal available_seal();

/// Seals the calling thread and all that it starts from now on, for ever. What it has open stays open. Where the kernel
/// lacks a wall, the others are set up.
/// @return those that stand   @throws ServiceError internal: one that this kernel has could not be set up
Seal seal_process(const Reach& reach);

/// What programs need of the machine: libraries, drivers, devices, what tells of processor and memory.
Reach machine_places();

}  // namespace rcs::service
