#pragma once

#include <string>

#include "rcs/image.h"
#include "rcs/thread_pool.h"
#include "rcs/tone_map.h"

namespace rcs::service {

/// A JPEG of at most 320 pixels a side, as the mapper shows the picture.
/// @return whether there was room for it
bool write_small_picture(const std::string& path, const Image& beauty, ToneMapper& mapper, ThreadPool& pool);

}  // namespace rcs::service
