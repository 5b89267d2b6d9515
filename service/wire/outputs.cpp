#include "wire/outputs.h"

#include <string>

#include "rcs/error.h"
#include "wire/limits.h"

namespace rcs::service {
namespace {

[[noreturn]] void refuse_output(const std::string& what) { throw Error(ErrorCode::bad_argument, what); }

v1::PixelFormat to_wire(PixelFormat format)
{
    switch (format) {
        case PixelFormat::automatic:
            return v1::PIXEL_FORMAT_AUTOMATIC;
        case PixelFormat::half_float:
            return v1::PIXEL_FORMAT_HALF;
        case PixelFormat::full_float:
            return v1::PIXEL_FORMAT_FLOAT;
        case PixelFormat::uint8:
            return v1::PIXEL_FORMAT_UINT8;
        case PixelFormat::uint16:
            return v1::PIXEL_FORMAT_UINT16;
    }
    return v1::PIXEL_FORMAT_AUTOMATIC;
}

PixelFormat from_wire(v1::PixelFormat format)
{
    switch (format) {
        case v1::PIXEL_FORMAT_AUTOMATIC:
            return PixelFormat::automatic;
        case v1::PIXEL_FORMAT_HALF:
            return PixelFormat::half_float;
        case v1::PIXEL_FORMAT_FLOAT:
            return PixelFormat::full_float;
        case v1::PIXEL_FORMAT_UINT8:
            return PixelFormat::uint8;
        case v1::PIXEL_FORMAT_UINT16:
            return PixelFormat::uint16;
        default:
            refuse_output("pixel_format is " + std::to_string(format) + ", expected a value in [0, 4]");
    }
}

}  // namespace

v1::ToneMap to_message(const ToneMapOptions& o)
{
    const auto& [ocio_config, display, view, exposure, one_file_only] = o;
    static_cast<void>(ocio_config), static_cast<void>(one_file_only);
    v1::ToneMap m;
    if (exposure) m.set_exposure(*exposure);
    m.set_display(display);
    m.set_view(view);
    return m;
}

ToneMapOptions from_message(const v1::ToneMap& m)
{
    ToneMapOptions o;
    if (m.has_exposure()) {
        check_number("exposure", m.exposure(), kExposures);
        o.exposure = m.exposure();
    }
    o.display = m.display();
    o.view = m.view();
    return o;
}

v1::Output to_message(const OutputFile& file)
{
    const auto& [format, jpeg_quality, layers] = file.options;
    v1::Output m;
    m.set_name(file.path);
    m.set_pixel_format(to_wire(format));
    m.set_jpeg_quality(jpeg_quality);
    for (const std::string& layer : layers) m.add_layers(layer);
    return m;
}

OutputFile from_message(const v1::Output& m)
{
    OutputFile file{m.name(), {}};
    file.options.format = from_wire(m.pixel_format());
    if (m.has_jpeg_quality()) file.options.jpeg_quality = m.jpeg_quality();
    file.options.layers.assign(m.layers().begin(), m.layers().end());
    return file;
}

}  // namespace rcs::service
