#include "scene/environment.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "util/color.h"

namespace rcs {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kSphereOfUv = 2.0f * kPi * kPi;  // solid angle = this x sin(theta) x area in uv

// How far above its own mean the soft part may rise: a hemisphere of 512 rays of which each is off by so much has
// an error of sqrt(8 / 512), 12 %, before stratification.
constexpr double kThresholdOverMean = 8.0;

// The small image's texels are 1.4 degrees wide: a tenth of a gather ray's cone.
constexpr int kSoftWidth = 256;
constexpr int kSoftHeight = 128;

constexpr float kBelowOne = 0x1.fffffep-1f;

/// Offset in (-1, 1) with the density of a tent.
float sample_tent(float u) { return u < 0.5f ? std::sqrt(2.0f * u) - 1.0f : 1.0f - std::sqrt(2.0f - 2.0f * u); }

/// The entry of a running sum that `u` of its total falls into. @param rest  what is left of u inside it, in [0, 1)
std::size_t find_share(const std::vector<double>& cdf, std::size_t begin, std::size_t end, float u, float& rest)
{
    const double before = begin > 0 ? cdf[begin - 1] : 0.0;
    const double target = before + static_cast<double>(u) * (cdf[end - 1] - before);
    const auto first = cdf.begin();
    const auto found = std::upper_bound(first + static_cast<std::ptrdiff_t>(begin),
                                        first + static_cast<std::ptrdiff_t>(end) - 1, target);
    const std::size_t i = static_cast<std::size_t>(found - first);
    const double below = i > 0 ? cdf[i - 1] : 0.0;
    rest = cdf[i] > below ? std::clamp(static_cast<float>((target - below) / (cdf[i] - below)), 0.0f, kBelowOne) : 0.5f;
    return i;
}

float sine_at(float v) { return std::max(std::sin(kPi * v), 1e-7f); }

}  // namespace

/// The four texels of a bilinear lookup.
struct Environment::Footprint {
    std::size_t i00, i10, i01, i11;
    int row0, row1;
    float fx, fy;

    // a + f (b - a) gives a constant image back bit by bit.
    template <typename Value>
    Value mix(const Value& a00, const Value& a10, const Value& a01, const Value& a11) const
    {
        const Value top = a00 + fx * (a10 - a00);
        const Value bottom = a01 + fx * (a11 - a01);
        return top + fy * (bottom - top);
    }
};

Environment::Environment(const Scene& scene) : constant_(scene.sky_radiance)
{
    const EnvironmentImage& image = scene.environment;
    if (!image.empty()) {
        image_ = &image;
        turn_ = static_cast<float>(image.rotation / (2.0 * std::numbers::pi));
        for (int y = 0; y < image.height; ++y)
            sine_.push_back(sine_at((static_cast<float>(y) + 0.5f) / static_cast<float>(image.height)));
        choose_threshold();
        build_peaks();
    }
    build_soft();
}

Environment::Footprint Environment::footprint(glm::vec2 uv, int width, int height) const
{
    const float x = uv.x * static_cast<float>(width) - 0.5f;
    const float y = std::clamp(uv.y * static_cast<float>(height) - 0.5f, 0.0f, static_cast<float>(height - 1));
    const float floor_x = std::floor(x);
    const int x0 = (static_cast<int>(floor_x) + width) % width;
    const int x1 = (x0 + 1) % width;
    const int y0 = std::min(static_cast<int>(y), height - 1);
    const int y1 = std::min(y0 + 1, height - 1);
    const auto index = [&](int px, int py) {
        return static_cast<std::size_t>(py) * static_cast<std::size_t>(width) + static_cast<std::size_t>(px);
    };
    return {
        index(x0, y0), index(x1, y0), index(x0, y1), index(x1, y1), y0, y1, x - floor_x, y - static_cast<float>(y0)};
}

/// Turning the sky counter-clockwise by an angle turns what is looked up clockwise, towards growing u.
glm::vec2 Environment::uv_of(glm::vec3 d) const
{
    const float u = 0.5f + std::atan2(d.x, -d.z) / (2.0f * kPi) + turn_;
    // atan2 keeps its digits near the poles, where acos loses them.
    const float v = std::atan2(std::hypot(d.x, d.z), d.y) / kPi;
    return {u - std::floor(u), v};
}

glm::vec3 Environment::direction_of(glm::vec2 uv) const
{
    const float azimuth = 2.0f * kPi * (uv.x - turn_ - 0.5f);
    const float theta = kPi * uv.y;
    const float sine = std::sin(theta);
    return {sine * std::sin(azimuth), std::cos(theta), -sine * std::cos(azimuth)};
}

