#include "image/image_reader.h"

#include <algorithm>
#include <filesystem>
#include <iterator>

#include <dlfcn.h>

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
    if (rcs_image_module) return *rcs_image_module();
    const std::filesystem::path file = own_folder() / (std::string("librcs-images-") + kVersion + ".so");
    void* const module = dlopen(file.c_str(), RTLD_LAZY | RTLD_LOCAL);
    const auto entry = module ? reinterpret_cast<Entry>(dlsym(module, "rcs_image_module")) : nullptr;
    if (!entry) {
        const char* const why = dlerror();
        throw Error(ErrorCode::not_found, "cannot read image files: " + one_line(why ? why : file.string()));
    }
    return *entry();
}

}  // namespace

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
