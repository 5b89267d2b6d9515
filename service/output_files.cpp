#include "output_files.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <optional>
#include <set>
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

/// The ending of the files that a value of --pixel-format is for, and what it asks of them.
struct FormatChoice {
    PixelFormat format;
    bool for_exr;
};

FormatChoice parse_pixel_format(const std::string& text)
{
    if (text == "half") return {PixelFormat::half_float, true};
    if (text == "float") return {PixelFormat::full_float, true};
    if (text == "16") return {PixelFormat::uint16, false};
    return {PixelFormat::uint8, false};
}

void tell(const ProgressFunction& progress, const char* stage)
{
    if (!progress(stage, 0.0f)) {
        throw Error(ErrorCode::cancelled, "interrupted, nothing was written");
    }
}

}  // namespace

bool is_exr(const OutputFile& file) { return lower_ending(file.path) == ".exr"; }

std::vector<OutputFile> parse_outputs(const OutputArguments& arguments, PixelFormat exr_default)
{
    std::set<std::string> paths;
    std::vector<OutputFile> files;
    for (const std::string& path : arguments.files) {
        if (!paths.insert(path).second) {
            throw Error(ErrorCode::bad_argument, "--output " + path + " is given twice");
        }
        OutputFile file{path, {}};
        if (is_exr(file)) {
            file.options.layers = arguments.layers;
            file.options.format = exr_default;
        }
        files.push_back(file);
    }
    if (!arguments.layers.empty() && std::none_of(files.begin(), files.end(), is_exr)) {
        throw Error(ErrorCode::bad_argument, "--layers is given, but no output ends in .exr");
    }
    for (const std::string& text : arguments.pixel_formats) {
        const FormatChoice choice = parse_pixel_format(text);
        bool used = false;
        for (OutputFile& file : files) {
            // A JPEG beside a 16-bit PNG stays what it can be.
            const bool fits = is_exr(file) == choice.for_exr &&
                              (choice.format != PixelFormat::uint16 || lower_ending(file.path) == ".png");
            if (fits) {
                file.options.format = choice.format;
                used = true;
            }
        }
        if (!used) {
            throw Error(ErrorCode::bad_argument, "--pixel-format " + text + " fits none of the outputs");
        }
    }
    return files;
}

ToneMapOptions parse_tone_map(const OutputArguments& arguments)
{
    ToneMapOptions tone_map = arguments.tone_map;
    tone_map.exposure = parse_exposure(arguments.exposure);
    return tone_map;
}

void render_for(const std::vector<OutputFile>& files, const ToneMapOptions& tone_map, RenderOptions& options)
{
    std::vector<std::string> kept;
    bool all = false;
    for (const OutputFile& file : files) {
        all = all || (is_exr(file) && file.options.layers.empty());
        kept.insert(kept.end(), file.options.layers.begin(), file.options.layers.end());
    }
    options.layers = all ? std::nullopt : std::optional(kept);
    options.auto_exposure = !tone_map.exposure && !std::all_of(files.begin(), files.end(), is_exr);
}

OutputFiles::OutputFiles(std::vector<OutputFile> files, const ToneMapOptions& tone_map, const LogFunction& log)
    : files_(std::move(files))
{
    for (const OutputFile& file : files_) {
        check_output_path(file.path, file.options);
    }
    const bool named = !tone_map.ocio_config.empty() || !tone_map.display.empty() || !tone_map.view.empty();
    if (named || !std::all_of(files_.begin(), files_.end(), is_exr)) {
        tone_mapper_ = std::make_unique<ToneMapper>(tone_map, log);
    }
}

void OutputFiles::write(const LayeredImage& image, ThreadPool& pool, const ProgressFunction& progress,
                        RunReport& report) const
{
    const Image& beauty = image.layers.at("beauty");
    Image display;
    if (!std::all_of(files_.begin(), files_.end(), is_exr)) {
        tell(progress, "tone map");
        display = timed(report, "tone map", [&] { return tone_mapper_->apply(beauty, pool); });
        report.shown_with = ShownWith{tone_mapper_->config_name(), tone_mapper_->display(), tone_mapper_->view(),
                                      static_cast<double>(tone_mapper_->exposure(beauty))};
    }
    tell(progress, "write");
    timed(report, "write", [&] {
        for (const OutputFile& file : files_) {
            try {
                is_exr(file) ? write_exr(file.path, image, file.options)
                             : write_display_image(file.path, display, file.options);
            } catch (const Error& e) {
                std::string message = e.what();
                for (const std::string& done : report.written) {
                    message.append(" (complete: ").append(done).append(")");
                }
                throw Error(e.code(), message);
            }
            report.written.push_back(file.path);
        }
    });
}

}  // namespace rcs::service
