#pragma once

#include <string>

#include "rcs/camera.h"
#include "rcs/fingerprint.h"
#include "rcs/reference.h"
#include "rcs/render.h"
#include "rcs/scene.h"

namespace rcs::service {

/// What path traced sums belong to: scene, view, transport and seed, but not how many samples there are.
std::string paths_key(const Scene& scene, const View& view, const ReferenceOptions& options);

/// What a point's time also depends on: the very library file, processor, threads and OpenGL.
std::string machine_key(int threads, const std::string& gl_renderer);

/// As the system names it; "" where it does not.
std::string processor_name();

/// Every option of a render.
void add(Fingerprint& fingerprint, const RenderOptions& options);

}  // namespace rcs::service
