#include <algorithm>
#include <cmath>

#include "direct/direct_point.h"
#include "lamps/polygon.h"
#include "rays/ray_scene_impl.h"
#include "util/counters.h"
#include "util/fraction.h"

namespace rcs {
namespace {

// Triangles that together send less than this share of the lamps' light are represented by one shadow ray.
constexpr float kSmallShare = 0.02f;

/// Point n of the rank-1 lattice of the plastic number (Roberts 2018), shifted.
glm::vec2 lattice(int n, float shift1, float shift2)
{
    return {static_cast<float>(fraction(n * 0.7548776662466927 + static_cast<double>(shift1))),
            static_cast<float>(fraction(n * 0.5698402909980532 + static_cast<double>(shift2)))};
}

/// Replaces the lamps from `first` on by `picks` of them, drawn in proportion to their importance, evenly over its sum.
void pick(std::size_t first, int picks, RandomStream& random, std::vector<DirectLight::LampView>& lamps)
{
    float rest = 0.0f;
    for (std::size_t k = first; k < lamps.size(); ++k) rest += lamps[k].importance;
    const float step = rest / static_cast<float>(picks);
    float target = random.next() * step;  // from the lamp looked at
    std::size_t kept = first;
    for (std::size_t k = first; k < lamps.size(); ++k) {
        DirectLight::LampView picked = lamps[k];
        const float importance = picked.importance;
        if (target < importance || (k + 1 == lamps.size() && kept == first)) {
            // No lamp here is brighter than a step, so none is picked twice.
            const float factor = step / importance;
            picked.irradiance *= factor;
            picked.scale *= factor;
            picked.importance = step;
            lamps[kept++] = picked;
            target += step;
        }
        target -= importance;
    }
    lamps.resize(kept);
}

/// The dimmest share one pick.
void pick_of_dim_lamps(float total, RandomStream& random, std::vector<DirectLight::LampView>& lamps)
{
    std::size_t own = lamps.size();
    float rest = 0.0f;
    while (own > 0 && rest + lamps[own - 1].importance < kSmallShare * total) rest += lamps[--own].importance;
    if (own < lamps.size()) pick(own, 1, random, lamps);
}

}  // namespace

void DirectLight::Workspace::clear_shots()
{
    shadow.clear();
    weight.clear();
    radiance.clear();
    glossy.clear();
}

void DirectLight::Workspace::trace_shots(const RayScene& scene)
{
    shadow.trace(scene);
    rays += shadow.size();
}

/// Lamps that outshine what a pick stands for are kept, the others share the picks that are left.
void DirectLight::pick_lamps(float total, RandomStream& random, std::vector<LampView>& lamps) const
{
    int picks = options_.lamp_picks;
    std::size_t own = 0;
    for (float rest = total;
         own < lamps.size() && picks > 1 && lamps[own].importance * static_cast<float>(picks) >= rest; ++own) {
        rest -= lamps[own].importance;
        --picks;
    }
    if (own < lamps.size()) pick(own, picks, random, lamps);
}

/// What the reflecting lobes make of shots, some at a time.
class DirectLight::GlossyLanes {
public:
    explicit GlossyLanes(const Lobes& lobes) : lobes_(lobes) {}

