#include "scene/image_decoder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <utility>
#include <vector>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "rcs/error.h"
#include "scene/gltf_file.h"
#include "scene/texture.h"

namespace rcs {
namespace {

/// A side or texel count beyond these is taken for damage: 2^27 texels are 1 GiB.
constexpr int kMaxSide = 32768;
constexpr std::int64_t kMaxTexels = std::int64_t{1} << 27;

/// File name whose extension makes OpenImageIO choose the reader; nullptr if the format is none of ours.
const char* reader_name(std::span<const std::uint8_t> bytes)
{
    const auto starts_with = [&](std::initializer_list<std::uint8_t> magic) {
        return bytes.size() >= magic.size() && std::equal(magic.begin(), magic.end(), bytes.begin());
    };
    if (starts_with({0xff, 0xd8, 0xff})) return "image.jpg";
    if (starts_with({0x89, 'P', 'N', 'G'})) return "image.png";
    if (starts_with({0x76, 0x2f, 0x31, 0x01})) return "image.exr";
    if (starts_with({'I', 'I', 42, 0}) || starts_with({'M', 'M', 0, 42})) return "image.tif";
    return nullptr;
}

/// IEC 61966-2-1.
double linear_from_srgb(double value)
{
    return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

/// 16-bit linear code of each of the `count` integer sRGB codes.
std::vector<std::uint16_t> linear_codes(int count)
{
    std::vector<std::uint16_t> codes(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
        codes[static_cast<std::size_t>(i)] =
            static_cast<std::uint16_t>(linear_from_srgb(i / (count - 1.0)) * 65535.0 + 0.5);
    }
    return codes;
}

struct ToLinear {
    std::vector<std::uint16_t> codes;
    std::uint16_t operator()(std::uint8_t value) const { return codes[value]; }
    std::uint16_t operator()(std::uint16_t value) const { return codes[value]; }
    std::uint16_t operator()(float value) const
    {
        return static_cast<std::uint16_t>(value > 0.0f ? std::min(value, 1.0f) * 65535.0f + 0.5f : 0.0f);
    }
};

template <class Sample>
Texture::Level read_level(OIIO::ImageInput& input, OIIO::TypeDesc type, const ToLinear& to_linear,
                          const std::string& where)
{
    const OIIO::ImageSpec& spec = input.spec();
    const int channels = std::min(spec.nchannels, 4);
    Texture::Level level{spec.width, spec.height, {}};
    const std::size_t count = static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.height);
    std::vector<Sample> samples(count * static_cast<std::size_t>(channels));
    if (!input.read_image(0, 0, 0, channels, type, samples.data())) {
        throw Error(ErrorCode::bad_file, where + " cannot be decoded: " + on_one_line(input.geterror()));
    }
    // One or two channels are grey, without or with alpha.
    const std::size_t green = channels >= 3 ? 1 : 0;
    const std::size_t blue = channels >= 3 ? 2 : 0;
    level.texels.resize(count);
    const Sample* sample = samples.data();
    for (auto& texel : level.texels) {
        texel = {to_linear(sample[0]), to_linear(sample[green]), to_linear(sample[blue]), 0};
        sample += channels;
    }
    return level;
}

Texture::Level read_level(OIIO::ImageInput& input, const std::string& where)
{
    switch (input.spec().format.basetype) {
    case OIIO::TypeDesc::UINT8:
        return read_level<std::uint8_t>(input, OIIO::TypeDesc::UINT8, {linear_codes(256)}, where);
    case OIIO::TypeDesc::UINT16:
        return read_level<std::uint16_t>(input, OIIO::TypeDesc::UINT16, {linear_codes(65536)}, where);
    case OIIO::TypeDesc::HALF:
    case OIIO::TypeDesc::FLOAT: return read_level<float>(input, OIIO::TypeDesc::FLOAT, {}, where);
    default:
        throw Error(ErrorCode::unsupported, where + " has samples of type " + input.spec().format.c_str() +
                                                ", expected 8 or 16 bit integers, half or float");
    }
}

}  // namespace

Texture decode_texture(std::span<const std::uint8_t> bytes, std::string name, const std::string& where)
{
    const char* reader = reader_name(bytes);
    if (!reader) throw Error(ErrorCode::unsupported, where + " is no PNG, JPEG, TIFF or EXR image");

    OIIO::Filesystem::IOMemReader memory(bytes.data(), bytes.size());
    OIIO::Filesystem::IOProxy* proxy = &memory;
    OIIO::ImageSpec wish;
    wish.attribute("oiio:UnassociatedAlpha", 1);  // glTF's colours are not multiplied by alpha
    // Named twice: readers that are given a wish look for the proxy there and forget the argument.
    wish.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
    const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(reader, &wish, proxy);
    if (!input) throw Error(ErrorCode::bad_file, where + " cannot be decoded: " + on_one_line(OIIO::geterror()));

    const OIIO::ImageSpec& spec = input->spec();
    if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || spec.nchannels < 1 || spec.width > kMaxSide ||
        spec.height > kMaxSide || std::int64_t{spec.width} * spec.height > kMaxTexels) {
        throw Error(ErrorCode::unsupported, where + " has " + std::to_string(spec.width) + " x " +
                                                std::to_string(spec.height) + " texels, expected sides in [1, " +
                                                std::to_string(kMaxSide) + "] and at most " +
                                                std::to_string(kMaxTexels) + " texels");
    }
    return make_texture(std::move(name), read_level(*input, where));
}

}  // namespace rcs
