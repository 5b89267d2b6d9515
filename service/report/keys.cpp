#include "report/keys.h"

#include <fstream>
#include <iterator>
#include <string>

#include <dlfcn.h>

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
    return dladdr(reinterpret_cast<const void*>(&render), &info) != 0 ? info.dli_fname : "";
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
    // Taken apart by all its members: one more, and this does not compile until it counts here, too.
    const auto& [width, height, aa, bounces, quality, min_reach, max_reach, gradient_limit, area_samples,
                 penumbra_samples, lamp_picks, lobe_rays, overlap, splat, effects, layers, motion, dry_run, seed] =
        options;
    static_cast<void>(motion);  // no page keeps that layer
    print.add(width);
    print.add(height);
    print.add(aa);
    print.add(bounces);
    const auto [error_tolerance, rays, noise_target] = settings_or_default(options);
    print.add(quality.index());
    print.add(error_tolerance);
    print.add(rays);
    print.add(noise_target);
    print.add(target_error(options));
    print.add(budget_seconds(options));
    print.add(min_reach);
    print.add(max_reach);
    print.add(gradient_limit);
    print.add(area_samples);
    print.add(penumbra_samples);
    print.add(lamp_picks);
    print.add(lobe_rays);
    print.add(overlap);
    print.add(splat);
    print.add(dry_run);
    print.add(effects.with.bits());
    print.add(effects.without.bits());
    print.add(layers.has_value());
    for (const std::string& layer : layers.value_or(std::vector<std::string>{})) print.add(layer);
    print.add(seed);
}

}  // namespace rcs::service
