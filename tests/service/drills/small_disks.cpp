#include "service/drills/small_disks.h"

#include <filesystem>
#include <fstream>

#include <fcntl.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "wire/files.h"

namespace rcs::test {

bool own_mounts()
{
    const auto uid = ::geteuid();
    const auto gid = ::getegid();
    if (uid != 0) {
        if (::unshare(CLONE_NEWUSER | CLONE_NEWNS) != 0) return false;
        std::ofstream("/proc/self/setgroups") << "deny";
        std::ofstream("/proc/self/uid_map") << "0 " << uid << " 1";
        std::ofstream("/proc/self/gid_map") << "0 " << gid << " 1";
    } else if (::unshare(CLONE_NEWNS) != 0) {
        return false;
    }
    return ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0;
}

SmallDisk::SmallDisk(const std::string& disk, const std::string& place, int megabytes) : disk_(disk), place_(place)
{
    namespace fs = std::filesystem;
    fs::create_directories(disk);
    fs::create_directories(place);
    const std::string options = "mode=0700,size=" + std::to_string(megabytes) + "m";
    if (::mount("rcs-drill", disk.c_str(), "tmpfs", 0, options.c_str()) != 0) return;
    fs::create_directory(disk + "/content");
    fs::permissions(disk + "/content", fs::perms::owner_all);
    exists_ = ::mount((disk + "/content").c_str(), place.c_str(), nullptr, MS_BIND, nullptr) == 0;
}

SmallDisk::~SmallDisk()
{
    if (exists_) ::umount2(place_.c_str(), MNT_DETACH);
    ::umount2(disk_.c_str(), MNT_DETACH);
}

void SmallDisk::fill()
{
    const service::Fd file(::open((disk_ + "/filler").c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600));
    struct statvfs room{};
    ::fstatvfs(file.get(), &room);
    [[maybe_unused]] const int most =
        ::posix_fallocate(file.get(), 0, static_cast<off_t>(room.f_bavail * room.f_bsize));
    ::lseek(file.get(), 0, SEEK_END);
    const std::string block(4 << 10, 'x');
    while (::write(file.get(), block.data(), block.size()) > 0) {
    }
}

void SmallDisk::empty() { ::unlink((disk_ + "/filler").c_str()); }

}  // namespace rcs::test
