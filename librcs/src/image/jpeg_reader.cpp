#include <csetjmp>
#include <cstdio>
#include <cstring>

#include <jpeglib.h>

#include <jerror.h>

#include "image/common_files.h"
#include "image/row_reader.h"

namespace rcs {
namespace {

/// What libjpeg works with. It leaves by longjmp, back into functions in which nothing has a destructor.
struct JpegRead {
    jpeg_error_mgr errors{};
    jpeg_decompress_struct jpeg{};
    std::jmp_buf leave;
    char why[JMSG_LENGTH_MAX] = {};

    JpegRead() = default;
    JpegRead(const JpegRead&) = delete;
    ~JpegRead() { jpeg_destroy_decompress(&jpeg); }
};

void failed(j_common_ptr jpeg)
{
    auto* const read = static_cast<JpegRead*>(jpeg->client_data);
    jpeg->err->format_message(jpeg, read->why);
    std::longjmp(read->leave, 1);
}

/// Of warnings only one that says that the rest is missing matters.
void warned(j_common_ptr jpeg, int level)
{
    if (level < 0 && jpeg->err->msg_code == JWRN_JPEG_EOF) failed(jpeg);
}

void begin(JpegRead& read, std::span<const std::uint8_t> bytes)
{
    jpeg_create_decompress(&read.jpeg);
    jpeg_mem_src(&read.jpeg, bytes.data(), bytes.size());
    jpeg_read_header(&read.jpeg, TRUE);
}

bool try_begin(JpegRead& read, std::span<const std::uint8_t> bytes)
{
    read.jpeg.err = jpeg_std_error(&read.errors);
    read.jpeg.client_data = &read;
    read.errors.error_exit = failed;
    read.errors.emit_message = warned;
    if (setjmp(read.leave) == 0) begin(read, bytes);
    return read.why[0] == '\0';
}

bool try_decode(JpegRead& read, JSAMPROW row, bool first)
{
    if (setjmp(read.leave) == 0) {
        if (first) jpeg_start_decompress(&read.jpeg);
        jpeg_read_scanlines(&read.jpeg, &row, 1);
    }
    return read.why[0] == '\0';
}

class JpegReader : public RowReader {
public:
    /// @return whether it is one of grey or RGB
    bool open(std::span<const std::uint8_t> bytes)
    {
        if (!try_begin(read_, bytes)) {
            why_ = read_.why;
            return false;
        }
        jpeg_decompress_struct& jpeg = read_.jpeg;
        if (jpeg.jpeg_color_space != JCS_GRAYSCALE && jpeg.jpeg_color_space != JCS_YCbCr &&
            jpeg.jpeg_color_space != JCS_RGB)
            return false;
        spec_.format = "jpeg";
        spec_.width = static_cast<int>(jpeg.image_width);
        spec_.height = static_cast<int>(jpeg.image_height);
        spec_.channels = jpeg.jpeg_color_space == JCS_GRAYSCALE ? 1 : 3;
        spec_.type = SampleType::uint8;
        jpeg.out_color_space = spec_.channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
        return true;
    }

private:
    const std::uint8_t* decode_next() override
    {
        const bool first = row_.empty();
        if (first) row_.resize(static_cast<std::size_t>(spec_.width) * static_cast<std::size_t>(spec_.channels));
        if (try_decode(read_, row_.data(), first)) return row_.data();
        why_ = read_.why;
        return nullptr;
    }

    JpegRead read_;
    std::vector<std::uint8_t> row_;
};

}  // namespace

bool is_jpeg(std::span<const std::uint8_t> bytes)
{
    return bytes.size() >= 3 && bytes[0] == 0xff && bytes[1] == 0xd8 && bytes[2] == 0xff;
}

std::unique_ptr<ImageReader> open_jpeg(std::span<const std::uint8_t> bytes, std::string& why)
{
    auto reader = std::make_unique<JpegReader>();
    if (reader->open(bytes)) return reader;
    why = reader->error();
    return nullptr;
}

}  // namespace rcs
