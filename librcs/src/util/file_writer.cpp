#include "util/file_writer.h"

#include <cerrno>
#include <cstring>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

#include "rcs/error.h"

namespace rcs {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const std::string& path, const std::string& why)
{
    throw Error(ErrorCode::io, "cannot write '" + path + "': " + why);
}

/// The file itself where `path` is a symbolic link, so that a rename replaces what it points to.
fs::path resolved(const std::string& path)
{
    constexpr int kMostLinks = 40;  // as many as Linux follows
    std::error_code ignored;
    fs::path target = path;
    for (int i = 0; i < kMostLinks && fs::is_symlink(target, ignored); ++i) {
        target = target.parent_path() / fs::read_symlink(target, ignored);
    }
    return target;
}

void check_target(const std::string& path, const fs::path& target)
{
    std::error_code ignored;
    const fs::path parent = target.has_parent_path() ? target.parent_path() : fs::path(".");
    if (!fs::exists(parent, ignored)) {
        fail(path, "the folder '" + parent.string() + "' does not exist");
    }
    if (!fs::is_directory(parent, ignored)) {
        fail(path, parent.string() + " is not a folder");
    }
    const fs::file_status status = fs::status(target, ignored);
    if (fs::is_directory(status)) {
        fail(path, "it is a folder");
    }
    if (fs::exists(status) && !fs::is_regular_file(status)) {
        fail(path, "it is not a regular file");
    }
}

}  // namespace

FileWriter::FileWriter(const std::string& path) : path_(path), target_(resolved(path))
{
    check_target(path, target_);
    std::string name = ".";
    name.append(target_.filename().string()).append(".tmp-").append(std::to_string(::getpid()));
    temporary_ = target_.parent_path() / name;
    // Not created exclusively: a file of this name can only be left over from a dead process.
    const int fd = ::open(temporary_.c_str(), O_CREAT | O_TRUNC | O_RDWR | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (fd < 0) {
        fail(path, std::strerror(errno));
    }
    file_ = ::fdopen(fd, "w+b");
    if (file_ == nullptr) {
        const int error = errno;
        ::close(fd);
        ::unlink(temporary_.c_str());
        fail(path, std::strerror(error));
    }
}

FileWriter::~FileWriter()
{
    if (file_ != nullptr) {
        std::fclose(file_);
    }
    if (!temporary_.empty()) {
        ::unlink(temporary_.c_str());
    }
}

void FileWriter::commit()
{
    // A full disk may show only when buffers are flushed, and on network file systems at close.
    errno = 0;
    const bool flushed = std::fflush(file_) == 0 && std::ferror(file_) == 0;
    int error = errno;
    const bool closed = std::fclose(file_) == 0;
    file_ = nullptr;
    if (!flushed || !closed) {
        error = error != 0 ? error : errno;
        fail(path_, error != 0 ? std::strerror(error) : "not all bytes could be written");
    }
    if (::rename(temporary_.c_str(), target_.c_str()) != 0) {
        fail(path_, std::strerror(errno));
    }
    temporary_.clear();
}

}  // namespace rcs
