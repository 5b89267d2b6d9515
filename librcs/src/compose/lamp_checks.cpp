#include "compose/lamp_checks.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "accuracy/error_estimate.h"
#include "gbuffer/views.h"
#include "gbuffer/visible_points.h"
#include "rays/shadow_batch.h"
#include "splat/mean_of.h"
#include "util/color.h"
#include "util/random.h"

namespace rcs {
namespace {

// Records whose words scatter by that part of their mean, beyond their noise, lie on an edge.
constexpr float kDisagree = 0.5f;
// Scatter below that part of the picture's mean light of lamps cannot be seen.
constexpr double kDark = 0.003;
// Samples of a pixel's own at a time, each up to two shadow rays, and so many times at the most.
constexpr int kSamples = 32, kMostTimes = 4;
// Pixels so far to either side tell each other what they found, as far as they differ by no more than so many
// deviations: each alone is a speck.
constexpr int kTogether = 1;
constexpr float kAgree = 1.5f;
// Of the records' scatter, as variances: that much error of its own is small enough.
constexpr float kEnough = 0.03f;
constexpr std::size_t kPixelsAtATime = 64;

/// How far the records' words scatter about their mean beyond their noise, squared, on luminance.
float scatter_of(const SplatBuffer& sums, std::size_t i)
{
    const float weight = sums.weight[i], unit = sums.luminance_unit, mean = luminance(mean_of(sums, i)) / unit;
    const float noise = (sums.variance[i] - sums.variance_of_sum[i] / weight) / weight;
    return unit * unit * std::max(0.0f, sums.squares[i] / weight - mean * mean - noise);
}

std::vector<std::size_t> where_records_disagree(const GBuffer& gbuffer, const SplatBuffer& of_lamps, ThreadPool& pool)
{
    const double dark = kDark * mean_light(of_lamps, pool);
    std::vector<std::size_t> pixels;
    for (std::size_t i = 0; i < gbuffer.size(); ++i) {
        if (!gbuffer.covered(i) || !(of_lamps.weight[i] > 0.0f)) continue;
        const float least = std::max(static_cast<float>(dark), kDisagree * luminance(mean_of(of_lamps, i)));
        if (scatter_of(of_lamps, i) > least * least) pixels.push_back(i);
    }
    return pixels;
}

/// Light of gathered lamps at one place, by samples so far.
struct OwnLight {
    glm::vec3 irradiance{0.0f};
    float arrived = 0.0f, squares = 0.0f;   ///< of the luminance of rays that were free
    float possible = 0.0f, inverse = 0.0f;  ///< of that of all rays, were they free, and of 1 over it
    int rays = 0, samples = 0;

    glm::vec3 mean() const { return irradiance / static_cast<float>(samples); }
    /// What one ray that is free brings. Where none was: those that would bring little are the likely ones, so the
    /// harmonic mean, within bounds.
    float one() const
    {
        constexpr float kLeastPart = 1.0f / 16.0f;  // of the mean
        if (arrived > 0.0f) return squares / arrived;
        if (rays == 0) return 0.0f;
        const float count = static_cast<float>(rays);
        return std::max(count / inverse, kLeastPart * possible / count);
    }
    /// Of the mean's luminance: as of rare arrivals, if what is likely to arrive lies halfway to what records say.
    float variance(float recorded) const
    {
        return 0.5f * (luminance(mean()) + recorded) * one() / static_cast<float>(samples);
    }

    void add(const OwnLight& other)
    {
        irradiance += other.irradiance;
        arrived += other.arrived, squares += other.squares;
        possible += other.possible, inverse += other.inverse;
        rays += other.rays, samples += other.samples;
    }
};

/// Of a thread.
class Asker {
public:
    Asker(const RayScene& rays, const HitRadiance& radiance) : rays_(rays), radiance_(radiance) {}

    void ask(const SurfacePoint& point, RandomStream& random, OwnLight& own)
    {
        shadow_.clear();
        lights_.clear();
        for (int k = 0; k < kSamples; ++k)
            radiance_.each_gathered(point, random, [&](const Ray& ray, glm::vec3 irradiance) {
                shadow_.add(ray);
                lights_.push_back(irradiance);
            });
        shadow_.trace(rays_);
        shot_ += shadow_.size();
        own.samples += kSamples;
        for (std::size_t k = 0; k < lights_.size(); ++k) {
            const float light = luminance(lights_[k]);
            ++own.rays;
            own.possible += light;
            own.inverse += 1.0f / light;
            if (!shadow_.is_free(k)) continue;
            own.arrived += light;
            own.squares += light * light;
            own.irradiance += shadow_.transmittance(k) * lights_[k];
        }
    }

    std::uint64_t shot() const { return shot_; }

private:
    const RayScene& rays_;
    const HitRadiance& radiance_;
    ShadowBatch shadow_;
    std::vector<glm::vec3> lights_;
    std::uint64_t shot_ = 0;
};

/// A pixel whose records disagree.
struct Asked {
    std::size_t pixel;
    glm::vec3 recorded;
    float scatter;             ///< of what records say, a variance
    OwnLight own{}, of_all{};  ///< of its own rays; those of pixels around as well
    float own_variance = 0.0f, variance = 0.0f;

