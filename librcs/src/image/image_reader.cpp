#include "image/image_reader.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <dlfcn.h>

#include "image/common_files.h"
#include "rcs/error.h"
#include "rcs/version.h"
#include "util/one_line.h"

namespace rcs {
namespace {

using Entry = const ImageModule* (*)();

/// The folder of the library or program that this code is part of.
std::filesystem::path own_folder()
{
    static const char here = 0;
    Dl_info info{};
    if (dladdr(&here, &info) == 0 || !info.dli_fname) return {};
    return std::filesystem::path(info.dli_fname).parent_path();
}

const ImageModule& load_module()
{
    const std::filesystem::path file =
        own_folder() / (std::string("rcs-") + kAbiVersion) / (std::string("images-") + kVersion + ".so");
    void* const module = dlopen(file.c_str(), RTLD_LAZY | RTLD_LOCAL);
    const auto entry = module ? reinterpret_cast<Entry>(dlsym(module, "rcs_image_module")) : nullptr;
    if (!entry) {
        const char* const why = dlerror();
        throw Error(ErrorCode::not_found, "cannot read image files: " + one_line(why ? why : file.string()));
    }
    return *entry();
}

/// A reader, and the file that it reads.
class HeldReader : public ImageReader {
public:
    HeldReader(std::vector<std::uint8_t> bytes, std::string& why)
        : bytes_(std::move(bytes)), reader_(open_image(bytes_, why))
    {
        if (reader_) spec_ = reader_->spec();
    }
    bool is_open() const { return reader_ != nullptr; }
    bool read_rows(int begin, int end, int channels, SampleType type, void* samples) override
    {
        return reader_->read_rows(begin, end, channels, type, samples);
    }
    std::string error() override { return reader_->error(); }

private:
    std::vector<std::uint8_t> bytes_;
    std::unique_ptr<ImageReader> reader_;
};

/// File name whose ending makes the module choose what to read it with; null if the format is none of ours.
const char* name_for_module(std::span<const std::uint8_t> bytes)
{
    const auto starts_with = [&](std::initializer_list<std::uint8_t> magic) {
        return bytes.size() >= magic.size() && std::equal(magic.begin(), magic.end(), bytes.begin());
    };
    if (is_jpeg(bytes)) return "image.jpg";
    if (starts_with({0x76, 0x2f, 0x31, 0x01})) return "image.exr";
    if (starts_with({'I', 'I', 42, 0}) || starts_with({'M', 'M', 0, 42})) return "image.tif";
    if (starts_with({'R', 'I', 'F', 'F'}) && bytes.size() >= 12 && std::memcmp(bytes.data() + 8, "WEBP", 4) == 0)
        return "image.webp";
    return nullptr;
}

}  // namespace

std::unique_ptr<ImageReader> open_image(std::span<const std::uint8_t> bytes, std::string& why)
{
    why.clear();
    if (is_png(bytes)) return open_png(bytes, why);
    if (is_jpeg(bytes)) {
        std::unique_ptr<ImageReader> reader = open_jpeg(bytes, why);
        if (reader || !why.empty()) return reader;
    }
    const char* const name = name_for_module(bytes);
    return name ? image_module().open_memory(name, bytes, why) : nullptr;
}

std::unique_ptr<ImageReader> open_image(const std::string& path, std::string& why)
{
    std::ifstream file(path, std::ios::binary);
    std::vector<std::uint8_t> bytes(4);
    file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    if (!file || !(is_png(bytes) || is_jpeg(bytes))) return image_module().open_file(path, why);
    bytes.insert(bytes.end(), std::istreambuf_iterator<char>(file), {});
    auto reader = std::make_unique<HeldReader>(std::move(bytes), why);
    if (reader->is_open()) return reader;
    return nullptr;
}

int ImageFileSpec::channel(const std::string& name) const
{
    const auto found = std::find(channel_names.begin(), channel_names.end(), name);
    return found == channel_names.end() ? -1 : static_cast<int>(std::distance(channel_names.begin(), found));
}

const ImageModule& image_module()
{
    static const ImageModule& module = load_module();  // stays until the process ends
    return module;
}

}  // namespace rcs
