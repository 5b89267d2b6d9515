#pragma once

#include <cstdio>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "rcs/image.h"

namespace rcs {

/// A layer, and how its channels are called and stored.
struct ExrLayer {
    const Image* image;
    std::vector<std::string> channels;  ///< names in the file, one for each of the image
    bool full_float;                    ///< else half: what that cannot hold becomes its largest number
};

/// Writes layers of one size as an OpenEXR file. Same bytes for the same pixels and attributes.
/// @param window  where they lie in their picture; none: they are all of it   @param path  for messages   @throws Error
/// io
void write_exr_file(std::FILE* file, const std::string& path, const std::vector<ExrLayer>& layers,
                    const std::optional<ImageWindow>& window, const std::map<std::string, std::string>& attributes);

}  // namespace rcs
