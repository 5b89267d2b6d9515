#include "queue/blob_store.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "wire/errors.h"

namespace rcs::service {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kBetweenSyncs =
    8 << 20;                                // so that the last sync of a large file does not hold everyone up [bytes]
constexpr std::size_t kLongestPath = 1000;  // [bytes]
constexpr const char* kPart = ".part";
constexpr std::int64_t kPause = 10'000;  // of an upload that another one may take the place of [ms]

std::int64_t modified_ms(const fs::path& path)
{
    struct stat status{};
    if (::stat(path.c_str(), &status) != 0) return 0;
    return std::int64_t{status.st_mtim.tv_sec} * 1000 + status.st_mtim.tv_nsec / 1'000'000;
}

struct Found {
    fs::path path;
    std::int64_t used_ms = 0;
    std::uint64_t size = 0;
};

std::vector<Found> oldest_first(const std::string& folder)
{
    std::vector<Found> found;
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(folder, ignored)) {
        found.push_back(
            {entry.path(), modified_ms(entry.path()), entry.is_regular_file(ignored) ? entry.file_size(ignored) : 0});
    }
    std::sort(found.begin(), found.end(), [](const Found& a, const Found& b) { return a.used_ms < b.used_ms; });
    return found;
}

void sync_folders(const std::string& folder)
{
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
        if (entry.is_directory()) sync_path(entry.path().string());
    }
    sync_path(folder);
}

}  // namespace

void check_scene_path(const std::string& path)
{
    const auto refuse = [&](const char* why) {
        throw ServiceError(v1::ERROR_CODE_BAD_ARGUMENT, "scene file '" + path.substr(0, 100) + "' " + why);
    };
    if (path.empty() || path.size() > kLongestPath) refuse("has no name or one of over 1000 bytes");
    if (path.find('\0') != path.npos || path.find('\\') != path.npos) refuse("has a character that is not allowed");
    for (std::size_t begin = 0; begin <= path.size();) {
        const std::size_t end = std::min(path.find('/', begin), path.size());
        const std::string part = path.substr(begin, end - begin);
        if (part.empty() || part == "." || part == ".." || part.size() > 255)
            refuse("is no relative path without '..'");
        begin = end + 1;
    }
}

void check_digest(const v1::Blob& blob)
{
    if (blob.sha256().size() != kDigestSize) {
        throw ServiceError(v1::ERROR_CODE_BAD_ARGUMENT,
                           "sha256 has " + std::to_string(blob.sha256().size()) + " bytes, expected 32");
    }
}

BlobStore::BlobStore(const std::string& state, const BlobLimits& limits)
    : folder_(state + "/blobs"), scenes_(state + "/scenes"), limits_(limits)
{
    make_private_folder(folder_);
    make_private_folder(scenes_);
    for (const Found& file : oldest_first(folder_)) bytes_ += file.size;
}

bool BlobStore::has(const std::string& digest) const { return ::access(path(digest).c_str(), R_OK) == 0; }

std::string BlobStore::path(const std::string& digest) const { return folder_ + "/" + hex(digest); }

std::string BlobStore::part_path(const v1::Blob& blob, const std::string& owner) const
{
    return path(blob.sha256()) + "." + hex(sha256(owner)).substr(0, 16) + kPart;
}

std::uint64_t BlobStore::held(const v1::Blob& blob, const std::string& owner, std::int64_t now_ms)
{
    check_digest(blob);
    if (has(blob.sha256())) {
        set_modified(path(blob.sha256()), now_ms);
        return blob.size();
    }
    struct stat status{};
    const std::string part = part_path(blob, owner);
    if (::stat(part.c_str(), &status) != 0) return 0;
    const auto size = static_cast<std::uint64_t>(status.st_size);
    if (size < blob.size()) return size;
    // A server ended between the last byte and the digest.
    if (upload(blob, owner, now_ms).held == blob.size()) {
        finish(part, blob.sha256());
        return blob.size();
    }
    drop(part);
    return 0;
}

