// The module of image files: all that librcs asks of OpenImageIO. See image/image_reader.h.

#include <cstring>
#include <optional>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "image/image_reader.h"

namespace rcs {
namespace {

SampleType type_of(const OIIO::TypeDesc& type)
{
    switch (type.basetype) {
        case OIIO::TypeDesc::UINT8:
            return SampleType::uint8;
        case OIIO::TypeDesc::UINT16:
            return SampleType::uint16;
        case OIIO::TypeDesc::HALF:
        case OIIO::TypeDesc::FLOAT:
        case OIIO::TypeDesc::DOUBLE:
            return SampleType::real;
        default:
            return SampleType::other;
    }
}

OIIO::TypeDesc type_of(SampleType type)
{
    return type == SampleType::uint8    ? OIIO::TypeDesc::UINT8
           : type == SampleType::uint16 ? OIIO::TypeDesc::UINT16
                                        : OIIO::TypeDesc::FLOAT;
}

ImageFileSpec spec_of(const OIIO::ImageInput& input)
{
    const OIIO::ImageSpec& from = input.spec();
    ImageFileSpec spec;
    spec.width = from.width;
    spec.height = from.height;
    spec.depth = from.depth;
    spec.channels = from.nchannels;
    spec.type = type_of(from.format);
    const ImageWindow window{from.x - from.full_x, from.y - from.full_y, from.full_width, from.full_height};
    if (window != ImageWindow{0, 0, from.width, from.height}) spec.window = window;
    spec.type_name = from.format.c_str();
    spec.format = input.format_name();
    spec.channel_names = from.channelnames;
    spec.tile_height = from.tile_width > 0 ? from.tile_height : 0;
    for (const OIIO::ParamValue& attribute : from.extra_attribs)
        spec.attributes.emplace_back(attribute.name().string(), attribute.get_string());
    return spec;
}

class Reader : public ImageReader {
public:
    /// Of a file. Check is_open().
    explicit Reader(const std::string& path) { begin(OIIO::ImageInput::open(path)); }

    /// Of bytes in memory.
    Reader(const char* name, std::span<const std::uint8_t> bytes)
    {
        memory_.emplace(bytes.data(), bytes.size());
        OIIO::Filesystem::IOProxy* proxy = &*memory_;
        OIIO::ImageSpec wish;
        wish.attribute("oiio:UnassociatedAlpha", 1);  // glTF's colours are not multiplied by alpha
        // Named twice: readers that are given a wish look for the proxy there and forget the argument.
        wish.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, static_cast<const void*>(&proxy));
        begin(OIIO::ImageInput::open(name, &wish, proxy));
    }

    bool is_open() const { return input_ != nullptr; }

    bool read_rows(int begin, int end, int channels, SampleType type, void* samples) override
    {
        const OIIO::ImageSpec& spec = input_->spec();
        const OIIO::TypeDesc as = type_of(type);
        if (begin == 0 && end == spec.height) return input_->read_image(0, 0, 0, channels, as, samples);
        const int y0 = spec.y + begin, y1 = spec.y + end;
        if (spec.tile_width > 0)
            return input_->read_tiles(0, 0, spec.x, spec.x + spec.width, y0, y1, spec.z, spec.z + 1, 0, channels, as,
                                      samples);
        return input_->read_scanlines(0, 0, y0, y1, spec.z, 0, channels, as, samples);
    }

    std::string error() override { return input_->geterror(); }

private:
    void begin(std::unique_ptr<OIIO::ImageInput> input)
    {
        input_ = std::move(input);
        if (input_) spec_ = spec_of(*input_);
    }

    std::optional<OIIO::Filesystem::IOMemReader> memory_;
    std::unique_ptr<OIIO::ImageInput> input_;  // ends before what it reads from
};

template <typename... From>
std::unique_ptr<ImageReader> open(std::string& why, From&&... from)
{
    auto reader = std::make_unique<Reader>(std::forward<From>(from)...);
    if (reader->is_open()) return reader;
    why = OIIO::geterror();
    return nullptr;
}

std::unique_ptr<ImageReader> open_file(const std::string& path, std::string& why) { return open(why, path); }

std::unique_ptr<ImageReader> open_memory(const char* name, std::span<const std::uint8_t> bytes, std::string& why)
{
    return open(why, name, bytes);
}

bool reads(const char* format)
{
    const bool found = OIIO::ImageInput::create(format) != nullptr;
    OIIO::geterror();  // cleared
    return found;
}

std::string formats() { return OIIO::get_string_attribute("format_list"); }

}  // namespace
}  // namespace rcs

/// What the library looks for in this file.
extern "C" __attribute__((visibility("default"))) const rcs::ImageModule* rcs_image_module()
{
    static const rcs::ImageModule module{rcs::open_file, rcs::open_memory, rcs::reads, rcs::formats};
    return &module;
}
