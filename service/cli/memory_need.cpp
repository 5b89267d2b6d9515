#include "cli/memory_need.h"

#include <algorithm>
#include <cstdio>

#include "process/process.h"
#include "rcs/error.h"

namespace rcs::service {
namespace {

// Measured on demo:cornell, demo:atrium and demo:spheres, 512x512 and 1024x1024, as the peak of the whole process.
constexpr double kProgram = 130e6;         ///< [bytes]
constexpr double kPixel = 260.0;           ///< G-buffer, light, records' sums [bytes a pixel]
constexpr double kFurtherSamples = 150.0;  ///< sums over several samples
constexpr double kFilter = 600.0;          ///< what a filter is told, its own images and scratch
constexpr double kExr = 50.0;              ///< layers on their way into a file

constexpr double kWorthSaying = 0.5;  ///< of what is free

std::string gigabytes(double bytes)
{
    char text[32];
    std::snprintf(text, sizeof text, "%.1f GB", 1e-9 * bytes);
    return text;
}

}  // namespace

double memory_need(const RenderOptions& options, const std::vector<std::string>& files)
{
    const bool exr = std::any_of(files.begin(), files.end(), [](const std::string& f) { return f.ends_with(".exr"); });
    const double pixels = options.crop ? static_cast<double>(options.crop->width) * options.crop->height
                                       : static_cast<double>(options.width) * options.height;
    return kProgram + pixels * (kPixel + (options.aa > 1 ? kFurtherSamples : 0.0) + (exr ? kExr : 0.0) +
                                (options.denoise != Denoiser::none ? kFilter : 0.0));
}

void check_memory(const RenderOptions& options, const std::vector<std::string>& files, const LogFunction& log)
{
    const double need = memory_need(options, files), free = available_memory();
    const std::string what = "--size " + std::to_string(options.width) + "x" + std::to_string(options.height) +
                             " takes about " + gigabytes(need) + " of memory beside the scene, of " + gigabytes(free) +
                             " that are free";
    if (need > free) throw Error(ErrorCode::out_of_memory, what);
    log(need > kWorthSaying * free ? LogLevel::warning : LogLevel::info, what);
}

}  // namespace rcs::service
