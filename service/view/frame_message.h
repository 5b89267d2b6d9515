#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "rcs/camera.h"
#include "rcs/image.h"
#include "rcs/records.h"
#include "rcs/thread_pool.h"
#include "rcs/tone_map.h"
#include "view/look.h"

namespace rcs::service {

/// How far a picture is.
enum class Progress { moving, refining, done };

/// A picture, and what is said of it.
struct ViewPicture {
    LayeredImage image;  ///< beauty, direct, indirect and their errors, depth
    View view;           ///< it was made for
    Progress progress = Progress::moving;
    double error = 0.0;           ///< mean relative, estimated, of the picture
    double indirect_error = 0.0;  ///< ... and of its indirect light
    double filled = 0.0;          ///< part of its pixels whose indirect light was filled in from around
    double seconds = 0.0;         ///< since the camera stopped, or that the frame took
};

/// The layer as a look wants it, on display.
Image develop(const ViewPicture& picture, const Look& look, const std::vector<Record>& records, ToneMapper& mapper,
              ThreadPool& pool);

/// A frame as the page takes it: length of a JSON text [4 bytes, big-endian], the text, a PNG or JPEG file.
/// @param command  line that makes this picture
std::string frame_message(const ViewPicture& picture, const Look& look, std::uint64_t frame, std::size_t records,
                          const std::string& command, const Image& display, float exposure);

/// What lies at a part of the picture, in scene space [m]; none: nothing.
std::optional<glm::dvec3> point_at(const ViewPicture& picture, const Pick& pick);

}  // namespace rcs::service
