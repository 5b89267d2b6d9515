#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "rcs/image.h"

namespace rcs {

/// How a file stores its samples, or what they are read as.
enum class SampleType { uint8, uint16, real, other };

/// What a picture file says of itself.
struct ImageFileSpec {
    int width = 0, height = 0, depth = 1, channels = 0;
    SampleType type = SampleType::other;  ///< real: half, float or double
    std::string type_name;                ///< in words
    std::string format;                   ///< such as "openexr"
    std::vector<std::string> channel_names;
    std::vector<std::pair<std::string, std::string>> attributes;
    std::optional<ImageWindow> window;  ///< of a file that holds a part of its picture
    int tile_height = 0;                ///< 0: rows are stored one by one
    bool alpha_apart = false;           ///< colours as read are not multiplied by alpha

    std::size_t texels() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
    /// @return -1: there is no channel of that name
    int channel(const std::string& name) const;
};

/// A picture file that is being read.
class ImageReader {
public:
    virtual ~ImageReader() = default;
    const ImageFileSpec& spec() const { return spec_; }
    /// Reads rows [begin, end) of the first so many channels, pixel by pixel: each row once, in order, of whole tiles.
    /// @param type  not other   @param samples  room for them
    /// @return whether it could: error() says why not
    virtual bool read_rows(int begin, int end, int channels, SampleType type, void* samples) = 0;
    virtual std::string error() = 0;

protected:
    ImageFileSpec spec_;
};

/// Opens a picture file of any kind. @return null: `why` says the reason
/// @throws Error not_found: it takes the module, which is missing
std::unique_ptr<ImageReader> open_image(const std::string& path, std::string& why);
/// Opens one that lies in memory: PNG, JPEG, EXR, TIFF or WebP, colours not multiplied by alpha.
/// @param bytes  outlive the reader   @return null, and no reason: it is of no such kind
std::unique_ptr<ImageReader> open_image(std::span<const std::uint8_t> bytes, std::string& why);

/// What the module of other image files than PNG and JPEG does. It lies in a file of its own, since the library behind
/// it (OpenImageIO) draws in 260 others, which take 0.15 s and 120 MB: more than many a render does.
struct ImageModule {
    /// @return null: `why` says the reason
    std::unique_ptr<ImageReader> (*open_file)(const std::string& path, std::string& why);
    /// @param name  whose ending names the format
    std::unique_ptr<ImageReader> (*open_memory)(const char* name, std::span<const std::uint8_t> bytes,
                                                std::string& why);
    bool (*reads)(const char* format);
    std::string (*formats)();  ///< all that it reads, with commas
};

/// Opens the module when first asked. @throws Error not_found: the library was installed without it
const ImageModule& image_module();

}  // namespace rcs
