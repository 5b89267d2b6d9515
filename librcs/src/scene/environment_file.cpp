#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include "image/image_reader.h"
#include "rcs/error.h"
#include "rcs/scene.h"
#include "util/one_line.h"
#include "util/srgb.h"

namespace rcs {
namespace {

/// Beyond: taken for damage, or too much for memory (768 MiB of radiance).
constexpr int kMaxSkySide = 32768;
constexpr std::int64_t kMaxSkyTexels = std::int64_t{1} << 26;

/// Rows read at a time, to keep what is beside the image small.
constexpr int kRows = 64;

[[noreturn]] void fail(const std::string& path, const std::string& why)
{
    throw Error(ErrorCode::bad_file, "cannot read environment image '" + path + "': " + one_line(why));
}

void check_size(const std::string& path, const ImageFileSpec& spec)
{
    const std::int64_t texels = static_cast<std::int64_t>(spec.width) * spec.height;
    if (spec.width >= 1 && spec.height >= 1 && spec.width <= kMaxSkySide && spec.height <= kMaxSkySide &&
        texels <= kMaxSkyTexels && spec.depth <= 1 && spec.channels >= 1 && spec.channels <= 64)
        return;
    fail(path, "it has " + std::to_string(spec.width) + " x " + std::to_string(spec.height) + " texels of " +
                   std::to_string(spec.channels) + " channels, expected sides in [1, " + std::to_string(kMaxSkySide) +
                   "] and at most " + std::to_string(kMaxSkyTexels) + " texels");
}

/// Which three channels are red, green and blue: those with the names, else the first three; one alone is grey.
struct Channels {
    int red = 0, green = 0, blue = 0;
};
Channels find_channels(const ImageFileSpec& spec)
{
    const int r = spec.channel("R"), g = spec.channel("G"), b = spec.channel("B");
    if (r >= 0 && g >= 0 && b >= 0) return {r, g, b};
    return spec.channels >= 3 ? Channels{0, 1, 2} : Channels{0, 0, 0};
}

/// Light that is no number or negative is none; what overflowed is as bright as a half float can be.
struct Repair {
    std::size_t count = 0, texels = 0;

    float operator()(float value)
    {
        constexpr float kLargestHalf = 65504.0f;
        ++texels;
        if (value >= 0.0f && std::isfinite(value)) return value;
        ++count;
        return value > 0.0f ? kLargestHalf : 0.0f;
    }
};

}  // namespace

EnvironmentImage load_environment(const std::string& path, const LogFunction& log)
{
    std::error_code ignored;
    if (!std::filesystem::exists(path, ignored))
        throw Error(ErrorCode::not_found, "environment image '" + path + "' does not exist");
    std::string why;
    const std::unique_ptr<ImageReader> input = open_image(path, why);
    if (!input) fail(path, why);
    const ImageFileSpec& spec = input->spec();
    check_size(path, spec);
    if (spec.width != 2 * spec.height && log)
        log(LogLevel::warning, "environment image '" + path + "' has " + std::to_string(spec.width) + " x " +
                                   std::to_string(spec.height) +
                                   " texels and is stretched: a latitude-longitude image is twice as wide as high");
    const Channels channels = find_channels(spec);
    const bool is_srgb = spec.type != SampleType::real;

    EnvironmentImage image;
    image.name = path;
    image.width = spec.width;
    image.height = spec.height;
    image.radiance.resize(spec.texels());
    const std::size_t n = static_cast<std::size_t>(spec.channels), width = static_cast<std::size_t>(spec.width);
    const int rows = spec.tile_height > 0 ? spec.tile_height : kRows;
    std::vector<float> values(width * n * static_cast<std::size_t>(std::min(rows, spec.height)));
    Repair repair;
    for (int begin = 0; begin < spec.height; begin += rows) {
        const int end = std::min(begin + rows, spec.height);
        if (!input->read_rows(begin, end, spec.channels, SampleType::real, values.data())) fail(path, input->error());
        glm::vec3* target = image.radiance.data() + static_cast<std::size_t>(begin) * width;
        for (std::size_t i = 0; i < width * static_cast<std::size_t>(end - begin); ++i) {
            const float* texel = values.data() + i * n;
            const auto value = [&](int channel) {
                return repair(is_srgb ? linear_from_srgb(texel[channel]) : texel[channel]);
            };
            target[i] = {value(channels.red), value(channels.green), value(channels.blue)};
        }
    }
    if (repair.count == repair.texels) fail(path, "none of its values is a finite number of at least 0");
    if (repair.count > 0 && log)
        log(LogLevel::warning, "environment image '" + path + "': " + std::to_string(repair.count) +
                                   " values are negative or not finite; taken for 0, infinity for 65504");
    return image;
}

}  // namespace rcs
