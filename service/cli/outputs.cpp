#include "cli/outputs.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <string>
#include <system_error>

#include "process/exit_code.h"
#include "rcs/error.h"

namespace rcs::service {
namespace {

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

std::vector<OutputFile> parse_outputs(const OutputArguments& arguments, PixelFormat exr_default)
{
    std::vector<OutputFile> files;
    for (const std::string& path : arguments.files) {
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
            const bool fits = is_exr(file) == choice.for_exr && (choice.format != PixelFormat::uint16 || is_png(file));
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

OutputFiles output_files(std::vector<OutputFile> files, const ToneMapOptions& tone_map, const LogFunction& log,
                         bool shows)
{
    try {
        return OutputFiles(std::move(files), tone_map, log, shows);
    } catch (const Error& e) {
        if (e.code() == ErrorCode::bad_file) throw Ended(kBadConfig, e.what());
        throw;
    }
}

void check_written_files(const CLI::App& command)
{
    std::map<std::filesystem::path, std::string> options;
    for (const char* name : {"--output", "--stats", "--records"}) {
        const CLI::Option* option = command.get_option_no_throw(name);
        if (option == nullptr) continue;
        for (const std::string& file : option->results()) {
            if (file.empty()) continue;
            std::error_code ignored;
            const auto [other, is_new] = options.emplace(std::filesystem::weakly_canonical(file, ignored), name);
            if (!is_new)
                throw Error(ErrorCode::bad_argument,
                            std::string(name) + " " + file + " is the same file as that of " + other->second);
        }
    }
}

}  // namespace rcs::service
