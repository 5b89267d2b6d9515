#include <algorithm>
#include <bit>
#include <csetjmp>
#include <cstring>

#include <png.h>

#include "image/common_files.h"
#include "image/row_reader.h"

namespace rcs {
namespace {

/// What libpng works with. It leaves by longjmp, back into functions in which nothing has a destructor.
struct PngRead {
    png_structp png = nullptr;
    png_infop info = nullptr;
    std::span<const std::uint8_t> rest;
    std::jmp_buf leave;
    char why[256] = {};

    PngRead() = default;
    PngRead(const PngRead&) = delete;
    ~PngRead() { png_destroy_read_struct(&png, &info, nullptr); }
};

void failed(png_structp png, png_const_charp why)
{
    auto* const read = static_cast<PngRead*>(png_get_error_ptr(png));
    std::strncpy(read->why, why, sizeof read->why - 1);
    std::longjmp(read->leave, 1);
}

void read_on(png_structp, png_const_charp) {}

void take_bytes(png_structp png, png_bytep to, std::size_t count)
{
    auto* const read = static_cast<PngRead*>(png_get_io_ptr(png));
    if (count > read->rest.size()) png_error(png, "the file is cut short");
    std::copy_n(read->rest.data(), count, to);
    read->rest = read->rest.subspan(count);
}

/// Up to the first row: samples become 8 or 16 bits of grey or RGB, with or without alpha.
void begin(PngRead& read)
{
    read.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &read, failed, read_on);
    if (read.png) read.info = png_create_info_struct(read.png);
    if (!read.info) return;
    png_set_read_fn(read.png, &read, take_bytes);
    png_read_info(read.png, read.info);
    png_set_expand(read.png);
    if (std::endian::native == std::endian::little) png_set_swap(read.png);
}

bool try_begin(PngRead& read)
{
    if (setjmp(read.leave) == 0) begin(read);
    return read.info && read.why[0] == '\0';
}

/// @param rows  room for one row; for all of them where rows are interlaced
bool try_decode(PngRead& read, png_bytepp rows, bool interlaced)
{
    if (setjmp(read.leave) == 0) {
        if (interlaced)
            png_read_image(read.png, rows);
        else
            png_read_row(read.png, *rows, nullptr);
    }
    return read.why[0] == '\0';
}

bool try_update(PngRead& read)
{
    if (setjmp(read.leave) == 0) {
        png_set_interlace_handling(read.png);
        png_read_update_info(read.png, read.info);
    }
    return read.why[0] == '\0';
}

class PngReader : public RowReader {
public:
    /// @return whether it is one
    bool open(std::span<const std::uint8_t> bytes)
    {
        read_.rest = bytes;
        if (!try_begin(read_) || !try_update(read_)) {
            why_ = read_.why;
            return false;
        }
        spec_.format = "png";
        spec_.width = static_cast<int>(png_get_image_width(read_.png, read_.info));
        spec_.height = static_cast<int>(png_get_image_height(read_.png, read_.info));
        spec_.channels = png_get_channels(read_.png, read_.info);
        spec_.type = png_get_bit_depth(read_.png, read_.info) == 16 ? SampleType::uint16 : SampleType::uint8;
        spec_.alpha_apart = true;
        interlaced_ = png_get_interlace_type(read_.png, read_.info) != PNG_INTERLACE_NONE;
        return true;
    }

private:
    const std::uint8_t* decode_next() override
    {
        const std::size_t row_bytes = png_get_rowbytes(read_.png, read_.info);
        const bool first = rows_.empty();
        if (first) {
            samples_.resize(row_bytes * (interlaced_ ? static_cast<std::size_t>(spec_.height) : 1));
            for (std::size_t at = 0; at < samples_.size(); at += row_bytes) rows_.push_back(samples_.data() + at);
        }
        if ((first || !interlaced_) && !try_decode(read_, rows_.data(), interlaced_)) {
            why_ = read_.why;
            return nullptr;
        }
        return rows_[interlaced_ ? row_++ : 0];
    }

    PngRead read_;
    bool interlaced_ = false;
    std::vector<std::uint8_t> samples_;
    std::vector<png_bytep> rows_;
    std::size_t row_ = 0;
};

}  // namespace

bool is_png(std::span<const std::uint8_t> bytes)
{
    constexpr std::uint8_t kMagic[] = {0x89, 'P', 'N', 'G'};
    return bytes.size() >= sizeof kMagic && std::memcmp(bytes.data(), kMagic, sizeof kMagic) == 0;
}

std::unique_ptr<ImageReader> open_png(std::span<const std::uint8_t> bytes, std::string& why)
{
    auto reader = std::make_unique<PngReader>();
    if (reader->open(bytes)) return reader;
    why = reader->error();
    return nullptr;
}

}  // namespace rcs