BlobStore::Upload& BlobStore::upload(const v1::Blob& blob, const std::string& owner, std::int64_t now_ms)
{
    const std::string part = part_path(blob, owner);
    const auto found = uploads_.find(part);
    if (found != uploads_.end()) {
        found->second.used_ms = now_ms;
        return found->second;
    }
    make_room(now_ms);
    Upload upload;
    upload.fd = Fd(::open(part.c_str(), O_CREAT | O_RDWR | O_CLOEXEC | O_NOFOLLOW, 0600));
    if (!upload.fd) fail_file("write", part);
    upload.sum = std::make_unique<Sha256>();
    upload.used_ms = now_ms;
    // What an earlier process has received is summed up again.
    for (std::string bytes; bytes = read_part(part, upload.held, 1 << 20), !bytes.empty();) {
        upload.sum->add(bytes);
        upload.held += bytes.size();
    }
    return uploads_.emplace(part, std::move(upload)).first->second;
}

/// An upload that was broken off only waits: what it brought stays in its file, from which it goes on.
void BlobStore::make_room(std::int64_t now_ms)
{
    if (uploads_.size() < static_cast<std::size_t>(limits_.max_uploads)) return;
    for (auto upload = uploads_.begin(); upload != uploads_.end();) {
        if (!upload->second.client.expired()) {
            ++upload;
            continue;
        }
        set_modified(upload->first, upload->second.used_ms);
        upload = uploads_.erase(upload);
    }
    if (uploads_.size() < static_cast<std::size_t>(limits_.max_uploads)) return;
    const auto oldest = std::min_element(uploads_.begin(), uploads_.end(), [](const auto& a, const auto& b) {
        return a.second.used_ms < b.second.used_ms;
    });
    if (oldest == uploads_.end() || oldest->second.used_ms + kPause > now_ms) {
        throw ServiceError(v1::ERROR_CODE_LIMIT, std::to_string(uploads_.size()) +
                                                     " uploads are under way, no more are allowed; try again soon");
    }
    set_modified(oldest->first, oldest->second.used_ms);
    uploads_.erase(oldest);
}

std::uint64_t BlobStore::put(const v1::Blob& blob, const std::string& owner, std::uint64_t offset,
                             const std::string& data, std::int64_t now_ms, const std::weak_ptr<const void>& client)
{
    check_digest(blob);
    if (blob.size() > limits_.max_file) {
        throw ServiceError(v1::ERROR_CODE_LIMIT, "a file of " + std::to_string(blob.size()) +
                                                     " bytes is larger than the " + std::to_string(limits_.max_file) +
                                                     " that are allowed");
    }
    if (has(blob.sha256())) return blob.size();
    if (bytes_ + data.size() > limits_.max_store) {
        throw ServiceError(v1::ERROR_CODE_LIMIT, "the store of uploaded files is full: it may hold " +
                                                     std::to_string(limits_.max_store) + " bytes");
    }
    Upload& going = upload(blob, owner, now_ms);
    going.client = client;
    const std::string part = part_path(blob, owner);
    if (going.held > blob.size()) {
        drop(part);
        return 0;
    }
    if (offset != going.held || (data.empty() && going.held < blob.size())) return going.held;
    if (data.size() > blob.size() - going.held) {
        throw ServiceError(v1::ERROR_CODE_BAD_ARGUMENT,
                           "the chunk goes beyond the file's size of " + std::to_string(blob.size()) + " bytes");
    }
    try {
        write_all(going.fd.get(), data, part);
        if (going.held + data.size() - going.synced >= kBetweenSyncs) {
            if (::fdatasync(going.fd.get()) != 0) fail_file("write", part);
            going.synced = going.held + data.size();
        }
    } catch (const ServiceError&) {
        // Part of the chunk may be there: the file goes on from where the last one ended.
        if (::ftruncate(going.fd.get(), static_cast<off_t>(going.held)) != 0 ||
            ::lseek(going.fd.get(), 0, SEEK_END) < 0) {
            drop(part);
        }
        throw;
    }
    going.sum->add(data);
    going.held += data.size();
    bytes_ += data.size();
    set_modified(part, now_ms);
    if (going.held == blob.size()) finish(part, blob.sha256());
    return blob.size() == 0 ? 0 : offset + data.size();
}

