#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "rcs/scene.h"

namespace rcs {

/// How the numbers of an integer image are meant. Float images are linear, alpha is in every case.
enum class ColorSpace { srgb, linear };

/// Whether OpenImageIO was built with WebP.
bool reads_webp();

/// Decodes a PNG, JPEG, WebP, TIFF or EXR file that lies in memory, as linear RGBA. Alpha is not
/// multiplied into the colour, and 1 where the image has none.
/// @param most_texels  the image may have   @param where  names the image in messages
/// @throws Error bad_file, unsupported
Texture decode_texture(std::span<const std::uint8_t> bytes, ColorSpace space, std::int64_t most_texels,
                       std::string name, const std::string& where);

}  // namespace rcs
