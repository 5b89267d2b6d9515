#include "denoise/oidn.h"

#include <cstddef>
#include <cstdlib>

#include <dlfcn.h>

#include "rcs/error.h"
#include "util/one_line.h"

namespace rcs {
namespace {

constexpr const char* kFile = "libOpenImageDenoise.so.2";
constexpr const char* kFolder = "RCSPLAT_OIDN";

// The part of Open Image Denoise 2's C interface that is used (OpenImageDenoise/oidn.h, which no package of Debian 12
// has).
constexpr int kCpu = 1;     // OIDN_DEVICE_TYPE_CPU
constexpr int kFloat3 = 3;  // OIDN_FORMAT_FLOAT3
using Device = void*;
using Filter = void*;

[[noreturn]] void fail(const std::string& why)
{
    throw Error(ErrorCode::unsupported, "cannot denoise: " + one_line(why));
}

}  // namespace

struct Oidn::Library {
    void* module = nullptr;
    Device device = nullptr;

    Device (*new_device)(int type) = nullptr;
    void (*set_device_int)(Device, const char* name, int value) = nullptr;
    void (*set_device_bool)(Device, const char* name, bool value) = nullptr;
    int (*get_device_int)(Device, const char* name) = nullptr;
    void (*commit_device)(Device) = nullptr;
    int (*get_device_error)(Device, const char** message) = nullptr;
    void (*release_device)(Device) = nullptr;
    Filter (*new_filter)(Device, const char* type) = nullptr;
    void (*set_image)(Filter, const char* name, void* pixels, int format, std::size_t width, std::size_t height,
                      std::size_t offset, std::size_t pixel_stride, std::size_t row_stride) = nullptr;
    void (*set_filter_bool)(Filter, const char* name, bool value) = nullptr;
    void (*commit_filter)(Filter) = nullptr;
    void (*execute_filter)(Filter) = nullptr;
    void (*release_filter)(Filter) = nullptr;

    Library() { open(), take_functions(); }
    ~Library()
    {
        if (device) release_device(device);
        dlclose(module);
    }
    Library(const Library&) = delete;
    Library& operator=(const Library&) = delete;

    void open()
    {
        const char* const folder = std::getenv(kFolder);
        const std::string file = folder && *folder ? std::string(folder) + "/" + kFile : kFile;
        module = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
        if (module) return;
        const char* const why = dlerror();
        fail(std::string("Open Image Denoise 2 is not to be had (") + (why ? why : file) +
             "); install it (PyPI: pyoidn) and let the environment variable " + kFolder + " name the folder of " +
             kFile);
    }
    template <typename Function>
    void take(Function& function, const char* name)
    {
        function = reinterpret_cast<Function>(dlsym(module, name));
        if (function) return;
        dlclose(module);
        fail(std::string(kFile) + " has no function " + name);
    }
    void take_functions()
    {
        take(new_device, "oidnNewDevice");
        take(set_device_int, "oidnSetDeviceInt");
        take(set_device_bool, "oidnSetDeviceBool");
        take(get_device_int, "oidnGetDeviceInt");
        take(commit_device, "oidnCommitDevice");
        take(get_device_error, "oidnGetDeviceError");
        take(release_device, "oidnReleaseDevice");
        take(new_filter, "oidnNewFilter");
        take(set_image, "oidnSetSharedFilterImage");
        take(set_filter_bool, "oidnSetFilterBool");
        take(commit_filter, "oidnCommitFilter");
        take(execute_filter, "oidnExecuteFilter");
        take(release_filter, "oidnReleaseFilter");
    }
    void check() const
    {
        const char* message = nullptr;
        if (get_device_error(device, &message) != 0)
            fail(std::string("Open Image Denoise says: ") + (message ? message : "an error without words"));
    }
};

Oidn::Oidn(int threads) : open_(std::make_unique<Library>()), device_("CPU")
{
    Library& oidn = *open_;
    oidn.device = oidn.new_device(kCpu);
    if (!oidn.device) fail("Open Image Denoise has no device for this processor");
    oidn.set_device_int(oidn.device, "numThreads", threads);
    oidn.set_device_bool(oidn.device, "setAffinity", false);
    oidn.commit_device(oidn.device);
    oidn.check();
    const int version = oidn.get_device_int(oidn.device, "version");
    const int major = version / 10000, minor = version / 100 % 100, patch = version % 100;
    const std::string number = std::to_string(major) + "." + std::to_string(minor) + "." + std::to_string(patch);
    if (major != 2) fail("Open Image Denoise is of version " + number + ", expected 2");
    library_ = "Open Image Denoise " + number;
}

Oidn::~Oidn() = default;

std::vector<glm::vec3> Oidn::filter(int width, int height, const std::vector<glm::vec3>& light,
                                    const std::vector<glm::vec3>& albedo, const std::vector<glm::vec3>& normal) const
{
    static_assert(sizeof(glm::vec3) == 3 * sizeof(float));
    const Library& oidn = *open_;
    std::vector<glm::vec3> filtered(light.size());
    const Filter filter = oidn.new_filter(oidn.device, "RT");
    const auto set = [&](const char* name, const std::vector<glm::vec3>& image) {
        // It writes to `output` alone.
        oidn.set_image(filter, name, const_cast<glm::vec3*>(image.data()), kFloat3, static_cast<std::size_t>(width),
                       static_cast<std::size_t>(height), 0, 0, 0);
    };
    set("color", light);
    set("albedo", albedo);
    set("normal", normal);
    set("output", filtered);
    oidn.set_filter_bool(filter, "hdr", true);
    oidn.set_filter_bool(filter, "cleanAux", true);
    oidn.commit_filter(filter);
    oidn.execute_filter(filter);
    oidn.release_filter(filter);
    oidn.check();
    return filtered;
}

}  // namespace rcs