glm::vec3 Environment::soft_texel(std::size_t i) const
{
    const glm::vec3 value = image_->radiance[i];
    const float m = largest(value);
    return m > threshold_ ? value * (threshold_ / m) : value;
}

glm::vec3 Environment::peak_texel(std::size_t i) const
{
    const glm::vec3 value = image_->radiance[i];
    const float m = largest(value);
    return m > threshold_ ? value * (1.0f - threshold_ / m) : glm::vec3(0.0f);
}

float Environment::peak_weight(std::size_t i, int row) const
{
    return luminance(peak_texel(i)) * sine_[static_cast<std::size_t>(row)];
}

void Environment::choose_threshold()
{
    // A histogram of octaves, each in 8 parts, with the mean of what is in a part: one pass over the image.
    constexpr int kParts = 8, kBins = 256 * kParts;
    std::vector<double> area(kBins, 0.0), sum(kBins, 0.0);
    const std::size_t width = static_cast<std::size_t>(image_->width);
    double total_area = 0.0;
    float brightest = 0.0f;
    for (std::size_t i = 0; i < image_->radiance.size(); ++i) {
        const float m = largest(image_->radiance[i]);
        const double w = static_cast<double>(sine_[i / width]);
        total_area += w;
        if (!(m > 0.0f)) continue;
        int exponent = 0;
        const float mantissa = std::frexp(m, &exponent);  // in [0.5, 1)
        const int bin =
            std::clamp((exponent + 127) * kParts + static_cast<int>((mantissa - 0.5f) * 2.0f * kParts), 0, kBins - 1);
        area[static_cast<std::size_t>(bin)] += w;
        sum[static_cast<std::size_t>(bin)] += w * static_cast<double>(m);
        brightest = std::max(brightest, m);
    }
    const auto clipped_mean = [&](double c) {
        double result = 0.0;
        for (std::size_t b = 0; b < area.size(); ++b) result += std::min(sum[b], c * area[b]);
        return result / total_area;
    };
    // The mean of min(L, c) is concave in c: from above, the iteration falls to the largest fixed point, or to 0.
    double c = static_cast<double>(brightest);
    for (int i = 0; i < 200; ++i) {
        const double next = kThresholdOverMean * clipped_mean(c);
        if (next >= c) break;
        const bool settled = next > 0.999 * c;
        c = next;
        if (settled) break;
    }
    constexpr double kNothing = 1e-6;
    threshold_ = c > kNothing * static_cast<double>(brightest) ? static_cast<float>(c) : 0.0f;
}

void Environment::build_peaks()
{
    const std::size_t width = static_cast<std::size_t>(image_->width);
    const float inverse_width = 1.0f / static_cast<float>(image_->width),
                inverse_height = 1.0f / static_cast<float>(image_->height);
    glm::dvec3 axis(0.0);
    double sines = 0.0;
    const auto centre = [&](std::uint32_t column, int row) {
        return direction_of(
            {(static_cast<float>(column) + 0.5f) * inverse_width, (static_cast<float>(row) + 0.5f) * inverse_height});
    };
    row_first_.push_back(0);
    for (int y = 0; y < image_->height; ++y) {
        for (std::size_t x = 0; x < width; ++x) {
            const float w = peak_weight(static_cast<std::size_t>(y) * width + x, y);
            if (!(w > 0.0f)) continue;
            sines += static_cast<double>(sine_[static_cast<std::size_t>(y)]);
            column_.push_back(static_cast<std::uint32_t>(x));
            peak_cdf_.push_back(peak_weight_ += static_cast<double>(w));
            axis += static_cast<double>(w) * glm::dvec3(centre(column_.back(), y));
        }
        row_first_.push_back(static_cast<std::uint32_t>(column_.size()));
    }
    if (!has_peaks()) return;
    const double texels = static_cast<double>(image_->radiance.size());
    peak_flux_ = static_cast<float>(peak_weight_ * static_cast<double>(kSphereOfUv) / texels);
    peak_solid_angle_ = static_cast<float>(sines * static_cast<double>(kSphereOfUv) / texels);
    peak_axis_ = glm::length(axis) > 0.0 ? glm::vec3(glm::normalize(axis)) : glm::vec3(0.0f, 1.0f, 0.0f);
    float least = 1.0f;
    for (int y = 0; y < image_->height; ++y)
        for (std::uint32_t i = row_first_[static_cast<std::size_t>(y)]; i < row_first_[static_cast<std::size_t>(y) + 1];
             ++i)
            least = std::min(least, glm::dot(peak_axis_, centre(column_[i], y)));
    // Tents reach one texel farther than centres.
    const float reach = 1.5f * kPi * std::max(2.0f * inverse_width, inverse_height);
    peak_cone_ = std::acos(std::clamp(least, -1.0f, 1.0f)) + reach;
}

