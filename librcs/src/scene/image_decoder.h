#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "rcs/scene.h"

namespace rcs {

/// Decodes a PNG, JPEG, TIFF or EXR file that lies in memory. Integer images hold sRGB values,
/// float images linear ones; both become linear RGB. Alpha is left out.
/// @param where  names the image in messages
/// @throws Error bad_file, unsupported
Texture decode_texture(std::span<const std::uint8_t> bytes, std::string name, const std::string& where);

}  // namespace rcs
