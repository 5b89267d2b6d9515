#pragma once

#include <string>

namespace rcs::test {

/// A small file system of its own, in a mount namespace of this process alone. Without the right to mount nothing is
/// done, and full() never is.
class SmallDisk {
public:
    /// @param place  a folder that appears at `place`, on the disk at `disk`; both are made
    SmallDisk(const std::string& disk, const std::string& place, int megabytes);
    ~SmallDisk();
    SmallDisk(const SmallDisk&) = delete;
    SmallDisk& operator=(const SmallDisk&) = delete;

    bool exists() const { return exists_; }
    void fill();
    void empty();

private:
    std::string disk_, place_;
    bool exists_ = false;
};

/// Gives this process mounts of its own, which end with it and its children. @return whether it may
bool own_mounts();

}  // namespace rcs::test
