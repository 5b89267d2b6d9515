#include "report/paths.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <utility>

#include "process/process.h"
#include "rcs/error.h"
#include "rcs/image_io.h"

namespace rcs::service {
namespace {

constexpr const char* kKey = "rcs:key";
constexpr const char* kSeconds = "rcs:seconds";
constexpr const char* kProcessor = "rcs:processor_seconds";

}  // namespace

GrowingPaths::GrowingPaths(std::string file, std::string key, const View& view, const ReferenceOptions& options)
    : file_(std::move(file)), key_(std::move(key)), view_(view), options_(options)
{
    if (!std::filesystem::exists(file_)) return;
    LayeredImage kept = read_image(file_);
    const auto found = kept.metadata.find(kKey);
    if (found == kept.metadata.end() || found->second != key_) return;
    try {
        samples_ = std::stoi(kept.metadata.at("rcs:samples"));
        seconds_ = std::stod(kept.metadata.at(kSeconds));
        processor_seconds_ = std::stod(kept.metadata.at(kProcessor));
    } catch (const std::exception&) {
        throw Error(ErrorCode::bad_file, file_ + " lacks its number of samples or its times; remove it to trace anew");
    }
    image_ = std::move(kept);
}

void GrowingPaths::clear()
{
    image_ = {};
    samples_ = 0;
    seconds_ = processor_seconds_ = 0.0;
}

void GrowingPaths::add_round(const RayScene& rays, ThreadPool& pool, const ProgressFunction& progress)
{
    options_.first_sample = samples_;
    options_.samples = next_round(samples_);
    const auto begin = std::chrono::steady_clock::now();
    const double processor = processor_time().own;
    merge_references(image_, render_reference(rays, view_, options_, pool, progress));
    seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    processor_seconds_ += processor_time().own - processor;
    samples_ += options_.samples;
    image_.metadata[kKey] = key_;
    image_.metadata[kSeconds] = std::to_string(seconds_);
    image_.metadata[kProcessor] = std::to_string(processor_seconds_);
    ImageFileOptions file_options;
    file_options.format = PixelFormat::full_float;
    write_exr(file_, image_, file_options);
}

int next_round(int samples) { return std::clamp(samples, kSmallestRound, kLargestRound); }

bool is_round(int samples)
{
    int end = kSmallestRound;
    while (end < samples) end += next_round(end);
    return end == samples;
}

}  // namespace rcs::service
