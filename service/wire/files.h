#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace rcs::service {

/// A file descriptor that is closed at the end.
class Fd {
public:
    explicit Fd(int fd = -1) : fd_(fd) {}
    ~Fd();
    Fd(Fd&& other) noexcept : fd_(other.release()) {}
    Fd& operator=(Fd&& other) noexcept;

    int get() const { return fd_; }
    explicit operator bool() const { return fd_ >= 0; }
    int release();

private:
    int fd_;
};

/// What failed with a file, by errno: a full disk is unavailable, all else internal.
[[noreturn]] void fail_file(const std::string& what, const std::string& path);

/// Makes a folder for its owner alone; one that exists has to be a folder. @throws ServiceError
void make_private_folder(const std::string& path);
/// What was written to a file, or renamed in a folder, stays when the power goes. @throws ServiceError
void sync_path(const std::string& path);
void write_all(int fd, std::string_view bytes, const std::string& path);
/// Bytes at `offset`, fewer only at the file's end. @throws ServiceError
std::string read_part(const std::string& path, std::uint64_t offset, std::size_t length);
std::string read_part(const Fd& file, std::uint64_t offset, std::size_t length, const std::string& path);

/// What a file's time of modification is to be [ms].
void set_modified(const std::string& path, std::int64_t ms);

/// Whether the disk takes so many bytes more in this folder: they are reserved to see, and freed again.
bool has_room(const std::string& folder, std::uint64_t bytes);
/// What the disk that holds `path` still takes [bytes].
std::uint64_t free_space(const std::string& path);

}  // namespace rcs::service
