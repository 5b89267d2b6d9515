#include "wire/files.h"

#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "wire/errors.h"

namespace rcs::service {

Fd::~Fd()
{
    if (fd_ >= 0) ::close(fd_);
}

Fd& Fd::operator=(Fd&& other) noexcept
{
    if (fd_ >= 0) ::close(fd_);
    fd_ = other.release();
    return *this;
}

int Fd::release()
{
    const int fd = fd_;
    fd_ = -1;
    return fd;
}

void fail_file(const std::string& what, const std::string& path)
{
    const int error = errno;
    const bool full = error == ENOSPC || error == EDQUOT || error == EMFILE || error == ENFILE;
    throw ServiceError(full ? v1::ERROR_CODE_UNAVAILABLE : v1::ERROR_CODE_INTERNAL,
                       "cannot " + what + " " + path + ": " + std::strerror(error));
}

void make_private_folder(const std::string& path)
{
    struct stat status{};
    if (::mkdir(path.c_str(), 0700) != 0 && errno != EEXIST) fail_file("make", path);
    if (::stat(path.c_str(), &status) != 0) fail_file("look at", path);
    if (!S_ISDIR(status.st_mode)) throw ServiceError(v1::ERROR_CODE_INTERNAL, path + " is no folder");
}

void sync_path(const std::string& path)
{
    const Fd fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
    if (!fd || ::fsync(fd.get()) != 0) fail_file("sync", path);
}

void write_all(int fd, std::string_view bytes, const std::string& path)
{
    while (!bytes.empty()) {
        const ssize_t count = ::write(fd, bytes.data(), bytes.size());
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) fail_file("write", path);
        bytes.remove_prefix(static_cast<std::size_t>(count));
    }
}

std::string read_part(const std::string& path, std::uint64_t offset, std::size_t length)
{
    const Fd fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW));
    if (!fd) fail_file("read", path);
    return read_part(fd, offset, length, path);
}

std::string read_part(const Fd& fd, std::uint64_t offset, std::size_t length, const std::string& path)
{
    std::string bytes(length, '\0');
    std::size_t done = 0;
    while (done < length) {
        const ssize_t count = ::pread(fd.get(), bytes.data() + done, length - done, static_cast<off_t>(offset + done));
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) fail_file("read", path);
        if (count == 0) break;
        done += static_cast<std::size_t>(count);
    }
    bytes.resize(done);
    return bytes;
}

void set_modified(const std::string& path, std::int64_t ms)
{
    const timespec time{ms / 1000, static_cast<long>(ms % 1000) * 1'000'000};
    const timespec times[] = {time, time};
    ::utimensat(AT_FDCWD, path.c_str(), times, AT_SYMLINK_NOFOLLOW);
}

bool has_room(const std::string& folder, std::uint64_t bytes)
{
    const std::string probe = folder + "/.room";
    const Fd file(::open(probe.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC | O_NOFOLLOW, 0600));
    const int error = file ? ::posix_fallocate(file.get(), 0, static_cast<off_t>(bytes)) : errno;
    ::unlink(probe.c_str());
    return error != ENOSPC && error != EDQUOT;
}

std::uint64_t free_space(const std::string& path)
{
    struct statvfs status{};
    if (::statvfs(path.c_str(), &status) != 0) fail_file("look at", path);
    return static_cast<std::uint64_t>(status.f_bavail) * status.f_frsize;
}

}  // namespace rcs::service
