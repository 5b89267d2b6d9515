#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <OpenImageIO/imageio.h>

#include "rcs/error.h"
#include "rcs/scene.h"
#include "util/one_line.h"
#include "util/srgb.h"

namespace rcs {
namespace {

/// Beyond: taken for damage, or too much for memory (768 MiB of radiance).
constexpr int kMaxSide = 32768;
constexpr std::int64_t kMaxTexels = std::int64_t{1} << 26;

/// Rows read at a time, to keep what is beside the image small.
constexpr int kRows = 64;

[[noreturn]] void fail(const std::string& path, const std::string& why)
{
    throw Error(ErrorCode::bad_file, "cannot read environment image " + path + ": " + one_line(why));
}

void check_size(const std::string& path, const OIIO::ImageSpec& spec)
{
    const std::int64_t texels = static_cast<std::int64_t>(spec.width) * spec.height;
    if (spec.width >= 1 && spec.height >= 1 && spec.width <= kMaxSide && spec.height <= kMaxSide &&
        texels <= kMaxTexels && spec.depth <= 1 && spec.nchannels >= 1 && spec.nchannels <= 64)
        return;
    fail(path, "it has " + std::to_string(spec.width) + " x " + std::to_string(spec.height) + " texels of " +
                   std::to_string(spec.nchannels) + " channels, expected sides in [1, " + std::to_string(kMaxSide) +
                   "] and at most " + std::to_string(kMaxTexels) + " texels");
}

/// Which three channels are red, green and blue: those with the names, else the first three; one alone is grey.
struct Channels {
    int red = 0, green = 0, blue = 0;
};
Channels find_channels(const OIIO::ImageSpec& spec)
{
    const int r = spec.channelindex("R"), g = spec.channelindex("G"), b = spec.channelindex("B");
    if (r >= 0 && g >= 0 && b >= 0) return {r, g, b};
    return spec.nchannels >= 3 ? Channels{0, 1, 2} : Channels{0, 0, 0};
}

bool read_rows(OIIO::ImageInput& input, const OIIO::ImageSpec& spec, int begin, int end, float* values)
{
    const int y0 = spec.y + begin, y1 = spec.y + end;
    if (spec.tile_width > 0)
        return input.read_tiles(0, 0, spec.x, spec.x + spec.width, y0, y1, spec.z, spec.z + std::max(spec.depth, 1), 0,
                                spec.nchannels, OIIO::TypeDesc::FLOAT, values);
    return input.read_scanlines(0, 0, y0, y1, spec.z, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, values);
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
    const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(path);
    if (!input) fail(path, OIIO::geterror());
    const OIIO::ImageSpec spec = input->spec();
    check_size(path, spec);
    const Channels channels = find_channels(spec);
    const bool is_srgb = !spec.format.is_floating_point();

    EnvironmentImage image;
    image.name = path;
    image.width = spec.width;
    image.height = spec.height;
    image.radiance.resize(static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.height));
    const std::size_t n = static_cast<std::size_t>(spec.nchannels), width = static_cast<std::size_t>(spec.width);
    const int rows = spec.tile_height > 0 ? spec.tile_height : kRows;
    std::vector<float> values(width * n * static_cast<std::size_t>(std::min(rows, spec.height)));
    Repair repair;
    for (int begin = 0; begin < spec.height; begin += rows) {
        const int end = std::min(begin + rows, spec.height);
        if (!read_rows(*input, spec, begin, end, values.data())) fail(path, input->geterror());
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
        log(LogLevel::warning, "environment image " + path + ": " + std::to_string(repair.count) +
                                   " values are negative or not finite; taken for 0, infinity for 65504");
    return image;
}

}  // namespace rcs