/// Box filtered with the solid angle of each texel. The cells of the small image that sampling uses are spheres'
/// rectangles; each gets a tenth of the mean as well, for what a lookup between texels finds where a cell has none.
void Environment::build_soft()
{
    soft_width_ = has_image() ? std::min(kSoftWidth, image_->width) : 1;
    soft_height_ = has_image() ? std::min(kSoftHeight, image_->height) : 1;
    const std::size_t cells = static_cast<std::size_t>(soft_width_) * static_cast<std::size_t>(soft_height_);
    soft_.assign(cells, glm::vec3(0.0f));
    if (has_image()) {
        std::vector<glm::dvec3> sum(cells, glm::dvec3(0.0));
        std::vector<double> area(cells, 0.0);
        for (int y = 0; y < image_->height; ++y) {
            const int cell_y = static_cast<int>(static_cast<std::int64_t>(y) * soft_height_ / image_->height);
            const double w = static_cast<double>(sine_[static_cast<std::size_t>(y)]);
            for (int x = 0; x < image_->width; ++x) {
                const int cell_x = static_cast<int>(static_cast<std::int64_t>(x) * soft_width_ / image_->width);
                const std::size_t cell = static_cast<std::size_t>(cell_y) * static_cast<std::size_t>(soft_width_) +
                                         static_cast<std::size_t>(cell_x);
                const std::size_t i =
                    static_cast<std::size_t>(y) * static_cast<std::size_t>(image_->width) + static_cast<std::size_t>(x);
                sum[cell] += w * glm::dvec3(soft_texel(i));
                area[cell] += w;
            }
        }
        for (std::size_t i = 0; i < cells; ++i) soft_[i] = glm::vec3(sum[i] / area[i]);
    }
    double mean = 0.0, sphere = 0.0;
    const auto solid_angle = [&](std::size_t cell) {
        const double y = static_cast<double>(cell / static_cast<std::size_t>(soft_width_));
        const double h = std::numbers::pi / soft_height_;
        return 2.0 * std::numbers::pi / soft_width_ * (std::cos(y * h) - std::cos((y + 1.0) * h));
    };
    const auto brightness = [&](std::size_t cell) { return static_cast<double>(luminance(constant_ + soft_[cell])); };
    for (std::size_t i = 0; i < cells; ++i) {
        mean += brightness(i) * solid_angle(i);
        sphere += solid_angle(i);
    }
    mean /= sphere;
    double running = 0.0;
    for (std::size_t i = 0; i < cells; ++i)
        soft_cdf_.push_back(running += (brightness(i) + 0.1 * mean) * solid_angle(i));
    const float soft_flux = static_cast<float>(mean * sphere);
    if (!has_peaks())
        peak_share_ = 0.0f;
    else
        peak_share_ = soft_flux > 0.0f ? std::clamp(peak_flux_ / (peak_flux_ + soft_flux), 0.1f, 0.9f) : 1.0f;
}

glm::vec3 Environment::radiance(glm::vec3 direction) const
{
    if (!has_image()) return constant_;
    const Footprint f = footprint(uv_of(direction), image_->width, image_->height);
    const std::vector<glm::vec3>& l = image_->radiance;
    return constant_ + f.mix(l[f.i00], l[f.i10], l[f.i01], l[f.i11]);
}

glm::vec3 Environment::soft(glm::vec3 direction) const
{
    if (!has_image()) return constant_;
    const Footprint f = footprint(uv_of(direction), image_->width, image_->height);
    return constant_ + f.mix(soft_texel(f.i00), soft_texel(f.i10), soft_texel(f.i01), soft_texel(f.i11));
}

glm::vec3 Environment::peak(glm::vec3 direction) const
{
    if (!has_peaks()) return glm::vec3(0.0f);
    const Footprint f = footprint(uv_of(direction), image_->width, image_->height);
    return f.mix(peak_texel(f.i00), peak_texel(f.i10), peak_texel(f.i01), peak_texel(f.i11));
}

glm::vec3 Environment::soft_blurred(glm::vec3 direction) const
{
    if (!has_image()) return constant_;
    const Footprint f = footprint(uv_of(direction), soft_width_, soft_height_);
    return constant_ + f.mix(soft_[f.i00], soft_[f.i10], soft_[f.i01], soft_[f.i11]);
}

