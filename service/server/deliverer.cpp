#include "server/deliverer.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "wire/errors.h"
#include "wire/files.h"

namespace rcs::service {
namespace {

namespace fs = std::filesystem;

constexpr mode_t kFileMode = 0644, kFolderMode = 0755;  // whatever the server's umask: they are for others

[[noreturn]] void fail(const char* what, const std::string& path)
{
    throw std::system_error(errno, std::generic_category(), std::string("cannot ") + what + " " + path);
}

/// The folder, made where it is missing, part by part: a symbolic link on the way is refused.
Fd opened_folder(const std::string& root, const std::string& relative)
{
    Fd folder(::open(root.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (!folder) fail("open", root);
    for (const fs::path& part : fs::path(relative)) {
        if (part.empty() || part == ".") continue;
        const bool made = ::mkdirat(folder.get(), part.c_str(), kFolderMode) == 0;
        Fd next(::openat(folder.get(), part.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
        if (!next) fail("open", relative);
        if (made) ::fchmod(next.get(), kFolderMode);
        folder = std::move(next);
    }
    return folder;
}

void copy_file(const std::string& from, const Fd& folder, const std::string& name)
{
    const Fd source(::open(from.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW));
    if (!source) fail("read the picture", name);
    const std::string hidden = "." + name + ".part";
    ::unlinkat(folder.get(), hidden.c_str(), 0);  // of an earlier server
    const Fd target(::openat(folder.get(), hidden.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC | O_NOFOLLOW, 0600));
    if (!target) fail("write", name);
    try {
        constexpr std::size_t kChunk = 1 << 20;
        std::uint64_t done = 0;
        for (std::string bytes; bytes = read_part(source, done, kChunk, from), !bytes.empty(); done += bytes.size()) {
            for (std::size_t written = 0; written < bytes.size();) {
                const ssize_t count = ::write(target.get(), bytes.data() + written, bytes.size() - written);
                if (count < 0 && errno != EINTR) fail("write", name);
                if (count > 0) written += static_cast<std::size_t>(count);
            }
        }
        if (::fchmod(target.get(), kFileMode) != 0 || ::fsync(target.get()) != 0) fail("write", name);
        if (::renameat(folder.get(), hidden.c_str(), folder.get(), name.c_str()) != 0) fail("write", name);
    } catch (...) {
        ::unlinkat(folder.get(), hidden.c_str(), 0);
        throw;
    }
}

std::string delivered(const std::string& root, const DeliveryTask& task)
{
    try {
        const Fd folder = opened_folder(root, task.to);
        for (const auto& [name, target] : task.files) copy_file(task.from + "/" + name, folder, target);
        if (::fsync(folder.get()) != 0) fail("write to", task.to);
        return "";
    } catch (const std::exception& e) {
        return e.what();
    }
}

}  // namespace

Deliverer::Deliverer(std::string root)
    : root_(std::move(root)), thread_([this](const std::stop_token& stop) { run(stop); })
{
}

void Deliverer::give(DeliveryTask task)
{
    const std::scoped_lock lock(mutex_);
    tasks_.push_back(std::move(task));
    wake_.notify_one();
}

std::vector<DeliveryEnd> Deliverer::take()
{
    const std::scoped_lock lock(mutex_);
    return std::exchange(ends_, {});
}

void Deliverer::run(const std::stop_token& stop)
{
    std::unique_lock lock(mutex_);
    while (wake_.wait(lock, stop, [this] { return !tasks_.empty(); }) && !stop.stop_requested()) {
        const DeliveryTask task = std::move(tasks_.front());
        tasks_.pop_front();
        lock.unlock();
        std::string error = delivered(root_, task);
        lock.lock();
        ends_.push_back({task.key, std::move(error)});
    }
}

std::string folder_beneath(const std::string& root, const std::string& folder)
{
    const fs::path asked(folder);
    const fs::path relative = asked.is_absolute() ? asked.lexically_relative(root) : asked;
    if (relative.empty() || std::find(relative.begin(), relative.end(), "..") != relative.end()) {
        throw ServiceError(v1::ERROR_CODE_FORBIDDEN,
                           "deliver is " + folder.substr(0, 200) + ", expected a folder beneath " + root);
    }
    return relative.string();
}

}  // namespace rcs::service
