#include "cli/machine_report.h"

#include <cstdio>
#include <fstream>
#include <thread>

#include "rcs/image_io.h"
#include "rcs/machine.h"
#include "rcs/tone_map.h"
#include "rcs/version.h"

namespace rcs::service {
namespace {

/// A line of /proc/meminfo, in GiB; "unknown" where there is none.
std::string memory(const std::string& key)
{
    std::ifstream file("/proc/meminfo");
    std::string name;
    double kilobytes = 0.0;
    for (std::string unit; file >> name >> kilobytes; std::getline(file, unit))
        if (name == key + ":") {
            char text[32];
            std::snprintf(text, sizeof text, "%.1f GiB", kilobytes / (1024.0 * 1024.0));
            return text;
        }
    return "unknown";
}

}  // namespace

MachineReport describe_machine(GlContext& gl, ThreadPool& pool, const LogFunction& log)
{
    MachineReport report = {{"rcsplat", kVersion}};
    for (auto& fact : describe_gl(gl)) report.push_back(std::move(fact));
    for (auto& fact : describe_gather(gl, pool)) report.push_back(std::move(fact));
    for (auto& fact : describe_splat(gl, pool)) report.push_back(std::move(fact));
    for (auto& fact : describe_rays()) report.push_back(std::move(fact));
    const ToneMapper mapper(ToneMapOptions{}, log);
    report.emplace_back("OpenColorIO configuration",
                        mapper.config_name() + ", " + mapper.display() + ", " + mapper.view());
    report.emplace_back("OpenImageIO formats", readable_image_formats());
    report.emplace_back("threads",
                        std::to_string(pool.size()) + " of " + std::to_string(std::thread::hardware_concurrency()));
    report.emplace_back("memory free", memory("MemAvailable") + " of " + memory("MemTotal"));
    return report;
}

}  // namespace rcs::service
