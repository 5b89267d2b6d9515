#pragma once

namespace rcs::service {

/// Renders frames that the server sends over the socket `fd`, until the server goes away. Only here scenes are decoded.
/// The scene of the last frame stays, with its rays and the GL context, for the next frame of the same scene.
/// @param threads  of rendering
void run_worker(int fd, int threads);

}  // namespace rcs::service
