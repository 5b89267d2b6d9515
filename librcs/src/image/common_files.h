#pragma once

#include <memory>
#include <vector>

#include "image/image_reader.h"

namespace rcs {

/// Whether a file begins as PNG or JPEG does.
bool is_png(std::span<const std::uint8_t> bytes);
bool is_jpeg(std::span<const std::uint8_t> bytes);

/// Readers of the two kinds that most textures are, by libpng and libjpeg. They read rows in order; colours of PNG are
/// not multiplied by alpha.
/// @param bytes  outlive the reader   @return null: `why` says the reason
std::unique_ptr<ImageReader> open_png(std::span<const std::uint8_t> bytes, std::string& why);
/// ... or `why` is empty: its colours are not grey or RGB, which is for the module.
std::unique_ptr<ImageReader> open_jpeg(std::span<const std::uint8_t> bytes, std::string& why);

}  // namespace rcs
