#include "server/frame_logs.h"

#include <cstdio>
#include <filesystem>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "process/clock.h"
#include "process/printable.h"
#include "wire/errors.h"
#include "wire/files.h"

namespace rcs::service {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostOfATry = 64 << 10, kLongestLine = 4000;  // [bytes]

}  // namespace

void FrameLog::add(std::string_view what)
{
    if (text_.size() + kLongestLine > kMostOfATry) return;
    text_ += utc_text(read_clocks().wall_ms) + " " +
             printable(utf8_text(std::string(what.substr(0, kLongestLine - 100)))) + "\n";
}

FrameLogs::FrameLogs(const std::string& state) : folder_(state + "/logs") { make_private_folder(folder_); }

std::string FrameLogs::path(FrameKey key) const
{
    return folder_ + "/" + std::to_string(key.job) + "/" + std::to_string(key.index);
}

void FrameLogs::append(FrameKey key, const std::string& text) const
{
    const std::string file = path(key);
    std::error_code ignored;
    fs::create_directory(fs::path(file).parent_path(), ignored);
    if (fs::file_size(file, ignored) > kMostOfAFrame && !ignored) {
        const std::string kept = read(key);
        fs::remove(file, ignored);
        append(key, kept.substr(kept.size() / 2));
    }
    const Fd fd(::open(file.c_str(), O_CREAT | O_WRONLY | O_APPEND | O_CLOEXEC | O_NOFOLLOW, 0600));
    if (fd) [[maybe_unused]]
        const ssize_t written = ::write(fd.get(), text.data(), text.size());
}

std::string FrameLogs::read(FrameKey key) const
{
    std::error_code none;
    const std::uintmax_t size = fs::file_size(path(key), none);
    if (none) return {};
    try {
        return read_part(path(key), size > kMostOfAFrame ? size - kMostOfAFrame : 0, kMostOfAFrame);
    } catch (const ServiceError&) {
        return {};  // its job is being removed
    }
}

void FrameLogs::remove(std::uint64_t job) const
{
    std::error_code ignored;
    fs::remove_all(folder_ + "/" + std::to_string(job), ignored);
}

}  // namespace rcs::service