    /// @param scale  what f times the cosine is to be multiplied by
    /// @param towards  shadow rays per steradian that the heuristic sets against rays along the lobes, if there are any
    void add(glm::vec3 to_light, glm::vec3 scale, float towards, std::vector<glm::vec3>& glossy)
    {
        scale_[count_] = scale;
        towards_[count_] = towards;
        directions_.set(count_, to_light);
        if (++count_ == DirectionLanes::kWidth) move_to(glossy);
    }
    void move_to(std::vector<glm::vec3>& glossy)
    {
        if (count_ == 0) return;
        const Bsdf& bsdf = *lobes_.bsdf;
        const ColorLanes f = lobes_.seen->evaluate(directions_);
        for (std::size_t i = 0; i < count_; ++i) {
            const glm::vec3 to_light = directions_[i];
            const float cosine = glm::dot(bsdf.normal, to_light);
            const bool is_above = cosine > 0.0f && glm::dot(bsdf.geometric_normal, to_light) > 0.0f;
            glm::vec3 g = is_above ? scale_[i] * (cosine * f[i]) : glm::vec3(0.0f);
            if (lobes_.samples > 0) g *= power_heuristic(towards_[i], lobes_.counted * lobes_.seen->density(to_light));
            glossy.push_back(g);
        }
        count_ = 0;
    }

private:
    const Lobes& lobes_;
    std::size_t count_ = 0;
    DirectionLanes directions_;
    std::array<glm::vec3, DirectionLanes::kWidth> scale_;
    std::array<float, DirectionLanes::kWidth> towards_;
};

/// Adds `samples` shots at the lamp, low-discrepancy over its solid angle, going on where the last ones stopped.
void DirectLight::aim(const SurfacePoint& point, const Lobes& lobes, LampView& lamp, int samples, std::uint64_t key,
                      GlossyLanes& lanes, Workspace& w) const
{
    const EmissiveTriangle& triangle = lights_.triangles[lamp.triangle];
    const SphericalTriangle spherical = make_spherical_triangle(lamp.corner.data());
    const float towards = lobes.samples > 0 ? samples_towards(lamp.triangle, point, lobes) : 0.0f;
    RandomStream random(mix64(key ^ lamp.number));
    const float shift1 = random.next();
    const float shift2 = random.next();
    constexpr auto kWidth = static_cast<int>(TriangleLanes::kWidth);
    LampSamples& found = lamp.found;
    TriangleLanes drawn;
    for (int i = 0; i < samples; ++i) {
        if (i % kWidth == 0) {
            const int count = std::min(kWidth, samples - i);
            for (int k = 0; k < count; ++k) {
                const glm::vec2 u = lattice(found.count + i + k, shift1, shift2);
                drawn.u1[k] = u.x;
                drawn.u2[k] = u.y;
            }
            sample(spherical, static_cast<std::size_t>(count), drawn);
        }
        const TriangleSample s = drawn[static_cast<std::size_t>(i % kWidth)];
        const float distance = glm::length(s.position);
        if (!(distance > 0.0f)) continue;
        const glm::vec3 to_light = s.position / distance;
        const float weight = s.inverse_density * std::max(0.0f, glm::dot(point.shading_normal, to_light));
        if (!(weight > 0.0f)) continue;
        found.possible += weight;
        if (glm::dot(point.geometric_normal, to_light) <= 0.0f) continue;
        w.shadow.add(shadow_ray_to(triangle, point, s.position));
        w.weight.push_back(weight);
        const glm::vec3 radiance =
            triangle.varied ? radiance_at(rays_, triangle, point.position + s.position) : triangle.radiance;
        w.radiance.push_back(triangle.varied ? radiance : glm::vec3(1.0f));
        if (lobes.any) lanes.add(to_light, lamp.scale * s.inverse_density * radiance, towards, w.glossy);
    }
    found.count += samples;
}

/// Shoots at all lamps at once. @param samples  of a lamp, by its place: how many
template <typename Samples>
void DirectLight::shoot(const SurfacePoint& point, const Lobes& lobes, std::uint64_t key, const Samples& samples,
                        Workspace& w) const
{
    GlossyLanes lanes(lobes);
    w.clear_shots();
    for (std::size_t k = 0; k < w.lamps.size(); ++k) {
        w.lamps[k].first_shot = w.shadow.size();
        if (const int count = samples(k); count > 0) aim(point, lobes, w.lamps[k], count, key, lanes, w);
    }
    lanes.move_to(w.glossy);
    w.trace_shots(rays_);
    tally(Count::area_rays, w.shadow.size());
    for (std::size_t k = 0; k < w.lamps.size(); ++k) {
        LampSamples& found = w.lamps[k].found;
        const std::size_t end = k + 1 < w.lamps.size() ? w.lamps[k + 1].first_shot : w.shadow.size();
        for (std::size_t i = w.lamps[k].first_shot; i < end; ++i) {
            if (!w.shadow.is_free(i)) continue;
            const glm::vec3 arrives = w.shadow.transmittance(i);
            found.free += w.weight[i];
            found.seen += static_cast<double>(w.weight[i]) * glm::dvec3(arrives * w.radiance[i]);
            if (lobes.any) found.glossy += glm::dvec3(arrives * w.glossy[i]);
        }
    }
}

/// No noise where a lamp is wholly seen or wholly hidden; more rays where it may be neither. Were that for the point's
/// own few rays to decide, a lamp of which a tenth is seen would often count as hidden.
void DirectLight::add_triangles(const SurfacePoint& point, const Lobes& lobes, RandomStream& random, std::uint64_t key,
                                std::uint64_t mixed, Workspace& w, FirstLook* first, Lit& lit) const
{
    float total = 0.0f;
    for (const LampView& lamp : w.lamps) total += lamp.importance;
    if (!(total > 0.0f)) return;

    // Bright lamps first; the dim rest shares one sample, picked in proportion to what it would send.
    // Not std::stable_sort(), which allocates.
    std::sort(w.lamps.begin(), w.lamps.end(), [](const LampView& a, const LampView& b) {
        return a.importance > b.importance || (a.importance == b.importance && a.number < b.number);
    });
    if (options_.lamp_picks > 0)
        pick_lamps(total, random, w.lamps);
    else
        pick_of_dim_lamps(total, random, w.lamps);

    const auto part = [&](int samples, std::size_t k) {
        const int picks = options_.lamp_picks;
        return picks > 0 ? (samples + picks - 1) / picks
                         : static_cast<int>(std::ceil(static_cast<float>(samples) * (w.lamps[k].importance / total)));
    };
    const std::size_t known = first && first->is_over ? std::min(FirstLook::kMostLamps, w.lamps.size()) : 0;
    for (std::size_t k = 0; k < known; ++k) w.lamps[k].found = first->lamp[k];
    shoot(point, lobes, key, [&](std::size_t k) { return k < known ? 0 : part(options_.area_samples, k); }, w);
    if (first)
        for (std::size_t k = 0; k < std::min(FirstLook::kMostLamps, w.lamps.size()); ++k)
            first->lamp[k] = w.lamps[k].found;
    for (const LampView& lamp : w.lamps) {
        w.sight.free |= lamp.found.has_free() ? bit_of_lamp(lamp.number) : 0u;
        w.sight.hidden |= lamp.found.has_hidden() ? bit_of_lamp(lamp.number) : 0u;
    }
    const auto is_mixed = [&](const LampView& lamp) {
        return options_.lamp_picks == 0 && candidates_.draws() ? lamp.found.has_free() && lamp.found.has_hidden()
                                                               : (mixed & bit_of_lamp(lamp.number)) != 0u;
    };
    shoot(
        point, lobes, key, [&](std::size_t k) { return is_mixed(w.lamps[k]) ? part(options_.penumbra_samples, k) : 0; },
        w);
    for (const LampView& lamp : w.lamps) {
        const LampSamples& found = lamp.found;
        // A share of a known sum has next to no noise, but is biased where what it is a share of varies.
        if (lights_.triangles[lamp.triangle].varied)
            lit.irradiance += lamp.scale * glm::vec3(found.seen / static_cast<double>(found.count));
        else if (found.possible > 0.0)
            lit.irradiance += lamp.irradiance * glm::vec3(found.seen / found.possible);
        lit.glossy += glm::vec3(found.glossy / static_cast<double>(found.count));
    }
}

/// Adds `samples` shadow rays towards the sky's peaks, going on where the last call stopped.
void DirectLight::shoot_at_peaks(const SurfacePoint& point, const Lobes& lobes, int samples, std::uint64_t key,
                                 LampSamples& peaks, Workspace& w) const
{
    RandomStream random(mix64(key ^ 0xffffffffull << 32));
    const float shift1 = random.next();
    const float shift2 = random.next();
    GlossyLanes lanes(lobes);
    w.clear_shots();
    for (int i = 0; i < samples; ++i) {
        const Environment::Sample s = sky_.sample_peak(lattice(peaks.count + i, shift1, shift2));
        const float cosine = glm::dot(point.shading_normal, s.direction);
        if (!(s.density > 0.0f) || !(cosine > 0.0f) || !(glm::dot(point.geometric_normal, s.direction) > 0.0f))
            continue;
        w.shadow.add(ray_from(point, s.direction));
        w.radiance.push_back(cosine / s.density * s.radiance);
        peaks.possible += 1.0;
        if (!lobes.any) continue;
        const float towards = lobes.samples > 0 ? peak_samples_towards(s.direction) : 0.0f;
        lanes.add(s.direction, s.radiance / s.density, towards, w.glossy);
    }
    lanes.move_to(w.glossy);
    w.trace_shots(rays_);
    tally(Count::peak_rays, w.shadow.size());
    for (std::size_t i = 0; i < w.shadow.size(); ++i) {
        if (!w.shadow.is_free(i)) continue;
        peaks.free += 1.0;
        peaks.seen += glm::dvec3(w.shadow.transmittance(i) * w.radiance[i]);
        if (lobes.any) peaks.glossy += glm::dvec3(w.shadow.transmittance(i) * w.glossy[i]);
    }
    peaks.count += samples;
}

void DirectLight::add_peaks(const SurfacePoint& point, const Lobes& lobes, std::uint64_t key, std::uint64_t mixed,
                            Workspace& w, FirstLook* first, Lit& lit) const
{
    if (!(sky_.peak_estimate(point.shading_normal) > 0.0f)) return;
    LampSamples peaks;
    if (first && first->is_over)
        peaks = first->peaks;
    else
        shoot_at_peaks(point, lobes, options_.area_samples, key, peaks, w);
    if (first) first->peaks = peaks;
    w.sight.free |= peaks.free > 0.0 ? kBitOfPeaks : 0u;
    w.sight.hidden |= peaks.free < peaks.possible ? kBitOfPeaks : 0u;
    if ((mixed & kBitOfPeaks) != 0u) shoot_at_peaks(point, lobes, options_.penumbra_samples, key, peaks, w);
    lit.irradiance += glm::vec3(peaks.seen / static_cast<double>(peaks.count));
    lit.glossy += glm::vec3(peaks.glossy / static_cast<double>(peaks.count));
}

}  // namespace rcs
