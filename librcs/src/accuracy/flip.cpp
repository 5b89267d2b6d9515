#include "accuracy/flip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace rcs {
namespace {

using std::numbers::pi;

constexpr double kPixelsPerDegree = 0.7 * (3840.0 / 0.7) * (pi / 180.0);

/// One channel of a picture.
struct Plane {
    int width = 0, height = 0;
    std::vector<double> values;

    Plane(int w, int h) : width(w), height(h), values(static_cast<std::size_t>(w) * static_cast<std::size_t>(h)) {}
};
using Color = std::array<double, 3>;
using Planes = std::array<Plane, 3>;

Planes planes_like(const Plane& p)
{
    return {Plane(p.width, p.height), Plane(p.width, p.height), Plane(p.width, p.height)};
}

Color color_at(const Planes& p, std::size_t i) { return {p[0].values[i], p[1].values[i], p[2].values[i]}; }

/// sRGB's primaries and D65, with the sums of rows as reference white.
constexpr double kXyzFromRgb[3][3] = {{10135552.0 / 24577794.0, 8788810.0 / 24577794.0, 4435075.0 / 24577794.0},
                                      {2613072.0 / 12288897.0, 8788810.0 / 12288897.0, 887015.0 / 12288897.0},
                                      {1425312.0 / 73733382.0, 8788810.0 / 73733382.0, 70074185.0 / 73733382.0}};

double white(int row) { return kXyzFromRgb[row][0] + kXyzFromRgb[row][1] + kXyzFromRgb[row][2]; }

/// X, Y, Z over those of white.
Color xyz_of(const Color& rgb)
{
    Color xyz{};
    for (int row = 0; row < 3; ++row)
        for (int c = 0; c < 3; ++c)
            xyz[static_cast<std::size_t>(row)] += kXyzFromRgb[row][c] * rgb[static_cast<std::size_t>(c)] / white(row);
    return xyz;
}

/// Inverse of xyz_of(), by Cramer's rule.
Color rgb_of(const Color& xyz)
{
    double m[3][3];
    for (int row = 0; row < 3; ++row)
        for (int c = 0; c < 3; ++c) m[row][c] = kXyzFromRgb[row][c] / white(row);
    const auto minor = [&](int r, int c) {
        const int r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
        return m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
    };
    const double determinant = m[0][0] * minor(0, 0) + m[0][1] * minor(0, 1) + m[0][2] * minor(0, 2);
    Color rgb{};
    for (int c = 0; c < 3; ++c)
        for (int row = 0; row < 3; ++row)
            rgb[static_cast<std::size_t>(c)] += minor(row, c) / determinant * xyz[static_cast<std::size_t>(row)];
    return rgb;
}

/// Opponent colours that are linear in light: luminance, red to green, blue to yellow.
Color ycxcz_of(const Color& rgb)
{
    const Color xyz = xyz_of(rgb);
    return {116.0 * xyz[1] - 16.0, 500.0 * (xyz[0] - xyz[1]), 200.0 * (xyz[1] - xyz[2])};
}

Color rgb_of_ycxcz(const Color& ycxcz)
{
    const double y = (ycxcz[0] + 16.0) / 116.0;
    return rgb_of({y + ycxcz[1] / 500.0, y, y - ycxcz[2] / 200.0});
}

/// CIELAB, with chroma that fades with lightness (Hunt's effect).
Color hunt_lab_of(const Color& rgb)
{
    Color f = xyz_of(rgb);
    constexpr double kDelta = 6.0 / 29.0;
    for (double& v : f) v = v > kDelta * kDelta * kDelta ? std::cbrt(v) : v / (3.0 * kDelta * kDelta) + 4.0 / 29.0;
    const double lightness = 116.0 * f[1] - 16.0;
    return {lightness, 0.01 * lightness * 500.0 * (f[0] - f[1]), 0.01 * lightness * 200.0 * (f[1] - f[2])};
}

double hyab(const Color& a, const Color& b) { return std::abs(a[0] - b[0]) + std::hypot(a[1] - b[1], a[2] - b[2]); }

/// Weights for offsets -n to n.
using Kernel = std::vector<double>;

template <typename Weight>
Kernel make_kernel(int reach, const Weight& weight)
{
    Kernel kernel;
    for (int x = -reach; x <= reach; ++x) kernel.push_back(weight(static_cast<double>(x)));
    return kernel;
}

/// Scales positive weights to a sum of 1 and negative ones to -1.
Kernel normalised(Kernel kernel)
{
    double positive = 0.0, negative = 0.0;
    for (const double w : kernel) (w > 0.0 ? positive : negative) += std::abs(w);
    for (double& w : kernel) w /= w > 0.0 ? positive : negative > 0.0 ? negative : 1.0;
    return kernel;
}

/// Filters along one axis; beyond its edge the picture goes on as it ends.
Plane filter_along(const Plane& p, const Kernel& kernel, bool along_x)
{
    Plane out(p.width, p.height);
    const int reach = static_cast<int>(kernel.size() / 2), last = (along_x ? p.width : p.height) - 1;
    const std::size_t step = along_x ? 1 : static_cast<std::size_t>(p.width);
    for (int y = 0; y < p.height; ++y) {
        for (int x = 0; x < p.width; ++x) {
            const int at = along_x ? x : y;
            const std::size_t i =
                static_cast<std::size_t>(y) * static_cast<std::size_t>(p.width) + static_cast<std::size_t>(x);
            const std::size_t line = i - static_cast<std::size_t>(at) * step;
            double sum = 0.0;
            for (int k = -reach; k <= reach; ++k)
                sum += kernel[static_cast<std::size_t>(k + reach)] *
                       p.values[line + static_cast<std::size_t>(std::clamp(at + k, 0, last)) * step];
            out.values[i] = sum;
        }
    }
    return out;
}

Plane filter(const Plane& p, const Kernel& along_x, const Kernel& along_y)
{
    return filter_along(filter_along(p, along_x, true), along_y, false);
}

/// Contrast that the eye resolves in one opponent channel: a sum of Gaussians of spatial frequency.
struct Sensitivity {
    double a1, b1, a2, b2;
};
constexpr Sensitivity kSensitivity[3] = {{1.0, 0.0047, 0.0, 1e-5}, {1.0, 0.0053, 0.0, 1e-5}, {34.1, 0.04, 13.5, 0.025}};
constexpr double kWidest = 0.04;

Plane as_resolved(const Plane& p, const Sensitivity& s)
{
    const int reach = static_cast<int>(std::ceil(3.0 * std::sqrt(kWidest / (2.0 * pi * pi)) * kPixelsPerDegree));
    Plane out(p.width, p.height);
    double total = 0.0;
    for (const auto& [a, b] : {std::pair(s.a1, s.b1), std::pair(s.a2, s.b2)}) {
        if (a == 0.0) continue;
        const Kernel bell = make_kernel(reach, [b = b](double x) {
            const double degrees = x / kPixelsPerDegree;
            return std::exp(-pi * pi * degrees * degrees / b);
        });
        double sum = 0.0;
        for (const double w : bell) sum += w;
        const double share = a * std::sqrt(pi / b) * sum * sum;
        const Plane part = filter(p, normalised(bell), normalised(bell));
        for (std::size_t i = 0; i < out.values.size(); ++i) out.values[i] += share * part.values[i];
        total += share;
    }
    for (double& v : out.values) v /= total;
    return out;
}

constexpr double kColorPower = 0.7, kKneeIn = 0.4, kKneeOut = 0.95, kFeaturePower = 0.5;

/// Most of the range is for differences up to kKneeIn of the largest.
double remapped(double difference, double largest)
{
    const double powered = std::pow(difference, kColorPower), knee = kKneeIn * largest;
    return powered < knee ? powered * kKneeOut / knee
                          : kKneeOut + (powered - knee) / (largest - knee) * (1.0 - kKneeOut);
}

Planes opponent_colors(const Image& image, const Image& other)
{
    Planes out = planes_like(Plane(image.width, image.height));
    for (std::size_t i = 0; i < out[0].values.size(); ++i) {
        Color rgb{};
        for (std::size_t c = 0; c < 3; ++c) {
            const auto value = [&](const Image& from) {
                const std::size_t channels = static_cast<std::size_t>(from.channels);
                return from.pixels[i * channels + (channels >= 3 ? c : 0)];
            };
            const bool is_finite = std::isfinite(value(image)) && std::isfinite(value(other));
            rgb[c] = is_finite ? static_cast<double>(std::clamp(value(image), 0.0f, 1.0f)) : 0.0;
        }
        const Color ycxcz = ycxcz_of(rgb);
        for (std::size_t c = 0; c < 3; ++c) out[c].values[i] = ycxcz[c];
    }
    return out;
}

/// What colours look like once blurred as the eye does.
Planes perceived(const Planes& ycxcz)
{
    const Planes blurred = {as_resolved(ycxcz[0], kSensitivity[0]), as_resolved(ycxcz[1], kSensitivity[1]),
                            as_resolved(ycxcz[2], kSensitivity[2])};
    Planes out = planes_like(ycxcz[0]);
    for (std::size_t i = 0; i < out[0].values.size(); ++i) {
        Color rgb = rgb_of_ycxcz(color_at(blurred, i));
        for (double& v : rgb) v = std::clamp(v, 0.0, 1.0);
        const Color lab = hunt_lab_of(rgb);
        for (std::size_t c = 0; c < 3; ++c) out[c].values[i] = lab[c];
    }
    return out;
}

/// How strong edges or points are: the length of a derivative of the blurred lightness.
Plane strength(const Plane& lightness, const Kernel& derivative, const Kernel& bell)
{
    Plane x = filter(lightness, derivative, bell);
    const Plane y = filter(lightness, bell, derivative);
    for (std::size_t i = 0; i < x.values.size(); ++i) x.values[i] = std::hypot(x.values[i], y.values[i]);
    return x;
}

struct Features {
    Plane edges, points;
};

Features features_of(Plane y)
{
    for (double& v : y.values) v = (v + 16.0) / 116.0;
    constexpr double kWidth = 0.082;  // [degrees]
    const double sigma = 0.5 * kWidth * kPixelsPerDegree;
    const int reach = static_cast<int>(std::ceil(3.0 * sigma));
    const auto bell = [&](double x) { return std::exp(-x * x / (2.0 * sigma * sigma)); };
    const Kernel smooth = normalised(make_kernel(reach, bell));
    return {
        strength(y, normalised(make_kernel(reach, [&](double x) { return -x * bell(x); })), smooth),
        strength(y, normalised(make_kernel(reach, [&](double x) { return (x * x / (sigma * sigma) - 1.0) * bell(x); })),
                 smooth)};
}

}  // namespace

double mean_flip(const Image& image, const Image& reference)
{
    const Planes a = opponent_colors(image, reference), b = opponent_colors(reference, image);
    const Planes seen_a = perceived(a), seen_b = perceived(b);
    const Features features_a = features_of(a[0]), features_b = features_of(b[0]);
    const double largest = std::pow(hyab(hunt_lab_of({0.0, 1.0, 0.0}), hunt_lab_of({0.0, 0.0, 1.0})), kColorPower);
    double sum = 0.0;
    for (std::size_t i = 0; i < a[0].values.size(); ++i) {
        const double by_color = remapped(hyab(color_at(seen_a, i), color_at(seen_b, i)), largest);
        const double by_feature = std::max(std::abs(features_a.edges.values[i] - features_b.edges.values[i]),
                                           std::abs(features_a.points.values[i] - features_b.points.values[i]));
        sum += std::pow(by_color, 1.0 - std::pow(by_feature / std::numbers::sqrt2, kFeaturePower));
    }
    return sum / static_cast<double>(a[0].values.size());
}

}  // namespace rcs
