#include "rcs/image_io.h"

#include <bit>
#include <chrono>
#include <cmath>
#include <csignal>
#include <limits>
#include <thread>

#include <sys/resource.h>

#include <gtest/gtest.h>

#include "rcs/error.h"
#include "support/temporary_folder.h"

namespace rcs {
namespace {

using test::bytes_of;
using test::TemporaryFolder;

Image ramp(int width, int height, int channels, float scale)
{
    Image image(width, height, channels);
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        image.pixels[i] = scale * static_cast<float>((i * 37) % 101) / 100.0f;
    }
    return image;
}

LayeredImage sample_image()
{
    LayeredImage image;
    image.layers["beauty"] = ramp(37, 150, 4, 3.0f);  // odd width, more rows than one write takes
    image.layers["direct"] = ramp(37, 150, 3, 2.0f);
    image.layers["normal"] = ramp(37, 150, 3, -1.0f);
    image.layers["depth"] = ramp(37, 150, 1, 12345.678f);
    image.layers["depth"].pixels[5] = std::numeric_limits<float>::infinity();
    image.layers["records"] = ramp(37, 150, 1, 100.0f);
    image.metadata["rcs:seed"] = "7";
    image.metadata["rcs:options"] = "rays=256 \"quoted\" \xc3\xa9";
    return image;
}

ErrorCode code_of(const std::function<void()>& action, std::string* message = nullptr)
{
    try {
        action();
    } catch (const Error& e) {
        if (message != nullptr) *message = e.what();
        EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
        return e.code();
    }
    ADD_FAILURE() << "no error";
    return ErrorCode::internal;
}

TEST(Exr, ReturnsAllLayersAndMetadataWithinHalfPrecision)
{
    const TemporaryFolder folder;
    const LayeredImage image = sample_image();
    write_exr(folder / "a.exr", image);
    const LayeredImage back = read_image(folder / "a.exr");

    EXPECT_EQ(back.metadata, image.metadata);
    ASSERT_EQ(back.layers.size(), image.layers.size());
    for (const auto& [name, layer] : image.layers) {
        const Image& read = back.layers.at(name);
        ASSERT_EQ(read.width, layer.width) << name;
        ASSERT_EQ(read.height, layer.height) << name;
        ASSERT_EQ(read.channels, layer.channels) << name;
        for (std::size_t i = 0; i < layer.pixels.size(); ++i) {
            const float expected = layer.pixels[i];
            if (name == "depth") {
                ASSERT_EQ(read.pixels[i], expected) << "depth is stored as float";
            } else {
                // half has 11 significant bits: rounding moves a value by at most 2^-11 of itself
                ASSERT_NEAR(read.pixels[i], expected, std::abs(expected) * 0x1p-11f) << name;
            }
        }
    }
    EXPECT_EQ(folder.names(), std::vector<std::string>{"a.exr"});
}

TEST(Exr, KeepsEveryBitAsFullFloat)
{
    const TemporaryFolder folder;
    ImageFileOptions options;
    options.format = PixelFormat::full_float;
    write_exr(folder / "a.exr", sample_image(), options);
    const LayeredImage back = read_image(folder / "a.exr");
    for (const auto& [name, layer] : sample_image().layers) {
        EXPECT_EQ(back.layers.at(name).pixels, layer.pixels) << name;
    }
}

TEST(Exr, ClampsWhatHalfCannotHoldAndKeepsItFinite)
{
    const TemporaryFolder folder;
    LayeredImage image;
    image.layers["beauty"] = Image(2, 1, 3);
    image.layers["beauty"].pixels = {1e9f, -1e9f, 65504.0f, std::numeric_limits<float>::infinity(), 65519.0f, 1.0f};
    write_exr(folder / "a.exr", image);
    EXPECT_EQ(read_image(folder / "a.exr").layers.at("beauty").pixels,
              (std::vector<float>{65504.0f, -65504.0f, 65504.0f, 65504.0f, 65504.0f, 1.0f}));
}

TEST(Exr, KeepsLayersOfSeveralPartsAsFloatsWithWhatIsSaidOfThem)
{
    const TemporaryFolder folder;
    LayeredImage image = sample_image();
    Image& ids = image.layers["CryptoObject"] = Image(37, 150, 12);
    for (std::size_t i = 0; i < ids.pixels.size(); ++i)
        ids.pixels[i] = std::bit_cast<float>(0x3f800000u + static_cast<std::uint32_t>(i));
    image.layer_metadata["CryptoObject"]["cryptomatte/3ae39a5/name"] = "CryptoObject";
    ImageFileOptions options;
    options.format = PixelFormat::half_float;
    write_exr(folder / "a.exr", image, options);
    EXPECT_EQ(read_image(folder / "a.exr").layers.at("CryptoObject").pixels, ids.pixels) << "every bit";
    const std::string bytes = bytes_of(folder / "a.exr");
    for (const std::string channel : {"CryptoObject00.R", "CryptoObject01.A", "CryptoObject02.B", "cryptomatte/"})
        EXPECT_NE(bytes.find(channel), std::string::npos) << channel;
    options.layers = {"depth"};
    write_exr(folder / "b.exr", image, options);
    EXPECT_EQ(bytes_of(folder / "b.exr").find("cryptomatte/"), std::string::npos) << "what is said of another layer";
}

TEST(Exr, StoresOnlyTheLayersAskedForBesideBeauty)
{
    const TemporaryFolder folder;
    ImageFileOptions options;
    options.layers = {"depth"};
    write_exr(folder / "a.exr", sample_image(), options);
    const LayeredImage back = read_image(folder / "a.exr");
    EXPECT_EQ(back.layers.size(), 2u);
    EXPECT_EQ(back.layers.count("beauty"), 1u);
    EXPECT_EQ(back.layers.count("depth"), 1u);

    options.layers = {"nope"};
    EXPECT_EQ(code_of([&] { write_exr(folder / "b.exr", sample_image(), options); }), ErrorCode::not_found);
}

TEST(ImageFiles, HaveTheSameBytesWheneverTheyAreWritten)
{
    const TemporaryFolder folder;
    const Image display = ramp(40, 30, 3, 1.0f);
    for (const std::string turn : {"a", "b"}) {
        write_exr(folder / (turn + ".exr"), sample_image());
        write_display_image(folder / (turn + ".png"), display);
        write_display_image(folder / (turn + ".jpg"), display);
        // Time stamps inside image files have a resolution of one second.
        std::this_thread::sleep_for(std::chrono::milliseconds(turn == "a" ? 1100 : 0));
    }
    for (const std::string ending : {".exr", ".png", ".jpg"}) {
        EXPECT_EQ(bytes_of(folder / ("a" + ending)), bytes_of(folder / ("b" + ending))) << ending;
    }
}

TEST(Png, HoldsDisplayValuesToHalfAStep)
{
    const TemporaryFolder folder;
    const Image display = ramp(17, 9, 3, 1.0f);
    for (const auto format : {PixelFormat::uint8, PixelFormat::uint16}) {
        ImageFileOptions options;
        options.format = format;
        write_display_image(folder / "a.png", display, options);
        const Image linear = read_image(folder / "a.png").layers.at("beauty");
        ASSERT_EQ(linear.channels, 3);
        const float step = format == PixelFormat::uint8 ? 1.0f / 255.0f : 1.0f / 65535.0f;
        for (std::size_t i = 0; i < display.pixels.size(); ++i) {
            const float v = linear.pixels[i];  // decoded; encoded again here by the standard's formula
            const float encoded = v <= 0.0031308f ? 12.92f * v : 1.055f * std::pow(v, 1.0f / 2.4f) - 0.055f;
            // half a step of the file, and a few roundings of the curve and its inverse
            ASSERT_NEAR(encoded, display.pixels[i], 0.5f * step + 2e-6f);
        }
    }
}

TEST(Png, KeepsAlphaLinear)
{
    const TemporaryFolder folder;
    Image display(1, 1, 4);
    display.pixels = {1.0f, 1.0f, 1.0f, 0.2f};
    write_display_image(folder / "a.png", display);
    // The values are unassociated in a PNG; reading associates them or not, alpha stays 51/255.
    EXPECT_NEAR(read_image(folder / "a.png").layers.at("beauty").pixels[3], 0.2f, 1e-6f);
}

TEST(Png, DividesColoursByAlphaAndCannotGoBeyondTheLargestCode)
{
    const TemporaryFolder folder;
    Image display(2, 1, 4);
    display.pixels = {0.3f, 0.05f, 0.0f, 0.3f, 0.5f, std::numeric_limits<float>::quiet_NaN(), -1.0f, 0.0f};
    write_display_image(folder / "a.png", display);
    const std::string bytes = bytes_of(folder / "a.png");
    EXPECT_EQ(static_cast<int>(bytes[24]), 8) << "bits";
    EXPECT_EQ(static_cast<int>(bytes[25]), 6) << "RGBA";
    const std::vector<float> read = read_image(folder / "a.png").layers.at("beauty").pixels;
    // Reading multiplies by alpha again, of codes.
    const float alpha = 77.0f / 255.0f;
    EXPECT_FLOAT_EQ(read[3], alpha);
    EXPECT_GT(read[0], 0.05f);
    EXPECT_EQ(read[2], 0.0f);
    for (std::size_t i = 4; i < 8; ++i) EXPECT_EQ(read[i], 0.0f) << i;
}

TEST(Jpeg, ResemblesThePicture)
{
    const TemporaryFolder folder;
    Image display(32, 32, 3);
    for (int y = 0; y < 32; ++y) {
        for (int x = 0; x < 32; ++x) {
            display.at(x, y)[0] = static_cast<float>(x) / 31.0f;
            display.at(x, y)[1] = display.at(x, y)[2] = 0.5f;
        }
    }
    write_display_image(folder / "a.jpg", display);
    const Image back = read_image(folder / "a.jpg").layers.at("beauty");
    EXPECT_NEAR(back.at(0, 16)[0], 0.0f, 0.02f);
    EXPECT_NEAR(back.at(31, 16)[0], 1.0f, 0.06f);
    EXPECT_NEAR(back.at(16, 16)[1], 0.2140f, 0.02f);  // 0.5 decoded
}

TEST(OutputPath, IsCheckedBeforeAnythingIsRendered)
{
    const TemporaryFolder folder;
    const ImageFileOptions options;
    EXPECT_NO_THROW(check_output_path(folder / "a.exr", options));
    EXPECT_NO_THROW(check_output_path(folder / "A.PNG", options));
    EXPECT_EQ(code_of([&] { check_output_path(folder / "a.gif", options); }), ErrorCode::bad_argument);
    EXPECT_EQ(code_of([&] { check_output_path(folder / "nowhere/a.png", options); }), ErrorCode::io);
    EXPECT_EQ(code_of([&] { check_output_path("/proc/a.png", options); }), ErrorCode::io);
    std::filesystem::create_directory(folder / "dir.png");
    std::string message;
    EXPECT_EQ(code_of([&] { check_output_path(folder / "dir.png", options); }, &message), ErrorCode::io);
    EXPECT_NE(message.find("dir.png"), std::string::npos) << message;

    ImageFileOptions wrong;
    wrong.format = PixelFormat::uint8;
    EXPECT_EQ(code_of([&] { check_output_path(folder / "a.exr", wrong); }), ErrorCode::bad_argument);
    wrong.format = PixelFormat::half_float;
    EXPECT_EQ(code_of([&] { check_output_path(folder / "a.png", wrong); }), ErrorCode::bad_argument);
    EXPECT_EQ(folder.names(), std::vector<std::string>{"dir.png"}) << "checking leaves nothing behind";
}

TEST(OutputPath, FollowsASymbolicLinkToTheFileBehindIt)
{
    const TemporaryFolder folder;
    std::filesystem::create_symlink("real.png", folder / "link.png");
    write_display_image(folder / "link.png", ramp(4, 4, 3, 1.0f));
    EXPECT_TRUE(std::filesystem::is_symlink(folder / "link.png"));
    EXPECT_TRUE(std::filesystem::is_regular_file(folder / "real.png"));
}

/// As on a full disk: no file of this process may grow past `bytes` while this lives.
class FileSizeLimit {
public:
    explicit FileSizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN))
    {
        getrlimit(RLIMIT_FSIZE, &before_);
        const rlimit limit{bytes, before_.rlim_max};
        setrlimit(RLIMIT_FSIZE, &limit);
    }
    ~FileSizeLimit()
    {
        setrlimit(RLIMIT_FSIZE, &before_);
        std::signal(SIGXFSZ, handler_);
    }

