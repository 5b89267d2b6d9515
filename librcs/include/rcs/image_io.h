#pragma once

#include <string>
#include <vector>

#include "rcs/api.h"
#include "rcs/image.h"

namespace rcs {

/// How pixel values are stored; `automatic` is half for EXR, 8 bit for PNG and JPEG.
enum class PixelFormat { automatic, half_float, full_float, uint8, uint16 };

/// How a picture is written.
struct ImageFileOptions {
    PixelFormat format = PixelFormat::automatic;  ///< of its values
    int jpeg_quality = 92;                        ///< in [1, 100]
    std::vector<std::string> layers;              ///< beside beauty, to store in an EXR; empty: all there are
};

/// Whether the file name's ending is one that write_image() takes (.exr .png .jpg .jpeg), and its
/// folder exists and can be written to.
/// @throws Error bad_argument or io, naming the file, so that a render can fail before it starts
RCS_API void check_output_path(const std::string& path, const ImageFileOptions& options);

/// Writes scene-linear layers as one multi-channel EXR: beauty as R G B A, others as layer.R and so
/// on (depth.Z), metadata as header attributes. The file appears under its name only when complete.
RCS_API void write_exr(const std::string& path, const LayeredImage& image, const ImageFileOptions& options = {});

/// Writes display values in [0, 1] (RGB or RGBA) as PNG or JPEG. The file appears under its name only
/// when complete. Same bytes for the same pixels: no time stamp inside.
RCS_API void write_display_image(const std::string& path, const Image& display, const ImageFileOptions& options = {});

/// What write_display_image() would write under that name, such as "frame.jpg", of which the ending alone counts.
/// @throws Error as that
RCS_API std::string display_image_bytes(const std::string& name, const Image& display,
                                        const ImageFileOptions& options = {});

/// Reads an image file back: an EXR with all its layers and metadata, or any other format OIIO reads
/// (sRGB-decoded to linear if its values are integers) as "beauty" alone.
RCS_API LayeredImage read_image(const std::string& path);

/// What OpenImageIO reads: names with blanks between them.
RCS_API std::string readable_image_formats();

}  // namespace rcs