float Environment::peak_density(glm::vec3 direction) const
{
    if (!has_peaks()) return 0.0f;
    const glm::vec2 uv = uv_of(direction);
    const Footprint f = footprint(uv, image_->width, image_->height);
    const float w = f.mix(peak_weight(f.i00, f.row0), peak_weight(f.i10, f.row0), peak_weight(f.i01, f.row1),
                          peak_weight(f.i11, f.row1));
    return w / (sine_at(uv.y) * peak_flux_);
}

Environment::Sample Environment::sample_peak(glm::vec2 u) const
{
    if (!has_peaks()) return {};
    // The row by u.y: whole rows are neighbours in the running sum.
    float in_row = 0.0f, in_column = 0.0f, unused = 0.0f;
    const std::size_t any = find_share(peak_cdf_, 0, peak_cdf_.size(), u.y, unused);
    const auto after = std::upper_bound(row_first_.begin(), row_first_.end(), static_cast<std::uint32_t>(any));
    const std::size_t row = static_cast<std::size_t>(after - row_first_.begin()) - 1;
    const std::size_t begin = row_first_[row], end = row_first_[row + 1];
    const double below = begin > 0 ? peak_cdf_[begin - 1] : 0.0;
    in_row =
        std::clamp(static_cast<float>((static_cast<double>(u.y) * peak_weight_ - below) / (peak_cdf_[end - 1] - below)),
                   0.0f, kBelowOne);
    const std::size_t texel = find_share(peak_cdf_, begin, end, u.x, in_column);

    const float x =
        (static_cast<float>(column_[texel]) + 0.5f + sample_tent(in_column)) / static_cast<float>(image_->width);
    const float y = (static_cast<float>(row) + 0.5f + sample_tent(in_row)) / static_cast<float>(image_->height);
    // Mirrored at the poles, the tents of the last rows add up to what clamping looks up.
    const float v = y < 0.0f ? -y : y > 1.0f ? 2.0f - y : y;
    Sample s;
    s.direction = direction_of({x, v});
    s.radiance = peak(s.direction);
    s.density = peak_density(s.direction);
    return s;
}

float Environment::density(glm::vec3 direction) const
{
    const glm::vec2 uv = uv_of(direction);
    const int x = std::min(static_cast<int>(uv.x * static_cast<float>(soft_width_)), soft_width_ - 1);
    const int y = std::min(static_cast<int>(uv.y * static_cast<float>(soft_height_)), soft_height_ - 1);
    const std::size_t cell =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(soft_width_) + static_cast<std::size_t>(x);
    const double share =
        (soft_cdf_[cell] - (cell > 0 ? soft_cdf_[cell - 1] : 0.0)) / std::max(soft_cdf_.back(), 1e-300);
    const double h = std::numbers::pi / soft_height_;
    const double solid_angle = 2.0 * std::numbers::pi / soft_width_ * (std::cos(y * h) - std::cos((y + 1) * h));
    return (1.0f - peak_share_) * static_cast<float>(share / solid_angle) + peak_share_ * peak_density(direction);
}

Environment::Sample Environment::sample(glm::vec2 u) const
{
    if (is_black()) return {};
    Sample s;
    if (u.x < peak_share_) {
        s = sample_peak({std::min(u.x / peak_share_, kBelowOne), u.y});
    } else {
        float across = 0.0f;
        const float rest = std::min((u.x - peak_share_) / (1.0f - peak_share_), kBelowOne);
        const std::size_t cell = find_share(soft_cdf_, 0, soft_cdf_.size(), rest, across);
        const std::size_t width = static_cast<std::size_t>(soft_width_);
        const double h = std::numbers::pi / soft_height_;
        const double y = static_cast<double>(cell / width);
        const double cosine = std::cos(y * h) + static_cast<double>(u.y) * (std::cos((y + 1.0) * h) - std::cos(y * h));
        const float v = static_cast<float>(std::acos(std::clamp(cosine, -1.0, 1.0)) / std::numbers::pi);
        s.direction = direction_of({(static_cast<float>(cell % width) + across) / static_cast<float>(soft_width_), v});
    }
    s.radiance = radiance(s.direction);
    s.density = density(s.direction);
    return s;
}

float Environment::peak_estimate(glm::vec3 normal) const
{
    const float angle = std::acos(std::clamp(glm::dot(normal, peak_axis_), -1.0f, 1.0f)) - peak_cone_;
    return angle < 0.5f * kPi ? peak_flux_ * std::cos(std::max(angle, 0.0f)) : 0.0f;
}

}  // namespace rcs