private:
    rlimit before_{};
    void (*handler_)(int);
};

TEST(ImageFiles, ReportAFullDiskAndLeaveNoPieceBehind)
{
    const TemporaryFolder folder;
    const Image display = ramp(300, 300, 3, 1.0f);
    LayeredImage image;
    image.layers["beauty"] = display;
    // 100 bytes stop the first write; a few thousand let the headers through.
    for (const rlim_t limit : {100u, 4096u}) {
        const FileSizeLimit full(limit);
        EXPECT_EQ(code_of([&] { write_exr(folder / "a.exr", image); }), ErrorCode::io);
        EXPECT_EQ(code_of([&] { write_display_image(folder / "a.png", display); }), ErrorCode::io);
        EXPECT_EQ(code_of([&] { write_display_image(folder / "a.jpg", display); }), ErrorCode::io);
        EXPECT_TRUE(folder.names().empty());
    }
}

TEST(ImageFiles, KeepTheOldFileWhenWritingFails)
{
    const TemporaryFolder folder;
    write_display_image(folder / "a.png", ramp(8, 8, 3, 1.0f));
    const std::string before = bytes_of(folder / "a.png");
    {
        const FileSizeLimit full(100);
        EXPECT_EQ(code_of([&] { write_display_image(folder / "a.png", ramp(300, 300, 3, 1.0f)); }), ErrorCode::io);
    }
    EXPECT_EQ(bytes_of(folder / "a.png"), before);
}

