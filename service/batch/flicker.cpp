#include "batch/flicker.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include <glm/glm.hpp>
#include <glm/gtc/type_ptr.hpp>

#include "rcs/error.h"
#include "rcs/metrics.h"

namespace rcs::service {
namespace {

// A point that lies this much farther away than what shows where it came from was hidden there; pixels around it that
// lie as much apart show different things.
constexpr float kHidden = 0.05f;
// Pixels around it whose surfaces face so far apart show different light, however still it is: cosine of 15 degrees.
// Mouldings as fine as pixels (Sibenik, 256 x 144), under light that the normal alone tells, else flicker by 1.4 % in
// the median, and by .03 % with it; by .04 with 30 degrees, .03 with 10.
const float kSameWay = std::cos(glm::radians(15.0f));

float luminance_at(const Image& image, int x, int y)
{
    const float* p = image.at(x, y);
    return image.channels < 3 ? p[0] : 0.2126f * p[0] + 0.7152f * p[1] + 0.0722f * p[2];
}

/// Pixels between whose centres a place lies.
struct Between {
    int x, y, right, low;

    std::array<const float*, 4> of(const Image& image) const
    {
        return {image.at(x, y), image.at(right, y), image.at(x, low), image.at(right, low)};
    }
};

bool lie_together(const std::array<const float*, 4>& depths)
{
    const auto [nearest, farthest] = std::minmax({*depths[0], *depths[1], *depths[2], *depths[3]});
    return farthest - nearest <= kHidden * farthest;
}

bool face_one_way(const std::array<const float*, 4>& normals)
{
    for (std::size_t i = 1; i < normals.size(); ++i)
        for (std::size_t k = 0; k < i; ++k)
            if (!(glm::dot(glm::make_vec3(normals[i]), glm::make_vec3(normals[k])) >= kSameWay)) return false;
    return true;
}

/// Between the centres of four pixels; none outside of them, where a value is not finite, or where they show things
/// that lie apart or face different ways: what is between those is nothing that could be followed.
std::optional<double> sample(const FlickerFrame& frame, glm::dvec2 at)
{
    const Image& image = frame.light;
    const glm::dvec2 corner = glm::floor(at - 0.5), part = at - 0.5 - corner;
    const int x = static_cast<int>(corner.x), y = static_cast<int>(corner.y);
    const int right = part.x > 0.0 ? x + 1 : x, low = part.y > 0.0 ? y + 1 : y;
    if (x < 0 || y < 0 || right >= image.width || low >= image.height) return std::nullopt;
    const Between pixels{x, y, right, low};
    if (frame.motion && frame.depth && !lie_together(pixels.of(*frame.depth))) return std::nullopt;
    if (frame.motion && frame.normal && !face_one_way(pixels.of(*frame.normal))) return std::nullopt;
    const auto value = [&](int u, int v) { return static_cast<double>(luminance_at(image, u, v)); };
    const double upper = glm::mix(value(x, y), value(right, y), part.x);
    const double lower = glm::mix(value(x, low), value(right, low), part.x);
    const double mixed = glm::mix(upper, lower, part.y);
    return std::isfinite(mixed) ? std::optional(mixed) : std::nullopt;
}

/// Where a point of `after` was in `before`; none where it was hidden or out of the picture.
std::optional<glm::dvec2> came_from(const FlickerFrame& before, const FlickerFrame& after, glm::dvec2 at)
{
    if (!after.motion) return at;
    const int x = static_cast<int>(at.x), y = static_cast<int>(at.y);
    const float* moved = after.motion->at(x, y);
    const glm::dvec2 from(at.x - moved[0], at.y + moved[1]);  // Y counts up in the layer, down here
    const Image& light = before.light;
    if (!(from.x >= 0.0 && from.y >= 0.0 && from.x < light.width && from.y < light.height)) return std::nullopt;
    if (before.depth && after.depth) {
        const float was = *before.depth->at(static_cast<int>(from.x), static_cast<int>(from.y));
        const float is = *after.depth->at(x, y);
        if (!(std::abs(was - is) <= kHidden * std::max(was, is))) return std::nullopt;
    }
    return from;
}

double mean_of(const Image& image)
{
    double sum = 0.0;
    std::size_t count = 0;
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            const float value = luminance_at(image, x, y);
            if (!std::isfinite(value)) continue;
            sum += static_cast<double>(value);
            ++count;
        }
    }
    return count > 0 ? sum / static_cast<double>(count) : 0.0;
}

