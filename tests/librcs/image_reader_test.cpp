#include "image/image_reader.h"

#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include <jpeglib.h>
#include <png.h>

#include <gtest/gtest.h>

namespace rcs {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr int kWidth = 11, kHeight = 9;

struct PngKind {
    const char* name;
    int bits, color, interlace;
    bool transparent = false;  // one colour is, by a tRNS chunk
};

Bytes png_file(const PngKind& kind)
{
    Bytes file;
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png_create_info_struct(png);
    png_set_write_fn(
        png, &file,
        [](png_structp p, png_bytep bytes, std::size_t count) {
            auto* const to = static_cast<Bytes*>(png_get_io_ptr(p));
            to->insert(to->end(), bytes, bytes + count);
        },
        nullptr);
    png_set_IHDR(png, info, kWidth, kHeight, kind.bits, kind.color, kind.interlace, 0, 0);
    png_color palette[4] = {{1, 2, 3}, {250, 40, 9}, {7, 200, 100}, {90, 91, 255}};
    png_byte alphas[4] = {255, 0, 128, 30};
    png_color_16 clear{0, 7, 8, 9, 1};
    if (kind.color == PNG_COLOR_TYPE_PALETTE) png_set_PLTE(png, info, palette, 4);
    if (kind.transparent) png_set_tRNS(png, info, alphas, 4, &clear);
    png_write_info(png, info);
    const std::size_t row_bytes = png_get_rowbytes(png, info);
    Bytes samples(row_bytes * kHeight);
    for (std::size_t i = 0; i < samples.size(); ++i)
        samples[i] = static_cast<std::uint8_t>(kind.bits < 8 ? 0x1b ^ (i % 5) : 3 * i * i + 7);
    std::vector<png_bytep> rows;
    for (std::size_t y = 0; y < kHeight; ++y) rows.push_back(samples.data() + y * row_bytes);
    png_write_image(png, rows.data());
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
    return file;
}

Bytes jpeg_file(int components, J_COLOR_SPACE space)
{
    jpeg_compress_struct jpeg{};
    jpeg_error_mgr errors{};
    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_compress(&jpeg);
    unsigned char* bytes = nullptr;
    unsigned long count = 0;
    jpeg_mem_dest(&jpeg, &bytes, &count);
    jpeg.image_width = kWidth;
    jpeg.image_height = kHeight;
    jpeg.input_components = components;
    jpeg.in_color_space = space;
    jpeg_set_defaults(&jpeg);
    jpeg_start_compress(&jpeg, TRUE);
    Bytes row(static_cast<std::size_t>(kWidth * components));
    while (jpeg.next_scanline < jpeg.image_height) {
        for (std::size_t i = 0; i < row.size(); ++i)
            row[i] = static_cast<std::uint8_t>(20 * jpeg.next_scanline + 9 * i + 31 * (i % 3));
        JSAMPROW next = row.data();
        jpeg_write_scanlines(&jpeg, &next, 1);
    }
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    const Bytes file(bytes, bytes + count);
    std::free(bytes);
    return file;
}

template <typename Sample>
std::vector<Sample> all_samples(ImageReader& reader, SampleType type)
{
    std::vector<Sample> samples(reader.spec().texels() * static_cast<std::size_t>(reader.spec().channels));
    EXPECT_TRUE(reader.read_rows(0, reader.spec().height, reader.spec().channels, type, samples.data()))
        << reader.error();
    return samples;
}

/// Both read the same, of any type.
void expect_what_the_module_reads(const Bytes& file, const char* name)
{
    for (const SampleType type : {SampleType::uint8, SampleType::uint16, SampleType::real}) {
        std::string why;
        const auto own = open_image(file, why), others = image_module().open_memory(name, file, why);
        ASSERT_TRUE(own && others) << why;
        EXPECT_EQ(own->spec().width, kWidth);
        EXPECT_EQ(own->spec().height, kHeight);
        ASSERT_EQ(own->spec().channels, others->spec().channels);
        EXPECT_EQ(own->spec().type, others->spec().type);
        EXPECT_EQ(own->spec().format, others->spec().format);
        if (type == SampleType::real) {
            const auto a = all_samples<float>(*own, type), b = all_samples<float>(*others, type);
            for (std::size_t i = 0; i < a.size(); ++i) ASSERT_FLOAT_EQ(a[i], b[i]);
        } else if (type == SampleType::uint16) {
            EXPECT_EQ(all_samples<std::uint16_t>(*own, type), all_samples<std::uint16_t>(*others, type));
        } else if (own->spec().type == SampleType::uint8) {
            EXPECT_EQ(all_samples<std::uint8_t>(*own, type), all_samples<std::uint8_t>(*others, type));
        }
    }
}

/// Reads a file to its end. @return why it could not, or nothing
std::string why_not(const Bytes& file)
{
    std::string why;
    const auto reader = open_image(file, why);
    if (!reader) return why;
    std::vector<float> samples(reader->spec().texels() * static_cast<std::size_t>(reader->spec().channels));
    return reader->read_rows(0, reader->spec().height, reader->spec().channels, SampleType::real, samples.data())
               ? ""
               : reader->error();
}

TEST(ImageReader, ReadsEveryKindOfPngAsTheModuleDoes)
{
    for (const int interlace : {PNG_INTERLACE_NONE, PNG_INTERLACE_ADAM7})
        for (const PngKind& kind : {PngKind{"grey of 1 bit", 1, PNG_COLOR_TYPE_GRAY, interlace},
                                    {"grey of 4 bits", 4, PNG_COLOR_TYPE_GRAY, interlace},
                                    {"grey", 8, PNG_COLOR_TYPE_GRAY, interlace},
                                    {"grey of 16 bits", 16, PNG_COLOR_TYPE_GRAY, interlace},
                                    {"palette of 2 bits", 2, PNG_COLOR_TYPE_PALETTE, interlace},
                                    {"palette with alpha", 2, PNG_COLOR_TYPE_PALETTE, interlace, true},
                                    {"grey with alpha", 8, PNG_COLOR_TYPE_GRAY_ALPHA, interlace},
                                    {"RGB", 8, PNG_COLOR_TYPE_RGB, interlace},
                                    {"RGB with a clear colour", 8, PNG_COLOR_TYPE_RGB, interlace, true},
                                    {"RGB of 16 bits", 16, PNG_COLOR_TYPE_RGB, interlace},
                                    {"RGBA", 8, PNG_COLOR_TYPE_RGB_ALPHA, interlace},
                                    {"RGBA of 16 bits", 16, PNG_COLOR_TYPE_RGB_ALPHA, interlace}}) {
            SCOPED_TRACE(kind.name);
            expect_what_the_module_reads(png_file(kind), "image.png");
        }
}

TEST(ImageReader, ReadsEveryKindOfJpegAsTheModuleDoes)
{
    expect_what_the_module_reads(jpeg_file(3, JCS_RGB), "image.jpg");
    expect_what_the_module_reads(jpeg_file(1, JCS_GRAYSCALE), "image.jpg");
    expect_what_the_module_reads(jpeg_file(4, JCS_CMYK), "image.jpg");
}

TEST(ImageReader, SaysWhyAFileThatIsCutShortOrDamagedCannotBeRead)
{
    for (const Bytes& whole :
         {png_file({"", 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE}),
          png_file({"", 16, PNG_COLOR_TYPE_RGB_ALPHA, PNG_INTERLACE_ADAM7}), jpeg_file(3, JCS_RGB)}) {
        EXPECT_EQ(why_not(whole), "");
        // The last bytes of a PNG say only that it ends.
        for (std::size_t count = 4; count + 16 < whole.size(); ++count)
            EXPECT_NE(why_not({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(count)}), "") << count;
        for (std::size_t i = 4; i < whole.size(); ++i) {
            Bytes damaged = whole;
            damaged[i] ^= 0x55;
            why_not(damaged);  // whatever it says: nothing crashes
        }
    }
    std::string why = "not cleared";
    EXPECT_FALSE(open_image(Bytes{'t', 'e', 'x', 't', '.'}, why));
    EXPECT_EQ(why, "");
}

}  // namespace
}  // namespace rcs