TEST(ImageFiles, RefuseWhatIsNoImage)
{
    const TemporaryFolder folder;
    EXPECT_EQ(code_of([&] { read_image(folder / "missing.exr"); }), ErrorCode::not_found);
    EXPECT_EQ(code_of([&] { read_image(folder.path()); }), ErrorCode::bad_file);
    test::write_bytes(folder / "text.exr", "this is no image");
    std::string message;
    EXPECT_EQ(code_of([&] { read_image(folder / "text.exr"); }, &message), ErrorCode::bad_file);
    EXPECT_NE(message.find("text.exr"), std::string::npos) << message;

    write_exr(folder / "whole.exr", sample_image());
    const std::string whole = bytes_of(folder / "whole.exr");
    test::write_bytes(folder / "half.exr", whole.substr(0, whole.size() / 2));
    EXPECT_EQ(code_of([&] { read_image(folder / "half.exr"); }), ErrorCode::bad_file);

    LayeredImage image = sample_image();
    image.layers["direct"].pixels.pop_back();
    EXPECT_EQ(code_of([&] { write_exr(folder / "b.exr", image); }), ErrorCode::bad_argument);
    image.layers["direct"] = ramp(3, 3, 3, 1.0f);
    EXPECT_EQ(code_of([&] { write_exr(folder / "b.exr", image); }), ErrorCode::bad_argument);
    image.layers.clear();
    EXPECT_EQ(code_of([&] { write_exr(folder / "b.exr", image); }), ErrorCode::bad_argument);
}

TEST(DisplayImage, InMemoryIsWhatAFileWouldHold)
{
    const TemporaryFolder folder;
    const Image display = ramp(37, 21, 3, 1.0f);
    for (const std::string name : {"a.png", "a.jpg"}) {
        ImageFileOptions options;
        options.jpeg_quality = 70;
        write_display_image(folder / name, display, options);
        const std::string bytes = display_image_bytes(name, display, options);
        EXPECT_GT(bytes.size(), 100u);
        EXPECT_EQ(bytes, bytes_of(folder / name)) << name;
    }
    EXPECT_EQ(code_of([&] { display_image_bytes("a.exr", display); }), ErrorCode::bad_argument);
    EXPECT_EQ(code_of([&] { display_image_bytes("a.png", Image(4, 4, 5)); }), ErrorCode::bad_argument);
}

}  // namespace
}  // namespace rcs