void BlobStore::finish(const std::string& part, const std::string& digest)
{
    Upload& done = uploads_.at(part);
    if (done.sum->digest() != digest) {
        drop(part);
        throw ServiceError(v1::ERROR_CODE_BAD_FILE,
                           "the uploaded bytes have another SHA-256 than " + hex(digest) + "; they were dropped");
    }
    if (::fchmod(done.fd.get(), 0400) != 0 || ::fsync(done.fd.get()) != 0 ||
        ::rename(part.c_str(), path(digest).c_str()) != 0) {
        const int error = errno;
        drop(part);
        errno = error;
        fail_file("complete", part);
    }
    uploads_.erase(part);
    sync_path(folder_);
}

void BlobStore::drop(const std::string& part)
{
    struct stat status{};
    if (::stat(part.c_str(), &status) == 0) bytes_ -= std::min(bytes_, static_cast<std::uint64_t>(status.st_size));
    uploads_.erase(part);
    ::unlink(part.c_str());
}

std::string BlobStore::scene_key(const v1::SceneFiles& files)
{
    Sha256 sum;
    for (const v1::SceneFile& file : files.files()) {
        sum.add(file.path() + '\0');
        sum.add(file.content().sha256());
    }
    return hex(sum.digest());
}

std::string BlobStore::scene(const std::string& key, const v1::SceneFiles& files, std::int64_t now_ms)
{
    const std::string folder = scenes_ + "/" + key;
    const std::string first = folder + "/" + files.files(0).path();
    if (fs::exists(folder)) {
        set_modified(folder, now_ms);
        return first;
    }
    const std::string making = folder + kPart;
    std::error_code problem;
    fs::remove_all(making, problem);
    make_private_folder(making);
    for (const v1::SceneFile& file : files.files()) {
        check_scene_path(file.path());
        const fs::path target = fs::path(making) / file.path();
        fs::create_directories(target.parent_path(), problem);
        if (problem)
            throw ServiceError(v1::ERROR_CODE_UNAVAILABLE, "cannot make " + target.string() + ": " + problem.message());
        if (::link(path(file.content().sha256()).c_str(), target.c_str()) != 0) fail_file("link", target.string());
    }
    sync_folders(making);  // a folder of this name holds all of them, whenever the power goes
    set_modified(making, now_ms);
    if (::rename(making.c_str(), folder.c_str()) != 0) fail_file("rename", making);
    return first;
}

std::uint64_t BlobStore::remove_unused(std::int64_t oldest_ms, std::uint64_t most_bytes,
                                       const std::set<std::string>& digests_in_use,
                                       const std::set<std::string>& scenes_in_use)
{
    std::set<std::string> kept;
    for (const std::string& digest : digests_in_use) kept.insert(hex(digest));
    std::error_code ignored;
    const bool full = bytes_ > most_bytes;
    // Scenes are links: what they hold is free once both are gone.
    for (const Found& scene : oldest_first(scenes_)) {
        if ((full || scene.used_ms < oldest_ms) && !scenes_in_use.contains(scene.path.filename()))
            fs::remove_all(scene.path, ignored);
    }
    std::uint64_t freed = 0;
    for (const Found& file : oldest_first(folder_)) {
        const bool needed = kept.contains(file.path.filename()) || uploads_.contains(file.path);
        if (file.used_ms < oldest_ms && uploads_.contains(file.path)) {
            uploads_.erase(file.path);  // its client went away
        } else if (needed || (file.used_ms >= oldest_ms && bytes_ <= most_bytes)) {
            continue;
        }
        if (fs::remove(file.path, ignored)) {
            bytes_ -= std::min(bytes_, file.size);
            freed += file.size;
        }
    }
    return freed;
}

void BlobStore::remove_older(const std::string& folder, std::int64_t oldest_ms)
{
    std::error_code ignored;
    for (const Found& found : oldest_first(folder)) {
        if (found.used_ms < oldest_ms) fs::remove_all(found.path, ignored);
    }
}

}  // namespace rcs::service
