#pragma once

#include <string>
#include <vector>

namespace rcs::service {

/// Shows pictures one after the other, in a movie file that appears under its name only when complete.
/// @param maker  ffmpeg   @param pictures  PNG or JPEG files of one size   @param fps  pictures a second
/// @return "", or why there is none: what the maker says last
std::string make_movie(const std::string& maker, const std::vector<std::string>& pictures, double fps,
                       const std::string& file);

}  // namespace rcs::service
