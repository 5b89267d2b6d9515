#include "rcs/tone_map.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <utility>

#include <OpenColorIO/OpenColorIO.h>

#include "display/builtin_config.h"
#include "display/named_files.h"
#include "rcs/error.h"
#include "util/color.h"
#include "util/one_line.h"

namespace rcs {

namespace ocio = OCIO_NAMESPACE;

struct ToneMapper::Impl {
    std::optional<float> exposure;
    std::string display, view, config_name;
    ocio::ConstCPUProcessorRcPtr processor;
};

namespace {

constexpr float kLargestExposure = 64.0f;  ///< [EV]; 2^64 times a half float still is a float
constexpr float kLargestInput = 65504.0f;  ///< far past the shoulder of any view; some yield NaN for infinity
constexpr std::size_t kRowsPerChunk = 16;  ///< fixed, so that chunks do not depend on the threads

/// OpenColorIO logs to stderr unless told otherwise, and only for the whole process: hold the lock while
/// a configuration is read.
class OcioLog {
public:
    explicit OcioLog(const LogFunction& log) : lock_(mutex())
    {
        ocio::SetLoggingFunction([log](const char* text) {
            if (log && text != nullptr) log(LogLevel::warning, one_line(text));
        });
    }
    ~OcioLog() { ocio::ResetToDefaultLoggingFunction(); }
    OcioLog(const OcioLog&) = delete;
    OcioLog& operator=(const OcioLog&) = delete;

private:
    static std::mutex& mutex()
    {
        static std::mutex instance;
        return instance;
    }
    std::lock_guard<std::mutex> lock_;
};

struct NamedConfig {
    ocio::ConstConfigRcPtr config;
    std::string name;
};

NamedConfig open_config(const std::string& wanted, bool one_file_only)
{
    std::string file = wanted;
    std::string source = "OpenColorIO configuration '" + file + "'";
    if (file.empty()) {
        const char* variable = std::getenv("OCIO");
        if (variable == nullptr || *variable == '\0') {
            return {builtin_config(), "built-in"};
        }
        file = variable;
        source = "OpenColorIO configuration '" + file + "' (named by $OCIO)";
    }
    std::error_code ignored;
    const bool built_into_ocio = file.rfind("ocio://", 0) == 0;
    if (!built_into_ocio && !std::filesystem::exists(file, ignored)) {
        throw Error(ErrorCode::not_found, source + " does not exist");
    }
    if (!built_into_ocio && std::filesystem::is_directory(file, ignored)) {
        throw Error(ErrorCode::bad_file, source + " is a folder");
    }
    try {
        const ocio::ConstConfigRcPtr config = ocio::Config::CreateFromFile(file.c_str());
        const auto named = one_file_only ? named_file(config) : std::nullopt;
        if (named)
            throw Error(ErrorCode::bad_file, source + " names the file " + *named + ", which is not allowed here");
        config->validate();
        return {config, file};
    } catch (const ocio::Exception& e) {
        throw Error(ErrorCode::bad_file, source + " is refused: " + one_line(e.what()));
    }
}

std::string quoted_list(const std::vector<std::string>& names)
{
    std::string list;
    for (const std::string& name : names) {
        list.append(list.empty() ? "\"" : ", \"").append(name).append("\"");
    }
    return list.empty() ? "none" : list;
}

std::string choose(const std::string& what, const std::string& wanted, const char* preferred,
                   const std::vector<std::string>& names, const std::string& where)
{
    const std::string name = wanted.empty() ? std::string(preferred != nullptr ? preferred : "") : wanted;
    if (std::find(names.begin(), names.end(), name) == names.end()) {
        throw Error(ErrorCode::not_found,
                    where + " has no " + what + " \"" + name + "\"; there are: " + quoted_list(names));
    }
    return name;
}

/// Linear Rec. 709 under the names that the published configurations give it, else whatever the
/// configuration renders in.
std::string working_space(const ocio::ConstConfigRcPtr& config, const std::string& where, const LogFunction& log)
{
    for (const char* name : {kLinearRec709, "lin_rec709_srgb", "lin_rec709", "lin_srgb", "Linear Rec.709",
                             "Utility - Linear - sRGB", "Utility - Linear - Rec.709", "Linear BT.709"}) {
        if (config->getColorSpace(name)) {
            return name;
        }
    }
    if (const ocio::ConstColorSpaceRcPtr space = config->getColorSpace(ocio::ROLE_SCENE_LINEAR)) {
        if (log) {
            log(LogLevel::warning, where +
                                       " names no linear Rec.709 colour space; colours are taken to be in "
                                       "its scene_linear role, \"" +
                                       space->getName() + "\"");
        }
        return space->getName();
    }
    throw Error(ErrorCode::bad_file, where + " has neither a linear Rec.709 colour space nor a scene_linear role");
}

/// OpenColorIO itself: which processor turns working-space pixels into display values.
ocio::ConstCPUProcessorRcPtr make_processor(const ocio::ConstConfigRcPtr& config, const std::string& space,
                                            const std::string& display, const std::string& view)
{
    const ocio::DisplayViewTransformRcPtr transform = ocio::DisplayViewTransform::Create();
    transform->setSrc(space.c_str());
    transform->setDisplay(display.c_str());
    transform->setView(view.c_str());
    return config->getProcessor(transform)->getOptimizedCPUProcessor(ocio::BIT_DEPTH_F32, ocio::BIT_DEPTH_F32,
                                                                     ocio::OPTIMIZATION_DEFAULT);
}

void check_colour(const Image& image)
{
    if (image.channels < 3 || image.pixels.size() != static_cast<std::size_t>(image.width) *
                                                         static_cast<std::size_t>(image.height) *
                                                         static_cast<std::size_t>(image.channels)) {
        throw Error(ErrorCode::bad_argument, "the image to tone map has " + std::to_string(image.channels) +
                                                 " channels and " + std::to_string(image.pixels.size()) +
                                                 " values, expected RGB or RGBA");
    }
}

/// What every view can take: scaled, finite. NaN becomes black.
float scaled(float value, float scale)
{
    const float v = value * scale;
    return std::isnan(v) ? 0.0f : std::clamp(v, -kLargestInput, kLargestInput);
}

/// [0, 1]; NaN becomes 0.
float to_unit(float v) { return v > 0.0f ? std::min(v, 1.0f) : 0.0f; }

}  // namespace

ToneMapper::ToneMapper(const ToneMapOptions& options, const LogFunction& log) : impl_(std::make_unique<Impl>())
{
    if (options.exposure && !(std::abs(*options.exposure) <= kLargestExposure)) {
        throw Error(ErrorCode::bad_argument, "exposure is " + std::to_string(*options.exposure) +
                                                 " EV, expected a value in [-64, 64] or automatic");
    }
    impl_->exposure = options.exposure;
    const OcioLog forwarded(log);
    const NamedConfig named = open_config(options.ocio_config, options.one_file_only);
    const std::string where =
        named.name == "built-in" ? "the built-in OpenColorIO configuration" : "OpenColorIO configuration " + named.name;
    impl_->config_name = named.name;
    std::vector<std::string> displays, views;
    for (int i = 0; i < named.config->getNumDisplays(); ++i) {
        displays.emplace_back(named.config->getDisplay(i));
    }
    impl_->display = choose("display", options.display, named.config->getDefaultDisplay(), displays, where);
    const char* display = impl_->display.c_str();
    for (int i = 0; i < named.config->getNumViews(display); ++i) {
        views.emplace_back(named.config->getView(display, i));
    }
    impl_->view = choose("view", options.view, named.config->getDefaultView(display), views,
                         "display \"" + impl_->display + "\" of " + where);
    try {
        const std::string space = working_space(named.config, where, log);
        impl_->processor = make_processor(named.config, space, impl_->display, impl_->view);
    } catch (const ocio::Exception& e) {
        throw Error(ErrorCode::bad_file, where + " is refused: " + one_line(e.what()));
    }
}

ToneMapper::~ToneMapper() = default;
ToneMapper::ToneMapper(ToneMapper&&) noexcept = default;
ToneMapper& ToneMapper::operator=(ToneMapper&&) noexcept = default;

const std::string& ToneMapper::display() const noexcept { return impl_->display; }
const std::string& ToneMapper::view() const noexcept { return impl_->view; }
const std::string& ToneMapper::config_name() const noexcept { return impl_->config_name; }

float ToneMapper::exposure(const Image& beauty) const
{
    return impl_->exposure ? *impl_->exposure : automatic_exposure(beauty);
}

void ToneMapper::hold_exposure(std::optional<float> exposure) { impl_->exposure = exposure; }

Image ToneMapper::apply(const Image& beauty, ThreadPool& pool) const
{
    check_colour(beauty);
    const float scale = std::exp2(exposure(beauty));
    Image result(beauty.width, beauty.height, 3);
    const auto width = static_cast<std::size_t>(beauty.width);
    pool.parallel_for(
        static_cast<std::size_t>(beauty.height), kRowsPerChunk, [&](std::size_t begin, std::size_t end, int) {
            const float* from = beauty.at(0, static_cast<int>(begin));
            float* const rows = result.at(0, static_cast<int>(begin));
            const std::size_t count = (end - begin) * width;
            for (std::size_t i = 0; i < count; ++i, from += beauty.channels) {
                for (std::size_t c = 0; c < 3; ++c) {
                    rows[3 * i + c] = scaled(from[c], scale);
                }
            }
            ocio::PackedImageDesc pixels(rows, static_cast<long>(width), static_cast<long>(end - begin), 3);
            impl_->processor->apply(pixels);
            std::transform(rows, rows + 3 * count, rows, to_unit);
        });
    return result;
}

float automatic_exposure(const Image& beauty)
{
    check_colour(beauty);
    double sum = 0.0;
    std::size_t lit = 0;
    for (std::size_t i = 0; i < beauty.pixels.size(); i += static_cast<std::size_t>(beauty.channels)) {
        const float y = luminance({beauty.pixels[i], beauty.pixels[i + 1], beauty.pixels[i + 2]});
        if (y > 0.0f && std::isfinite(y)) {
            sum += std::log2(static_cast<double>(y));
            ++lit;
        }
    }
    if (lit == 0) {
        return 0.0f;
    }
    const double exposure = std::log2(0.18) - sum / static_cast<double>(lit);
    return std::clamp(static_cast<float>(exposure), -kLargestExposure, kLargestExposure);
}

}  // namespace rcs
