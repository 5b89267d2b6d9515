#include "view/frame_message.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <nlohmann/json.hpp>

#include "rcs/image_io.h"
#include "report/pictures.h"

namespace rcs::service {
namespace {

constexpr float kDark = 0.01f;                            // of the mean luminance, below which an error is not seen
constexpr float kBehind = 1.01f;                          // times the depth: farther records are hidden
constexpr int kMovingQuality = 80, kRestingQuality = 90;  // of a JPEG

float luminance_at(const Image& image, std::size_t pixel)
{
    const float* const p = image.pixels.data() + pixel * static_cast<std::size_t>(image.channels);
    return 0.2126f * p[0] + 0.7152f * p[1] + 0.0722f * p[2];
}

/// Standard error of each pixel over its luminance.
Image relative_error(const LayeredImage& image)
{
    const Image& beauty = image.layers.at("beauty");
    Image error(beauty.width, beauty.height, 1);
    double mean = 0.0;
    for (std::size_t i = 0; i < error.pixels.size(); ++i) mean += static_cast<double>(luminance_at(beauty, i));
    const float dark = kDark * static_cast<float>(mean / static_cast<double>(error.pixels.size()));
    for (const char* of : {"direct_error", "indirect_error"}) {
        const auto layer = image.layers.find(of);
        if (layer == image.layers.end()) continue;
        for (std::size_t i = 0; i < error.pixels.size(); ++i)
            error.pixels[i] = std::hypot(error.pixels[i], layer->second.pixels[i]);
    }
    for (std::size_t i = 0; i < error.pixels.size(); ++i) {
        const float light = luminance_at(beauty, i) + dark;
        error.pixels[i] = light > 0.0f ? error.pixels[i] / light : 0.0f;
    }
    return error;
}

/// A layer that may not be there, where there is no such light.
Image layer_or_black(const LayeredImage& image, const char* name)
{
    const auto found = image.layers.find(name);
    if (found != image.layers.end()) return found->second;
    const Image& beauty = image.layers.at("beauty");
    return Image(beauty.width, beauty.height, 3);
}

std::vector<Record> in_sight(const ViewPicture& picture, const std::vector<Record>& records)
{
    const Image& depth = picture.image.layers.at("depth");
    const glm::dvec3 eye = camera_position(picture.view.camera);
    std::vector<Record> seen;
    for (const Record& r : records) {
        const glm::dvec3 relative = glm::dvec3(r.position) - eye;
        const auto at = image_position(picture.view, relative);
        if (!at || !(at->x >= 0.0 && at->y >= 0.0 && at->x < depth.width && at->y < depth.height)) continue;
        const float nearest = *depth.at(static_cast<int>(at->x), static_cast<int>(at->y));
        if (glm::length(relative) > static_cast<double>(kBehind * nearest)) continue;
        Record& dot = seen.emplace_back();
        dot.position = r.position;
    }
    return seen;
}

const char* name_of(Progress progress)
{
    switch (progress) {
        case Progress::moving:
            return "moving";
        case Progress::refining:
            return "refining";
        case Progress::done:
            break;
    }
    return "done";
}

}  // namespace

Image develop(const ViewPicture& picture, const Look& look, const std::vector<Record>& records, ToneMapper& mapper,
              ThreadPool& pool)
{
    const Image& beauty = picture.image.layers.at("beauty");
    mapper.hold_exposure(look.exposure ? std::optional(static_cast<float>(*look.exposure)) : std::nullopt);
    if (look.layer == ViewLayer::error) return difference_picture(relative_error(picture.image));
    if (look.layer == ViewLayer::picture) return mapper.apply(beauty, pool);
    // Parts of the light are exposed as all of it.
    mapper.hold_exposure(mapper.exposure(beauty));
    if (look.layer == ViewLayer::records)
        return records_picture(mapper.apply(beauty, pool), picture.view, in_sight(picture, records));
    return mapper.apply(layer_or_black(picture.image, look.layer == ViewLayer::direct ? "direct" : "indirect"), pool);
}

std::string frame_message(const ViewPicture& picture, const Look& look, std::uint64_t frame, std::size_t records,
                          const std::string& command, const Image& display, float exposure)
{
    const bool exact = picture.progress == Progress::done;
    ImageFileOptions options;
    options.jpeg_quality = picture.progress == Progress::moving ? kMovingQuality : kRestingQuality;
    const std::string file = display_image_bytes(exact ? "frame.png" : "frame.jpg", display, options);
    const nlohmann::ordered_json header = {{"frame", frame},
                                           {"look", look.number},
                                           {"layer", name_of(look.layer)},
                                           {"progress", name_of(picture.progress)},
                                           {"error", picture.error},
                                           {"indirect_error", picture.indirect_error},
                                           {"filled", picture.filled},
                                           {"records", records},
                                           {"seconds", picture.seconds},
                                           {"width", display.width},
                                           {"height", display.height},
                                           {"exposure", exposure},
                                           {"type", exact ? "image/png" : "image/jpeg"},
                                           {"command", command}};
    const std::string text = header.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
    std::string message;
    message.reserve(4 + text.size() + file.size());
    for (int shift = 24; shift >= 0; shift -= 8) message += static_cast<char>(text.size() >> shift & 0xff);
    return message.append(text).append(file);
}

std::optional<glm::dvec3> point_at(const ViewPicture& picture, const Pick& pick)
{
    const auto layer = picture.image.layers.find("depth");
    if (layer == picture.image.layers.end()) return std::nullopt;
    const Image& depth = layer->second;
    const double x = pick.x * depth.width, y = pick.y * depth.height;
    const float distance =
        *depth.at(std::min(static_cast<int>(x), depth.width - 1), std::min(static_cast<int>(y), depth.height - 1));
    if (!std::isfinite(distance)) return std::nullopt;
    const CameraRay ray = camera_ray(picture.view, x, y);
    return ray.origin + static_cast<double>(distance) * glm::normalize(ray.direction);
}

}  // namespace rcs::service
