#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "rcs/v1/job.pb.h"
#include "wire/files.h"
#include "wire/sha256.h"

namespace rcs::service {

struct BlobLimits {
    std::uint64_t max_file = 4ull << 30;    ///< [bytes]
    std::uint64_t max_store = 50ull << 30;  ///< of all files, complete or not [bytes]; an upload beyond is refused
    int max_uploads = 64;                   ///< under way at a time
};

/// Uploaded files by their content: STATE/blobs/DIGEST, and DIGEST.OWNER.part while incomplete. The folder is all there
/// is: a file appears under its digest only once its bytes were found to have it, and are on disk. Owners continue only
/// their own uploads. Scenes made of such files: STATE/scenes/KEY, a folder of hard links.
///
/// When files were used last is kept as their time of modification, by the queue's clock (job_queue.h): `now`.
class BlobStore {
public:
    /// @param state  the state folder
    BlobStore(const std::string& state, const BlobLimits& limits);

    void set_limits(const BlobLimits& limits) { limits_ = limits; }

    bool has(const std::string& digest) const;
    /// Bytes that are there: the blob's size if, and only if, it is complete.
    std::uint64_t held(const v1::Blob& blob, const std::string& owner, std::int64_t now_ms);
    /// Appends a chunk, unless it begins elsewhere than where the upload stands. @return bytes held after it
    /// @throws ServiceError bad_argument, limit, unavailable; bad_file: the bytes have another digest, and are dropped
    /// @param client  who is gone once nothing else holds it: then the upload waits, and others have its place
    std::uint64_t put(const v1::Blob& blob, const std::string& owner, std::uint64_t offset, const std::string& data,
                      std::int64_t now_ms, const std::weak_ptr<const void>& client);

    std::string path(const std::string& digest) const;  ///< of a complete one

    /// The folder of a scene made of these files, made unless it is there. @return path of its first file
    /// @throws ServiceError
    std::string scene(const std::string& key, const v1::SceneFiles& files, std::int64_t now_ms);
    /// Equal for equal files under equal names.
    static std::string scene_key(const v1::SceneFiles& files);

    /// Removes files and scenes that were not used since `oldest` and that nobody needs, more where the store is fuller
    /// than `most_bytes`, and uploads that did not go on since. @return bytes that were freed
    std::uint64_t remove_unused(std::int64_t oldest_ms, std::uint64_t most_bytes,
                                const std::set<std::string>& digests_in_use,
                                const std::set<std::string>& scenes_in_use);
    std::uint64_t bytes() const { return bytes_; }
    /// Removes what lies in a folder and was last used before.
    static void remove_older(const std::string& folder, std::int64_t oldest_ms);

private:
    struct Upload {
        Fd fd;
        std::uint64_t held = 0;
        std::uint64_t synced = 0;
        std::int64_t used_ms = 0;
        std::unique_ptr<Sha256> sum;
        std::weak_ptr<const void> client;
    };
    std::string part_path(const v1::Blob& blob, const std::string& owner) const;
    Upload& upload(const v1::Blob& blob, const std::string& owner, std::int64_t now_ms);
    void make_room(std::int64_t now_ms);
    /// Verifies an upload that has all its bytes. If it cannot be completed nothing of it is kept.
    void finish(const std::string& part, const std::string& digest);
    void drop(const std::string& part);

    std::string folder_, scenes_;
    BlobLimits limits_;
    std::map<std::string, Upload> uploads_;  ///< by path; those under way
    std::uint64_t bytes_ = 0;
};

/// Whether a job may name a file so. @throws ServiceError bad_argument
void check_scene_path(const std::string& path);
/// @throws ServiceError bad_argument unless it has 32 bytes
void check_digest(const v1::Blob& blob);

}  // namespace rcs::service
