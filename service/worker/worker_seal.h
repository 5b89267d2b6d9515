#pragma once

#include "seal/seal.h"
#include "worker/worker.h"

namespace rcs::service {

/// Seals a worker, before it has threads: those that were there would stay outside.
/// @throws ServiceError internal
Seal seal_worker(const WorkerArguments& arguments);

}  // namespace rcs::service
