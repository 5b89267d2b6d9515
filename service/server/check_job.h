#pragma once

#include <set>
#include <string>

#include "queue/blob_store.h"
#include "rcs/v1/job.pb.h"
#include "server/config.h"

namespace rcs::service {

/// What the queue has to know of a job beside itself.
struct CheckedJob {
    v1::Job job;                  ///< labels filled in
    std::string scene_key;        ///< equal for equal scenes
    std::set<std::string> blobs;  ///< digests that it needs
};

/// Everything that can be said against a job without decoding its scene.
/// @throws ServiceError, rcs::Error: the field, its value and its range
CheckedJob check_job(const v1::Job& job, const ServerConfig& config, const BlobStore& blobs);

/// @throws rcs::Error bad_argument
void check_priority(int priority);

/// A scene folder's files of one file alone.
v1::SceneFiles single_file(const std::string& name, const v1::Blob& blob);

}  // namespace rcs::service
