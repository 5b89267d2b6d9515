#pragma once

#include <string>

#include "rcs/scene.h"

namespace rcs {

/// load_scene() of a file whose buffers and images may lie anywhere beneath `root`; "": beneath its own folder.
Scene load_scene_within(const std::string& source, const std::string& root, const LogFunction& log,
                        const LoadOptions& options);

}  // namespace rcs
