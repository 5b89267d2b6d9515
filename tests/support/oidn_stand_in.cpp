// Stands in for Open Image Denoise where tests ask what is done with what it says: its filter is a mean over 7 x 7
// pixels of like albedo and normal. Compiled for a version (STAND_IN_VERSION).

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <map>
#include <string>

namespace {

struct Device {
    std::map<std::string, int> values;
};

struct Filter {
    std::map<std::string, float*> images;
    int width = 0, height = 0;
    bool hdr = false, clean = false;
};

bool alike(const float* a, const float* b)
{
    return std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2]) < 0.1f;
}

}  // namespace

extern "C" {

__attribute__((visibility("default"))) void* oidnNewDevice(int type) { return type == 1 ? new Device : nullptr; }
__attribute__((visibility("default"))) void oidnSetDeviceInt(void* device, const char* name, int value)
{
    static_cast<Device*>(device)->values[name] = value;
}
__attribute__((visibility("default"))) void oidnSetDeviceBool(void* device, const char* name, bool value)
{
    static_cast<Device*>(device)->values[name] = value ? 1 : 0;
}
__attribute__((visibility("default"))) int oidnGetDeviceInt(void*, const char* name)
{
    return std::strcmp(name, "version") == 0 ? STAND_IN_VERSION : 0;
}
__attribute__((visibility("default"))) void oidnCommitDevice(void*) {}
__attribute__((visibility("default"))) int oidnGetDeviceError(void* device, const char** message)
{
    *message = "threads are to be told, and left where they are";
    const std::map<std::string, int>& values = static_cast<Device*>(device)->values;
    return values.contains("numThreads") && values.contains("setAffinity") && values.at("setAffinity") == 0 ? 0 : 2;
}
__attribute__((visibility("default"))) void oidnReleaseDevice(void* device) { delete static_cast<Device*>(device); }
__attribute__((visibility("default"))) void* oidnNewFilter(void*, const char* type)
{
    return std::strcmp(type, "RT") == 0 ? new Filter : nullptr;
}
__attribute__((visibility("default"))) void oidnSetSharedFilterImage(void* filter, const char* name, void* pixels,
                                                                     int format, std::size_t width, std::size_t height,
                                                                     std::size_t, std::size_t, std::size_t)
{
    Filter& f = *static_cast<Filter*>(filter);
    if (format == 3) f.images[name] = static_cast<float*>(pixels);
    f.width = static_cast<int>(width), f.height = static_cast<int>(height);
}
__attribute__((visibility("default"))) void oidnSetFilterBool(void* filter, const char* name, bool value)
{
    Filter& f = *static_cast<Filter*>(filter);
    (std::strcmp(name, "hdr") == 0 ? f.hdr : f.clean) = value;
}
__attribute__((visibility("default"))) void oidnCommitFilter(void*) {}
__attribute__((visibility("default"))) void oidnExecuteFilter(void* filter)
{
    Filter& f = *static_cast<Filter*>(filter);
    if (!f.hdr || !f.clean) return;
    const auto at = [&](const char* name, int x, int y) { return f.images.at(name) + 3 * (y * f.width + x); };
    constexpr int kReach = 3;
    for (int y = 0; y < f.height; ++y)
        for (int x = 0; x < f.width; ++x) {
            float sum[3] = {}, count = 0.0f;
            for (int ny = std::max(0, y - kReach); ny <= std::min(f.height - 1, y + kReach); ++ny)
                for (int nx = std::max(0, x - kReach); nx <= std::min(f.width - 1, x + kReach); ++nx) {
                    if (!alike(at("albedo", x, y), at("albedo", nx, ny)) ||
                        !alike(at("normal", x, y), at("normal", nx, ny)))
                        continue;
                    for (int c = 0; c < 3; ++c) sum[c] += at("color", nx, ny)[c];
                    count += 1.0f;
                }
            for (int c = 0; c < 3; ++c) at("output", x, y)[c] = sum[c] / count;
        }
}
__attribute__((visibility("default"))) void oidnReleaseFilter(void* filter) { delete static_cast<Filter*>(filter); }

}  // extern "C"
