#include "rcs/image_io.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <memory>
#include <utility>

#include "image/image_reader.h"
#include "rcs/error.h"
#include "rcs/layers.h"
#include "util/one_line.h"
#include "util/srgb.h"

namespace rcs {
namespace {

constexpr const char* kMetadataPrefix = "rcs:";

[[noreturn]] void fail_read(const std::string& path, const std::string& why)
{
    throw Error(ErrorCode::bad_file, "cannot read image file '" + path + "': " + one_line(why));
}

struct ChannelPlace {
    int rank = 0;     ///< order within the layer
    int channel = 0;  ///< in the file
};

/// Position of a channel within its layer: R G B A, X Y Z, then whatever else the file has.
int channel_rank(const std::string& suffix, int channel)
{
    static const std::array<std::pair<const char*, int>, 7> known{
        {{"R", 0}, {"G", 1}, {"B", 2}, {"A", 3}, {"X", 0}, {"Y", 1}, {"Z", 2}}};
    for (const auto& [name, rank] : known) {
        if (suffix == name) return rank;
    }
    return 4 + channel;
}

/// The number of a part at the end of a layer's name as a file has it, which is taken off: "CryptoObject01".
int take_part(std::string& layer)
{
    for (const LayerKind& kind : all_layers())
        for (int part = 0; kind.parts > 1 && part < kind.parts; ++part)
            if (layer == part_name(kind, part)) {
                layer = kind.name;
                return part;
            }
    return 0;
}

std::map<std::string, std::vector<ChannelPlace>> layers_of(const ImageFileSpec& spec)
{
    std::map<std::string, std::vector<ChannelPlace>> layers;
    for (int c = 0; c < spec.channels; ++c) {
        const std::string& name = spec.channel_names[static_cast<std::size_t>(c)];
        const std::size_t dot = name.rfind('.');
        std::string layer = dot == std::string::npos ? "beauty" : name.substr(0, dot);
        const std::string suffix = dot == std::string::npos ? name : name.substr(dot + 1);
        const int part = take_part(layer);
        layers[layer].push_back({part * spec.channels + channel_rank(suffix, c), c});
    }
    for (auto& [name, places] : layers) {
        std::stable_sort(places.begin(), places.end(),
                         [](const ChannelPlace& a, const ChannelPlace& b) { return a.rank < b.rank; });
    }
    return layers;
}

Image take_channels(const std::vector<float>& pixels, const ImageFileSpec& spec,
                    const std::vector<ChannelPlace>& places)
{
    Image image(spec.width, spec.height, static_cast<int>(places.size()));
    const std::size_t count = spec.texels();
    const auto stride = static_cast<std::size_t>(spec.channels);
    for (std::size_t c = 0; c < places.size(); ++c) {
        const auto from = static_cast<std::size_t>(places[c].channel);
        for (std::size_t i = 0; i < count; ++i) {
            image.pixels[i * places.size() + c] = pixels[i * stride + from];
        }
    }
    return image;
}

/// Grey, RGB or RGBA of a file without layers; alpha beside grey and what follows RGBA is left out.
Image take_picture(const std::vector<float>& pixels, const ImageFileSpec& spec)
{
    const int channels = spec.channels == 2 ? 1 : std::min(spec.channels, 4);
    std::vector<ChannelPlace> places;
    for (int c = 0; c < channels; ++c) {
        places.push_back({c, c});
    }
    Image image = take_channels(pixels, spec, places);
    if (spec.type != SampleType::real) {
        for (std::size_t i = 0; i < image.pixels.size(); ++i) {
            if (channels != 4 || i % 4 != 3) {
                image.pixels[i] = linear_from_srgb(image.pixels[i]);
            }
        }
    }
    if (channels == 4 && spec.alpha_apart)
        for (std::size_t i = 0; i < image.pixels.size(); ++i)
            if (i % 4 != 3) image.pixels[i] *= image.pixels[i - i % 4 + 3];
    return image;
}

}  // namespace

LayeredImage read_image(const std::string& path)
{
    std::error_code ignored;
    if (!std::filesystem::exists(path, ignored)) {
        throw Error(ErrorCode::not_found, "image file '" + path + "' does not exist");
    }
    if (!std::filesystem::is_regular_file(path, ignored)) {
        throw Error(ErrorCode::bad_file, "image file " + path + " is not a regular file");
    }
    std::string why;
    const std::unique_ptr<ImageReader> input = open_image(path, why);
    if (!input) fail_read(path, why);
    const ImageFileSpec& spec = input->spec();
    if (spec.depth > 1) fail_read(path, "it holds a volume");
    std::vector<float> pixels(spec.texels() * static_cast<std::size_t>(spec.channels));
    if (!input->read_rows(0, spec.height, spec.channels, SampleType::real, pixels.data()))
        fail_read(path, input->error());
    LayeredImage image;
    image.window = spec.window;
    if (spec.format == "openexr") {
        for (const auto& [name, places] : layers_of(spec)) {
            image.layers[name] = take_channels(pixels, spec, places);
        }
    } else {
        image.layers["beauty"] = take_picture(pixels, spec);
    }
    for (const auto& [key, value] : spec.attributes)
        if (key.rfind(kMetadataPrefix, 0) == 0) image.metadata[key] = value;
    return image;
}

std::string readable_image_formats()
{
    std::string formats = image_module().formats();
    std::replace(formats.begin(), formats.end(), ',', ' ');
    return formats;
}

}  // namespace rcs
