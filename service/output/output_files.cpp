#include "output/output_files.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <optional>
#include <utility>

#include "rcs/error.h"

namespace rcs::service {
namespace {

std::string lower_ending(const std::string& path)
{
    std::string ending = std::filesystem::path(path).extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return ending;
}

void tell(const ProgressFunction& progress, const char* stage)
{
    if (!progress(stage, 0.0f)) {
        throw Error(ErrorCode::cancelled, "interrupted, nothing was written");
    }
}

}  // namespace

bool is_exr(const OutputFile& file) { return lower_ending(file.path) == ".exr"; }

bool is_png(const OutputFile& file) { return lower_ending(file.path) == ".png"; }

void render_for(const std::vector<OutputFile>& files, RenderOptions& options)
{
    std::vector<std::string> kept;
    bool all = false;
    for (const OutputFile& file : files) {
        all = all || (is_exr(file) && file.options.layers.empty());
        kept.insert(kept.end(), file.options.layers.begin(), file.options.layers.end());
    }
    options.layers = all ? std::nullopt : std::optional(kept);
}

OutputFiles::OutputFiles(std::vector<OutputFile> files, const ToneMapOptions& tone_map, const LogFunction& log,
                         bool shows)
    : files_(std::move(files))
{
    for (const OutputFile& file : files_) {
        check_output_path(file.path, file.options);
    }
    const bool named = !tone_map.ocio_config.empty() || !tone_map.display.empty() || !tone_map.view.empty();
    if (shows || named || !std::all_of(files_.begin(), files_.end(), is_exr)) {
        tone_mapper_ = std::make_unique<ToneMapper>(tone_map, log);
    }
}

void OutputFiles::write(const LayeredImage& image, ThreadPool& pool, const ProgressFunction& progress,
                        RunReport& report, const std::function<std::string(const std::string&)>& path_of) const
{
    const Image& beauty = image.layers.at("beauty");
    Image display;
    if (!std::all_of(files_.begin(), files_.end(), is_exr)) {
        tell(progress, "tone map");
        display = timed(report, "tone map", [&] { return tone_mapper_->apply(beauty, pool); });
    }
    if (tone_mapper_) {
        report.shown_with = ShownWith{tone_mapper_->config_name(), tone_mapper_->display(), tone_mapper_->view(),
                                      static_cast<double>(tone_mapper_->exposure(beauty))};
    }
    tell(progress, "write");
    timed(report, "write", [&] {
        for (const OutputFile& file : files_) {
            const std::string path = path_of ? path_of(file.path) : file.path;
            try {
                is_exr(file) ? write_exr(path, image, file.options) : write_display_image(path, display, file.options);
            } catch (const Error& e) {
                std::string message = e.what();
                for (const std::string& done : report.written) {
                    message.append(" (complete: ").append(done).append(")");
                }
                throw Error(e.code(), message);
            }
            report.written.push_back(path);
        }
    });
}

}  // namespace rcs::service
