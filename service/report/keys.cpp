#include "report/keys.h"

#include <fstream>
#include <iterator>
#include <string>

#include <dlfcn.h>

#include "rcs/option_table.h"
#include "rcs/render.h"
#include "rcs/version.h"

namespace rcs::service {
namespace {

std::string file_bytes(const std::string& path)
{
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// The library that this process runs, as a file.
std::string library_path()
{
    Dl_info info{};
    return dladdr(reinterpret_cast<const void*>(&plan_effects), &info) != 0 ? info.dli_fname : "";
}

}  // namespace

std::string paths_key(const Scene& scene, const View& view, const ReferenceOptions& options)
{
    Fingerprint print;
    print.add(kTransportVersion);
    add(print, scene);
    add(print, view.camera);
    print.add(view.width);
    print.add(view.height);
    print.add(options.bounces);
    print.add(options.aa);
    print.add(options.stride);
    print.add(options.seed);
    return print.text();
}

std::string processor_name()
{
    std::ifstream file("/proc/cpuinfo");
    for (std::string line; std::getline(file, line);) {
        const std::size_t colon = line.find(": ");
        if (line.rfind("model name", 0) == 0 && colon != line.npos) return line.substr(colon + 2);
    }
    return {};
}

std::string machine_key(int threads, const std::string& gl_renderer)
{
    Fingerprint print;
    print.add(std::string(kVersion));
    print.add(file_bytes(library_path()));
    print.add(processor_name());
    print.add(threads);
    print.add(gl_renderer);
    return print.text();
}

void add(Fingerprint& print, const RenderOptions& options)
{
    for (const OptionInfo& option : option_table()) {
        print.add(option.key);
        print.add(text_of(option, options));
    }
    print.add(options.layers.has_value());
    for (const std::string& layer : options.layers.value_or(std::vector<std::string>{})) print.add(layer);
}

}  // namespace rcs::service
