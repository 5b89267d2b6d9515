#pragma once

#include <cstdio>
#include <string>

#include "rcs/image.h"

namespace rcs {

/// Writes display values in [0, 1] with 1 to 4 channels, those beside alpha multiplied by it, as PNG.
/// @param wide  16 bits a value, else 8   @param path  for messages   @throws Error io
void write_png_file(std::FILE* file, const std::string& path, const Image& display, bool wide);

/// The same as JPEG, alpha left out. @param quality  in [1, 100]
void write_jpeg_file(std::FILE* file, const std::string& path, const Image& display, int quality);

}  // namespace rcs
