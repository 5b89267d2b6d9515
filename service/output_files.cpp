#include "output_files.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <optional>
#include <set>

#include "interrupt.h"
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

}  // namespace

OutputFiles::OutputFiles(const OutputArguments& arguments, PixelFormat exr_default, const LogFunction& log)
{
    std::set<std::string> paths;
    bool any_exr = false;
    bool any_display = false;
    for (const std::string& path : arguments.files) {
        if (!paths.insert(path).second) {
            throw Error(ErrorCode::bad_argument, "--output " + path + " is given twice");
        }
        File file{path, {}, lower_ending(path) == ".exr"};
        file.options.layers = arguments.layers;
        file.options.format = file.is_exr ? exr_default : PixelFormat::automatic;
        (file.is_exr ? any_exr : any_display) = true;
        files_.push_back(file);
    }
    if (!arguments.layers.empty() && !any_exr) {
        throw Error(ErrorCode::bad_argument, "--layers is given, but no output ends in .exr");
    }
    for (const std::string& text : arguments.pixel_formats) {
        const FormatChoice choice = parse_pixel_format(text);
        bool used = false;
        for (File& file : files_) {
            // A JPEG beside a 16-bit PNG stays what it can be.
            const bool fits = file.is_exr == choice.for_exr &&
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
    for (const File& file : files_) {
        check_output_path(file.path, file.options);
    }
    ToneMapOptions tone_map = arguments.tone_map;
    tone_map.exposure = parse_exposure(arguments.exposure);
    const bool named = !tone_map.ocio_config.empty() || !tone_map.display.empty() || !tone_map.view.empty();
    if (any_display || named) {
        tone_mapper_ = std::make_unique<ToneMapper>(tone_map, log);
    }
}

void OutputFiles::write(const LayeredImage& image, ThreadPool& pool, const ProgressFunction& progress,
                        RunReport& report) const
{
    const Image& beauty = image.layers.at("beauty");
    const bool any_display = std::any_of(files_.begin(), files_.end(), [](const File& f) { return !f.is_exr; });
    Image display;
    if (any_display) {
        progress("tone map", 0.0f);
        display = timed(report, "tone map", [&] { return tone_mapper_->apply(beauty, pool); });
        report.shown_with = ShownWith{tone_mapper_->config_name(), tone_mapper_->display(), tone_mapper_->view(),
                                      static_cast<double>(tone_mapper_->exposure(beauty))};
    }
    stop_if_interrupted();
    progress("write", 0.0f);
    timed(report, "write", [&] {
        for (const File& file : files_) {
            try {
                file.is_exr ? write_exr(file.path, image, file.options)
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