    bool is_sure() const { return own.samples > 0 && variance <= kEnough * scatter; }
};

/// The pixels that ask, and which of them each pixel is.
class AskedPixels {
public:
    AskedPixels(const GBuffer& gbuffer, const SplatBuffer& of_lamps, ThreadPool& pool)
        : gbuffer_(gbuffer), number_(gbuffer.size(), kNone)
    {
        for (const std::size_t i : where_records_disagree(gbuffer, of_lamps, pool)) {
            number_[i] = static_cast<std::uint32_t>(asked_.size());
            asked_.push_back({i, mean_of(of_lamps, i), scatter_of(of_lamps, i)});
        }
    }

    std::vector<Asked>& all() { return asked_; }

    /// What the pixels around that lie on the same surface and agree with this one found, with its own.
    OwnLight together(const Asked& one) const
    {
        OwnLight sum;
        for_each_near(gbuffer_, one.pixel, kTogether, [&](std::size_t near) {
            const std::uint32_t number = number_[near];
            if (number != kNone && tells(asked_[number], one)) sum.add(asked_[number].own);
        });
        return sum;
    }

private:
    static constexpr std::uint32_t kNone = ~0u;

    bool tells(const Asked& other, const Asked& one) const
    {
        constexpr float kSameWay = 0.95f;  // cosine
        const float apart = luminance(other.own.mean()) - luminance(one.own.mean());
        return apart * apart <= kAgree * kAgree * (other.own_variance + one.own_variance) &&
               glm::dot(gbuffer_.normal(one.pixel), gbuffer_.normal(other.pixel)) > kSameWay &&
               lies_beside(gbuffer_, one.pixel, other.pixel);
    }

    const GBuffer& gbuffer_;
    std::vector<std::uint32_t> number_;
    std::vector<Asked> asked_;
};

/// Puts `light` in the place of what the records say of lamps. Lobes see as much less as the surface does.
void correct(std::size_t i, glm::vec3 light, SplatBuffer& of_lamps, SplatBuffer& all)
{
    const glm::vec3 before = mean_of(of_lamps, i);
    const auto change = [&](std::vector<float> SplatBuffer::* channel, std::vector<float> SplatBuffer::* glossy,
                            int c) {
        const float more = of_lamps.weight[i] * (light[c] - before[c]);
        (of_lamps.*channel)[i] += more;
        (all.*channel)[i] = std::max(0.0f, (all.*channel)[i] + more);
        if (of_lamps.glossy_r.empty() || !(before[c] > light[c])) return;
        const float less = (of_lamps.*glossy)[i] * (1.0f - light[c] / before[c]);
        (of_lamps.*glossy)[i] -= less;
        (all.*glossy)[i] = std::max(0.0f, (all.*glossy)[i] - less);
    };
    change(&SplatBuffer::weighted_r, &SplatBuffer::glossy_r, 0);
    change(&SplatBuffer::weighted_g, &SplatBuffer::glossy_g, 1);
    change(&SplatBuffer::weighted_b, &SplatBuffer::glossy_b, 2);
}

}  // namespace

LampChecks check_lamps(const RayScene& rays, const HitRadiance& radiance, const GBuffer& gbuffer, const View& view,
                       std::uint64_t seed, ThreadPool& pool, SplatBuffer& of_lamps, SplatBuffer& all)
{
    AskedPixels pixels(gbuffer, of_lamps, pool);
    std::vector<Asked>& asked = pixels.all();
    std::vector<Asker> askers(static_cast<std::size_t>(pool.size()), Asker(rays, radiance));
    const auto each = [&](const auto& work) {
        pool.parallel_for(asked.size(), kPixelsAtATime, [&](std::size_t begin, std::size_t end, int thread) {
            for (std::size_t k = begin; k < end; ++k) work(asked[k], thread);
        });
    };
    for (int time = 0; time < kMostTimes; ++time) {
        each([&](Asked& one, int thread) {
            if (one.is_sure()) return;
            const std::uint64_t key = stream_key(seed, Stream::lamp_checks, pixel_number(view, one.pixel));
            RandomStream random(mix64(key + static_cast<std::uint64_t>(time)));
            askers[static_cast<std::size_t>(thread)].ask(visible_point(gbuffer, one.pixel), random, one.own);
            one.own_variance = one.own.variance(luminance(one.recorded));
        });
        each([&](Asked& one, int) {
            one.of_all = pixels.together(one);
            one.variance = one.of_all.variance(luminance(one.recorded));
        });
    }
    each([&](Asked& one, int) {
        correct(one.pixel, glm::mix(one.recorded, one.of_all.mean(), one.scatter / (one.scatter + one.variance)),
                of_lamps, all);
    });
    LampChecks checks{asked.size(), 0};
    for (const Asker& asker : askers) checks.shadow_rays += asker.shot();
    return checks;
}

}  // namespace rcs
