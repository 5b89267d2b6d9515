#pragma once

#include <string>
#include <vector>

namespace rcs::service {

struct WorkerArguments {
    int in = -1, out = -1;           ///< the socket to the server, or what passes on what is said
    bool elsewhere = false;          ///< the server may be on another machine and see nothing of this process
    int threads = 0;                 ///< of rendering; 0: one for each processor that it was given
    std::string state, home;         ///< the server's folder; this worker's within, where its pictures are made
    std::vector<std::string> roots;  ///< beneath which scenes may lie
};

/// Seals itself (seal/seal.h), then renders frames that the server sends, until the server goes away. Only here scenes
/// are decoded. The scene of the last frame stays, with its rays and the GL context, for the next frame of the same
/// scene.
void run_worker(const WorkerArguments& arguments);

}  // namespace rcs::service
