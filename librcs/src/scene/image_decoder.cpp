#include "scene/image_decoder.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "image/image_reader.h"
#include "rcs/error.h"
#include "scene/gltf_file.h"
#include "scene/texture.h"

namespace rcs {
namespace {

/// A side or texel count beyond these is taken for damage: 2^27 texels are 1 GiB.
constexpr int kMaxSide = 32768;
constexpr std::int64_t kMaxTexels = std::int64_t{1} << 27;

/// IEC 61966-2-1.
double linear_from_srgb(double value)
{
    return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

/// 16-bit code of each of the `count` integer codes of a file.
std::vector<std::uint16_t> codes_of(int count, ColorSpace space)
{
    std::vector<std::uint16_t> codes(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
        const double value = i / (count - 1.0);
        codes[static_cast<std::size_t>(i)] =
            static_cast<std::uint16_t>((space == ColorSpace::srgb ? linear_from_srgb(value) : value) * 65535.0 + 0.5);
    }
    return codes;
}

struct IntegerCodes {
    std::vector<std::uint16_t> codes;  ///< by the file's code
    std::uint16_t color(std::size_t value) const { return codes[value]; }
    std::uint16_t alpha(std::size_t value) const
    {
        return static_cast<std::uint16_t>(value * 65535 / (codes.size() - 1));  // exact: 65535 is 257 x 255
    }
};

struct FloatCodes {
    std::uint16_t color(float value) const
    {
        return static_cast<std::uint16_t>(value > 0.0f ? std::min(value, 1.0f) * 65535.0f + 0.5f : 0.0f);
    }
    std::uint16_t alpha(float value) const { return color(value); }
};

template <class Sample, class Codes>
Texture::Level read_level(ImageReader& input, SampleType type, const Codes& codes, const std::string& where)
{
    const ImageFileSpec& spec = input.spec();
    const int channels = std::min(spec.channels, 4);
    Texture::Level level{spec.width, spec.height, {}};
    const std::size_t count = spec.texels();
    std::vector<Sample> samples(count * static_cast<std::size_t>(channels));
    if (!input.read_rows(0, spec.height, channels, type, samples.data())) {
        throw Error(ErrorCode::bad_file, where + " cannot be decoded: " + on_one_line(input.error()));
    }
    // One or two channels are grey, without or with alpha.
    const std::size_t green = channels >= 3 ? 1 : 0;
    const std::size_t blue = channels >= 3 ? 2 : 0;
    const std::size_t alpha = static_cast<std::size_t>(channels) - 1;
    const bool has_alpha = channels % 2 == 0;
    level.texels.resize(count);
    const Sample* sample = samples.data();
    for (auto& texel : level.texels) {
        texel = {codes.color(sample[0]), codes.color(sample[green]), codes.color(sample[blue]),
                 has_alpha ? codes.alpha(sample[alpha]) : std::uint16_t{65535}};
        sample += channels;
    }
    return level;
}

Texture::Level read_level(ImageReader& input, ColorSpace space, const std::string& where)
{
    switch (input.spec().type) {
        case SampleType::uint8:
            return read_level<std::uint8_t>(input, SampleType::uint8, IntegerCodes{codes_of(256, space)}, where);
        case SampleType::uint16:
            return read_level<std::uint16_t>(input, SampleType::uint16, IntegerCodes{codes_of(65536, space)}, where);
        case SampleType::real:
            return read_level<float>(input, SampleType::real, FloatCodes{}, where);
        case SampleType::other:
            break;
    }
    throw Error(ErrorCode::unsupported, where + " has samples of type " + input.spec().type_name +
                                            ", expected 8 or 16 bit integers, half or float");
}

/// @param bytes  the size of the encoded image
void check_size(const ImageFileSpec& spec, std::size_t bytes, std::int64_t most_texels, const std::string& where)
{
    const std::int64_t texels = std::int64_t{spec.width} * spec.height;
    const std::int64_t most = std::min(kMaxTexels, most_texels);
    if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || spec.channels < 1 || spec.width > kMaxSide ||
        spec.height > kMaxSide || texels > most) {
        throw Error(ErrorCode::unsupported, where + " has " + std::to_string(spec.width) + " x " +
                                                std::to_string(spec.height) + " texels, expected sides in [1, " +
                                                std::to_string(kMaxSide) + "] and at most " +
                                                std::to_string(std::max<std::int64_t>(most, 0)) + " texels");
    }
    // Deflate packs at most 258 bytes into two bits: 1032 to 1.
    const auto given = static_cast<std::int64_t>(bytes) * 1032 * 8;
    if (spec.format == "png" && texels * spec.channels > given) {
        throw Error(ErrorCode::bad_file, where + " cannot be decoded: it has fewer bytes than " +
                                             std::to_string(spec.width) + " x " + std::to_string(spec.height) +
                                             " texels need");
    }
}

}  // namespace

bool reads_webp()
{
    static const bool reads = image_module().reads("webp");
    return reads;
}

Texture decode_texture(std::span<const std::uint8_t> bytes, ColorSpace space, std::int64_t most_texels,
                       std::string name, const std::string& where)
{
    std::string why;
    const std::unique_ptr<ImageReader> input = open_image(bytes, why);
    if (!input && why.empty()) throw Error(ErrorCode::unsupported, where + " is no PNG, JPEG, WebP, TIFF or EXR image");
    if (!input) throw Error(ErrorCode::bad_file, where + " cannot be decoded: " + on_one_line(why));
    check_size(input->spec(), bytes.size(), most_texels, where);
    return make_texture(std::move(name), read_level(*input, space, where));
}

}  // namespace rcs