/// The values of a point of the last frame in all frames, last one first; empty where it does not show in one.
std::vector<double> track(const std::vector<FlickerFrame>& frames, glm::dvec2 at)
{
    std::vector<double> values;
    for (std::size_t i = frames.size(); i-- > 0;) {
        const auto value = sample(frames[i], at);
        if (!value) return {};
        values.push_back(*value);
        if (i == 0) break;
        const auto from = came_from(frames[i - 1], frames[i], at);
        if (!from) return {};
        at = *from;
    }
    return values;
}

double mean_of(const std::vector<double>& values)
{
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Standard deviation over mean.
double spread(const std::vector<double>& values, double floor)
{
    const double mean = mean_of(values);
    double squares = 0.0;
    for (const double value : values) squares += (value - mean) * (value - mean);
    const double variance = squares / static_cast<double>(values.size() - 1);
    return mean + floor > 0.0 ? std::sqrt(variance) / (mean + floor) : 0.0;
}

/// The same of what differs from the mean of its neighbours in time.
double sudden_spread(const std::vector<double>& values, double floor)
{
    // Of independent values that has so many times their variance.
    constexpr double kOfDifference = 1.5;
    double squares = 0.0;
    for (std::size_t i = 1; i + 1 < values.size(); ++i) {
        const double off = values[i] - 0.5 * (values[i - 1] + values[i + 1]);
        squares += off * off;
    }
    const double mean = mean_of(values);
    const double variance = squares / (kOfDifference * static_cast<double>(values.size() - 2));
    return mean + floor > 0.0 ? std::sqrt(variance) / (mean + floor) : 0.0;
}

/// @param spreads  one or more
Deviations deviations(std::vector<double> spreads)
{
    std::sort(spreads.begin(), spreads.end());
    const double last = static_cast<double>(spreads.size() - 1);
    const auto at = [&](double part) { return spreads[static_cast<std::size_t>(part * last + 0.5)]; };
    return {mean_of(spreads), at(0.5), at(0.95)};
}

template <typename Use>
void for_each_pixel(const Image& image, const Use& use)
{
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) use(glm::dvec2(x + 0.5, y + 0.5));
}

}  // namespace

FlickerFrame flicker_frame(const LayeredImage& picture, const std::string& layer)
{
    const auto take = [&](const std::string& name, int channels) {
        const auto found = picture.layers.find(name);
        const bool serves = found != picture.layers.end() && found->second.channels >= channels;
        return serves ? std::optional(found->second) : std::nullopt;
    };
    return {picture.layers.at(layer), take("motion", 2), take("depth", 1), take("normal", 3)};
}

std::optional<double> change_between(const FlickerFrame& before, const FlickerFrame& after)
{
    const double floor = kRelativeErrorFloor * mean_of(after.light);
    double sum = 0.0;
    std::size_t points = 0;
    for_each_pixel(after.light, [&](glm::dvec2 at) {
        const auto from = came_from(before, after, at);
        const auto was = from ? sample(before, *from) : std::nullopt, is = sample(after, at);
        if (!was || !is) return;
        const double scale = 0.5 * (*was + *is) + floor;
        sum += scale > 0.0 ? std::abs(*is - *was) / (std::sqrt(2.0) * scale) : 0.0;
        ++points;
    });
    return points > 0 ? std::optional(sum / static_cast<double>(points)) : std::nullopt;
}

Flicker measure_flicker(const std::vector<FlickerFrame>& frames)
{
    if (frames.size() < 2) throw Error(ErrorCode::bad_argument, "flicker needs two frames or more");
    const Image& last = frames.back().light;
    for (const FlickerFrame& frame : frames)
        if (frame.light.width != last.width || frame.light.height != last.height)
            throw Error(ErrorCode::bad_argument, "the frames are of different sizes");
    Flicker flicker;
    const double floor = kRelativeErrorFloor * mean_of(last);
    std::vector<double> spreads, sudden;
    for_each_pixel(last, [&](glm::dvec2 at) {
        const std::vector<double> values = track(frames, at);
        if (values.empty()) return;
        spreads.push_back(spread(values, floor));
        if (values.size() > 2) sudden.push_back(sudden_spread(values, floor));
    });
    for (std::size_t i = 1; i < frames.size(); ++i) flicker.steps.push_back(change_between(frames[i - 1], frames[i]));
    flicker.points = spreads.size();
    if (!spreads.empty()) flicker.all = deviations(std::move(spreads));
    if (!sudden.empty()) flicker.sudden = deviations(std::move(sudden));
    return flicker;
}

}  // namespace rcs::service
