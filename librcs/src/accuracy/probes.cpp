#include "accuracy/probes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

#include "gbuffer/visible_points.h"
#include "rcs/metrics.h"
#include "util/color.h"
#include "util/random.h"

namespace rcs {
namespace {

// Pixels that are looked at to find those of little and of much error.
constexpr std::size_t kCandidates = 32768;
constexpr double kMostProbes = 448.0, kLeastProbes = 70.0;
constexpr double kUsualRays = 256.0, kLeastRays = 64.0, kMostRays = 8192.0;  // of a gather
// Rays of probes over those of records, and at least: some milliseconds, that of small pictures something can be told.
constexpr double kPartOfRays = 0.03, kLeastInAll = 40000.0;
constexpr double kHardlyMore = 1.3;  // times the rays so far
// Parts of the pixels, from those of the least error told to those of the most: each gets as many probes.
constexpr double kBounds[] = {0.0, 0.35, 0.65, 0.85, 0.93, 0.97, 0.99, 1.0};
constexpr std::size_t kParts = std::size(kBounds) - 1;
// What is found counts by how sure it is: as sure as this it counts half, against what the map told [of a factor's
// logarithm].
constexpr double kPrior = 0.3;
// So few probes do not know how much they scatter.
constexpr double kFew = 5.0;
// Probes that a part is told by, at least.
constexpr std::size_t kLeastOfPart = 10;
// The median of a normal error, over its standard deviation.
constexpr double kMedianAbsolute = 0.6744897501960817;

RecordSettings without_radiance(RecordSettings settings)
{
    settings.radiance = false;
    return settings;
}

/// Averages two gathers at a place, by their rays.
Sounding average(const Sounding& a, const Sounding& b)
{
    const double share = static_cast<double>(b.rays) / static_cast<double>(a.rays + b.rays);
    return {std::lerp(a.light, b.light, share), a.rays + b.rays};
}

/// As an error relative to the light and a little more.
double told_at(const SplatBuffer& sums, const ErrorMap& map, std::size_t i, double dark)
{
    const double light = light_at(sums, i);
    return light > 0.0 ? kMeanAbsolute * static_cast<double>(map.total(i)) * light / (light + dark) : 0.0;
}

/// What one probe says of a relative error.
struct Finding {
    double off;      ///< of the splat against both halves' mean, absolute
    double noise;    ///< of that mean, absolute
    double product;  ///< of what the splat is off by against each half: right in the mean, whatever their noise
};
/// @param unit  that errors are relative to
Finding finding(double splat, double first, double second, double unit)
{
    return {std::abs(splat - 0.5 * (first + second)) / unit, 0.5 * std::abs(first - second) / unit,
            (splat - first) * (splat - second) / (unit * unit)};
}

/// What an error is relative to: the probe, where it is surely another than the splat, which is less noisy.
double truth_at(double splat, double first, double second)
{
    constexpr double kSurely = 2.0;
    const double truth = 0.5 * (first + second);
    return std::abs(splat - truth) > kSurely * 0.5 * std::abs(first - second) ? truth : splat;
}

struct ProbeFindings {
    double told;            ///< by the map
    Finding found, judged;  ///< relative to the splat, and to the halves' mean
};

double median(std::span<const Finding> of, double Finding::* value)
{
    std::vector<double> values;
    for (const Finding& f : of) values.push_back(f.*value);
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

/// Draws what was found towards what is expected, as far as it is unsure. @param unsure  of its logarithm
double draw(double found, double expected, double unsure)
{
    return expected * std::pow(found / expected, 1.0 / (1.0 + unsure * unsure / (kPrior * kPrior)));
}

/// Mean and typical error (a normal error's mean, of which that would be the median) without the probes' noise.
/// @param expected  where they cannot tell
void take_noise_off(std::span<const Finding> findings, double expected, double& mean, double& typical)
{
    const auto count = static_cast<double>(findings.size());
    const double few = 1.0 + kFew / count;
    double off = 0.0, off2 = 0.0, noise = 0.0, product = 0.0, product2 = 0.0;
    for (const Finding& f : findings) {
        off += f.off / count;
        off2 += f.off * f.off / count;
        noise += f.noise / count;
        product += f.product / count;
        product2 += f.product * f.product / count;
    }
    // Either is too large where errors or noise are no normal ones.
    const double by_mean = off * off - noise * noise, square = std::min(by_mean, product);
    const double of_mean = few * 2.0 * off * std::sqrt(std::max(0.0, off2 - off * off) / count);
    const double of_product = few * std::sqrt(std::max(0.0, product2 - product * product) / count);
    const double error = by_mean < product ? of_mean : std::min(of_mean, of_product);
    // Where nothing is left over, it is less than what would have been seen.
    const double seen = std::max(square, 0.25 * error);
    mean = seen > 0.0 ? draw(std::sqrt(seen), expected, 0.5 * error / seen) : expected;
    const double middle = median(findings, &Finding::off), middle_noise = median(findings, &Finding::noise);
    const double rest = middle * middle - middle_noise * middle_noise;
    const double of_rest = few * 2.5 * middle * middle / std::sqrt(count);
    const double rest_seen = std::max(rest, 0.25 * of_rest);
    typical = rest_seen > 0.0
                  ? draw(std::sqrt(rest_seen) * kMeanAbsolute / kMedianAbsolute, expected, 0.5 * of_rest / rest_seen)
                  : expected;
    typical = std::min(typical, mean);
}

ErrorScale::Part sum_up(std::span<const ProbeFindings> probes)
{
    ErrorScale::Part part;
    std::vector<Finding> found, judged;
    for (const ProbeFindings& p : probes) {
        part.told += p.told / static_cast<double>(probes.size());
        found.push_back(p.found);
        judged.push_back(p.judged);
    }
    double typical = 0.0;
    take_noise_off(found, part.told, part.found, typical);
    take_noise_off(judged, part.found, part.judged, part.typical);
    part.judged = std::max(part.found, part.judged);
    return part;
}

}  // namespace

Probes::Probes(const LitScene& scene, const GBuffer& gbuffer, const RecordSettings& settings, ThreadPool& pool)
    : gbuffer_(gbuffer), pool_(pool), seed_(settings.seed), gatherer_(scene, without_radiance(settings))
{
}

void Probes::choose_pixels(std::size_t count, const SplatBuffer& sums, const ErrorMap& map)
{
    const double dark = kRelativeErrorFloor * mean_light(sums, pool_);
    std::vector<std::pair<float, std::uint32_t>> by_error;
    for (const std::uint32_t i : spread_pixels(gbuffer_, std::min(kCandidates, gbuffer_.size()), ~seed_))
        if (sums.weight[i] > 0.0f) by_error.emplace_back(static_cast<float>(told_at(sums, map, i, dark)), i);
    std::sort(by_error.begin(), by_error.end());
    for (std::size_t part = 0; part < kParts; ++part) {
        const auto size = static_cast<double>(by_error.size());
        const auto first = static_cast<std::size_t>(kBounds[part] * size);
        const auto last = static_cast<std::size_t>(kBounds[part + 1] * size);
        const std::size_t probes = std::min(last - first, count / kParts);
        for (std::size_t k = 0; k < probes; ++k) {
            RandomStream random(stream_key(seed_, Stream::probes, part << 32 | k));
            const double at =
                (static_cast<double>(k) + static_cast<double>(random.next())) / static_cast<double>(probes);
            pixels_.push_back(
                by_error[first + static_cast<std::size_t>(at * static_cast<double>(last - first))].second);
        }
    }
}

double Probes::worth(double record_rays) { return std::max(kLeastInAll, kPartOfRays * record_rays); }

void Probes::spend(double rays, const SplatBuffer& sums, const ErrorMap& map)
{
    if (rays_ == 0)
        choose_pixels(static_cast<std::size_t>(std::clamp(rays / (2.0 * kUsualRays), kLeastProbes, kMostProbes)), sums,
                      map);
    if (pixels_.empty()) return;
    const double gathers = 2.0 * static_cast<double>(pixels_.size());
    const double so_far = static_cast<double>(rays_) / gathers;
    const double wanted = std::clamp(rays / gathers, kLeastRays, kMostRays);
    if (wanted < kHardlyMore * so_far) return;
    for (std::vector<Sounding>& half : halves_) {
        const std::vector<Sounding> more = gatherer_.sound(
            gbuffer_, pixels_, static_cast<int>(std::max(kLeastRays, wanted - so_far)), ++sample_, pool_);
        for (const Sounding& s : more) rays_ += static_cast<std::uint64_t>(s.rays);
        if (half.empty())
            half = more;
        else
            std::transform(half.begin(), half.end(), more.begin(), half.begin(), average);
    }
}

ErrorScale Probes::compare(const SplatBuffer& sums, const ErrorMap& map) const
{
    const double dark = kRelativeErrorFloor * mean_light(sums, pool_);
    std::vector<ProbeFindings> findings;
    for (std::size_t k = 0; k < pixels_.size() && dark > 0.0; ++k) {
        const double splat = light_at(sums, pixels_[k]), told = told_at(sums, map, pixels_[k], dark);
        const double first = halves_[0][k].light, second = halves_[1][k].light;
        if (told > 0.0)
            findings.push_back({told, finding(splat, first, second, splat + dark),
                                finding(splat, first, second, truth_at(splat, first, second) + dark)});
    }
    std::sort(findings.begin(), findings.end(),
              [](const ProbeFindings& a, const ProbeFindings& b) { return a.told < b.told; });
    const std::size_t parts = std::min(kParts, findings.size() / kLeastOfPart);
    std::vector<ErrorScale::Part> found;
    for (std::size_t part = 0; part < parts; ++part) {
        const std::size_t first = part * findings.size() / parts, last = (part + 1) * findings.size() / parts;
        found.push_back(sum_up(std::span(findings).subspan(first, last - first)));
    }
    return ErrorScale(found);
}

}  // namespace rcs
