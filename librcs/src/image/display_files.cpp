#include "image/display_files.h"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <csetjmp>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <vector>

#include <jpeglib.h>
#include <png.h>

#include "rcs/error.h"
#include "util/one_line.h"

namespace rcs {
namespace {

[[noreturn]] void fail_write(const std::string& path, const char* why)
{
    throw Error(ErrorCode::io, "cannot write '" + path + "': " + one_line(why));
}

/// The nearest of the codes 0 to `most`; NaN is dark.
template <typename Code>
Code code_of(float value, float most)
{
    return value > 0.0f ? static_cast<Code>(std::min(value, 1.0f) * most + 0.5f) : Code{0};
}

/// The codes of an image's first channels, row by row. Where its last channel is alpha, and stored, colours are no
/// longer multiplied by it.
template <typename Code>
std::vector<Code> codes_of(const Image& image, int channels, float most)
{
    const auto of_pixel = static_cast<std::size_t>(image.channels), stored = static_cast<std::size_t>(channels);
    const bool has_alpha = channels % 2 == 0;
    std::vector<Code> codes;
    codes.reserve(image.pixels.size() / of_pixel * stored);
    for (std::size_t i = 0; i < image.pixels.size(); i += of_pixel) {
        const float* const pixel = image.pixels.data() + i;
        const float alpha = has_alpha ? pixel[stored - 1] : 1.0f;
        const float scale = alpha > 0.0f && alpha < 1.0f ? 1.0f / alpha : 1.0f;
        for (std::size_t c = 0; c < stored; ++c)
            codes.push_back(code_of<Code>(has_alpha && c + 1 == stored ? alpha : pixel[c] * scale, most));
    }
    return codes;
}

// Both libraries leave by longjmp: what they write with lies outside of the function that it comes back to, and nothing
// in that has a destructor.

struct PngWrite {
    png_structp png = nullptr;
    png_infop info = nullptr;
    std::jmp_buf leave;
    char why[256] = {};
};

void png_failed(png_structp png, png_const_charp why)
{
    auto* const write = static_cast<PngWrite*>(png_get_error_ptr(png));
    std::strncpy(write->why, why, sizeof write->why - 1);
    std::longjmp(write->leave, 1);
}

void ignore_warning(png_structp, png_const_charp) {}

void write_to_file(png_structp png, png_bytep bytes, std::size_t count)
{
    if (std::fwrite(bytes, 1, count, static_cast<std::FILE*>(png_get_io_ptr(png))) != count)
        png_error(png, std::strerror(errno));
}

void flush_nothing(png_structp) {}  // the writer does

void write_png(PngWrite& write, std::FILE* file, const Image& image, bool wide, png_bytep codes)
{
    constexpr int kColors[] = {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB,
                               PNG_COLOR_TYPE_RGB_ALPHA};
    write.png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &write, png_failed, ignore_warning);
    if (write.png) write.info = png_create_info_struct(write.png);
    if (!write.info) return;
    png_set_write_fn(write.png, file, write_to_file, flush_nothing);
    png_set_compression_level(write.png, 2);  // of 9: five times as fast as 6, a tenth larger
    png_set_IHDR(write.png, write.info, static_cast<png_uint_32>(image.width), static_cast<png_uint_32>(image.height),
                 wide ? 16 : 8, kColors[image.channels - 1], PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    png_write_info(write.png, write.info);
    if (wide && std::endian::native == std::endian::little) png_set_swap(write.png);
    const std::size_t row =
        static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.channels) * (wide ? 2 : 1);
    for (int y = 0; y < image.height; ++y) png_write_row(write.png, codes + static_cast<std::size_t>(y) * row);
    png_write_end(write.png, nullptr);
}

/// @param codes  row by row   @return whether it went well
bool encode_png(PngWrite& write, std::FILE* file, const Image& image, bool wide, png_bytep codes)
{
    if (setjmp(write.leave) == 0) write_png(write, file, image, wide, codes);
    png_destroy_write_struct(&write.png, &write.info);
    return write.why[0] == '\0';
}

struct JpegWrite {
    jpeg_error_mgr errors{};
    jpeg_compress_struct jpeg{};
    unsigned char* bytes = nullptr;  // the file
    unsigned long count = 0;
    std::jmp_buf leave;
    char why[JMSG_LENGTH_MAX] = {};

    JpegWrite() = default;
    ~JpegWrite() { std::free(bytes); }
    JpegWrite(const JpegWrite&) = delete;
};

void jpeg_failed(j_common_ptr jpeg)
{
    auto* const write = static_cast<JpegWrite*>(jpeg->client_data);
    jpeg->err->format_message(jpeg, write->why);
    std::longjmp(write->leave, 1);
}

void write_jpeg(JpegWrite& write, const Image& image, int channels, int quality, JSAMPLE* codes)
{
    jpeg_compress_struct& jpeg = write.jpeg;
    jpeg_create_compress(&jpeg);
    jpeg_mem_dest(&jpeg, &write.bytes, &write.count);
    jpeg.image_width = static_cast<JDIMENSION>(image.width);
    jpeg.image_height = static_cast<JDIMENSION>(image.height);
    jpeg.input_components = channels;
    jpeg.in_color_space = channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, quality, TRUE);
    for (int c = 0; c < jpeg.num_components; ++c)  // coloured edges stay sharp
        jpeg.comp_info[c].h_samp_factor = jpeg.comp_info[c].v_samp_factor = 1;
    jpeg_start_compress(&jpeg, TRUE);
    const std::size_t row = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(channels);
    while (jpeg.next_scanline < jpeg.image_height) {
        JSAMPROW next = codes + jpeg.next_scanline * row;
        jpeg_write_scanlines(&jpeg, &next, 1);
    }
    jpeg_finish_compress(&jpeg);
}

/// @param codes  of one channel or three   @return whether it went well
bool encode_jpeg(JpegWrite& write, const Image& image, int channels, int quality, JSAMPLE* codes)
{
    write.jpeg.err = jpeg_std_error(&write.errors);
    write.jpeg.client_data = &write;
    write.errors.error_exit = jpeg_failed;
    if (setjmp(write.leave) == 0) write_jpeg(write, image, channels, quality, codes);
    jpeg_destroy_compress(&write.jpeg);
    return write.why[0] == '\0';
}

}  // namespace

void write_png_file(std::FILE* file, const std::string& path, const Image& display, bool wide)
{
    PngWrite write;
    bool written = false;
    if (wide) {
        std::vector<std::uint16_t> codes = codes_of<std::uint16_t>(display, display.channels, 65535.0f);
        written = encode_png(write, file, display, true, reinterpret_cast<png_bytep>(codes.data()));
    } else {
        std::vector<std::uint8_t> codes = codes_of<std::uint8_t>(display, display.channels, 255.0f);
        written = encode_png(write, file, display, false, codes.data());
    }
    if (!written) fail_write(path, write.why);
}

void write_jpeg_file(std::FILE* file, const std::string& path, const Image& display, int quality)
{
    const int channels = display.channels >= 3 ? 3 : 1;
    std::vector<std::uint8_t> codes = codes_of<std::uint8_t>(display, channels, 255.0f);
    JpegWrite write;
    if (!encode_jpeg(write, display, channels, quality, codes.data())) fail_write(path, write.why);
    if (std::fwrite(write.bytes, 1, write.count, file) != write.count) fail_write(path, std::strerror(errno));
}

}  // namespace rcs
