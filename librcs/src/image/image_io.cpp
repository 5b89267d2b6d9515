#include "rcs/image_io.h"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <new>
#include <utility>

#include "image/display_files.h"
#include "image/exr_file.h"
#include "rcs/error.h"
#include "rcs/layers.h"
#include "util/file_writer.h"

namespace rcs {
namespace {

enum class FileKind { exr, png, jpeg };

FileKind kind_of(const std::string& path)
{
    std::string ending = std::filesystem::path(path).extension().string();
    for (char& c : ending) {
        c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    if (ending == ".exr") return FileKind::exr;
    if (ending == ".png") return FileKind::png;
    if (ending == ".jpg" || ending == ".jpeg") return FileKind::jpeg;
    throw Error(ErrorCode::bad_argument, "output file '" + path + "' " +
                                             (ending.empty() ? "has no ending" : "ends in \"" + ending + "\"") +
                                             ", expected .exr, .png, .jpg or .jpeg");
}

void check_options(const std::string& path, FileKind kind, const ImageFileOptions& options)
{
    const PixelFormat format = options.format;
    const bool is_float = format == PixelFormat::half_float || format == PixelFormat::full_float;
    const bool is_integer = format == PixelFormat::uint8 || format == PixelFormat::uint16;
    if (kind == FileKind::exr && is_integer) {
        throw Error(ErrorCode::bad_argument,
                    "pixel format of " + path + " is an integer, expected half or float for EXR");
    }
    if (kind != FileKind::exr && is_float) {
        throw Error(ErrorCode::bad_argument,
                    "pixel format of " + path + " is a float, expected 8 or 16 bit for PNG and JPEG");
    }
    if (kind == FileKind::jpeg && format == PixelFormat::uint16) {
        throw Error(ErrorCode::bad_argument, "pixel format of " + path + " is 16 bit, expected 8 bit for JPEG");
    }
    if (options.jpeg_quality < 1 || options.jpeg_quality > 100) {
        throw Error(ErrorCode::bad_argument,
                    "jpeg_quality is " + std::to_string(options.jpeg_quality) + ", expected a value in [1, 100]");
    }
}

void check_pixels(const std::string& path, const std::string& layer, const Image& image)
{
    const std::size_t expected = static_cast<std::size_t>(std::max(image.width, 0)) *
                                 static_cast<std::size_t>(std::max(image.height, 0)) *
                                 static_cast<std::size_t>(std::max(image.channels, 0));
    const LayerKind* const known = look_up_layer(layer);
    const int most_channels = known ? std::max(4, known->channel_count()) : 4;
    if (expected == 0 || image.channels > most_channels || image.pixels.size() != expected) {
        throw Error(ErrorCode::bad_argument, "layer " + layer + " for " + path + " is " + std::to_string(image.width) +
                                                 "x" + std::to_string(image.height) + " with " +
                                                 std::to_string(image.channels) + " channels and " +
                                                 std::to_string(image.pixels.size()) + " values");
    }
}

std::vector<std::string> channel_names(const std::string& layer, int channels)
{
    const LayerKind* const known = look_up_layer(layer);
    const bool fits = known && known->channel_count() == channels;
    const std::string_view letters = fits ? known->channels : channels == 1 ? "Y" : "RGBA";
    const int of_part = static_cast<int>(letters.size());
    std::vector<std::string> names;
    for (int c = 0; c < channels; ++c) {
        const std::string part = layer == "beauty" ? "" : (fits ? part_name(*known, c / of_part) : layer) + ".";
        names.push_back(part + letters[static_cast<std::size_t>(c % of_part)]);
    }
    return names;
}

using NamedLayers = std::vector<std::pair<std::string, const Image*>>;

NamedLayers chosen_layers(const std::string& path, const LayeredImage& image, const std::vector<std::string>& wanted)
{
    const auto beauty = image.layers.find("beauty");
    if (beauty == image.layers.end()) {
        throw Error(ErrorCode::bad_argument, "the image for " + path + " has no layer \"beauty\"");
    }
    for (const std::string& name : wanted) {
        if (image.layers.count(name) == 0) {
            throw Error(ErrorCode::not_found, "the image for " + path + " has no layer \"" + name + "\"");
        }
    }
    NamedLayers chosen{{"beauty", &beauty->second}};
    for (const auto& [name, layer] : image.layers) {
        if (name != "beauty" && (wanted.empty() || std::find(wanted.begin(), wanted.end(), name) != wanted.end())) {
            chosen.emplace_back(name, &layer);
        }
    }
    for (const auto& [name, layer] : chosen) {
        check_pixels(path, name, *layer);
        if (layer->width != beauty->second.width || layer->height != beauty->second.height) {
            throw Error(ErrorCode::bad_argument, "layer " + name + " for " + path + " differs in size from beauty");
        }
    }
    return chosen;
}

std::vector<ExrLayer> exr_layers(const NamedLayers& layers, PixelFormat format)
{
    std::vector<ExrLayer> result;
    for (const auto& [name, layer] : layers) {
        const LayerKind* const known = look_up_layer(name);
        const bool full = format == PixelFormat::full_float || (known && known->needs_float);
        result.push_back({layer, channel_names(name, layer->channels), full});
    }
    return result;
}

}  // namespace

void check_output_path(const std::string& path, const ImageFileOptions& options)
{
    check_options(path, kind_of(path), options);
    const FileWriter probe(path);  // the surest test of a folder is to make a file in it
}

void write_exr(const std::string& path, const LayeredImage& image, const ImageFileOptions& options)
{
    if (kind_of(path) != FileKind::exr) {
        throw Error(ErrorCode::bad_argument, "output file '" + path + "' holds layers, expected the ending .exr");
    }
    check_options(path, FileKind::exr, options);
    const NamedLayers chosen = chosen_layers(path, image, options.layers);
    std::map<std::string, std::string> attributes = image.metadata;
    for (const auto& [name, layer] : chosen) {
        const auto own = image.layer_metadata.find(name);
        if (own != image.layer_metadata.end()) attributes.insert(own->second.begin(), own->second.end());
    }
    FileWriter writer(path);
    write_exr_file(writer.file(), path, exr_layers(chosen, options.format), image.window, attributes);
    writer.commit();
}

namespace {

/// @return which kind its name asks for   @throws Error bad_argument
FileKind check_display(const std::string& path, const Image& display, const ImageFileOptions& options)
{
    const FileKind kind = kind_of(path);
    if (kind == FileKind::exr)
        throw Error(ErrorCode::bad_argument, "output file '" + path + "' holds display values, expected .png or .jpg");
    check_options(path, kind, options);
    check_pixels(path, "display", display);
    return kind;
}

void write_display(std::FILE* file, FileKind kind, const std::string& path, const Image& display,
                   const ImageFileOptions& options)
{
    if (kind == FileKind::jpeg)
        write_jpeg_file(file, path, display, options.jpeg_quality);
    else
        write_png_file(file, path, display, options.format == PixelFormat::uint16);
}

/// Memory that is written to as a file.
struct MemoryFile {
    char* bytes = nullptr;
    std::size_t count = 0;
    std::FILE* file = open_memstream(&bytes, &count);

    MemoryFile()
    {
        if (!file) throw std::bad_alloc();
    }
    ~MemoryFile()
    {
        if (file) std::fclose(file);
        std::free(bytes);
    }
    MemoryFile(const MemoryFile&) = delete;
    /// @return what was written
    std::string take()
    {
        if (std::fclose(std::exchange(file, nullptr)) != 0) throw std::bad_alloc();
        return {bytes, count};
    }
};

}  // namespace

void write_display_image(const std::string& path, const Image& display, const ImageFileOptions& options)
{
    const FileKind kind = check_display(path, display, options);
    FileWriter writer(path);
    write_display(writer.file(), kind, path, display, options);
    writer.commit();
}

std::string display_image_bytes(const std::string& name, const Image& display, const ImageFileOptions& options)
{
    const FileKind kind = check_display(name, display, options);
    MemoryFile memory;
    write_display(memory.file, kind, name, display, options);
    return memory.take();
}

}  // namespace rcs
