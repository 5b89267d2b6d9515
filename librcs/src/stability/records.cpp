// Group B: records by themselves: gradients, spacing, weights and what they add up to.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <random>
#include <vector>

#include "rcs/gbuffer.h"
#include "rcs/ray_scene.h"
#include "rcs/records.h"
#include "rcs/reference.h"
#include "rcs/splat.h"
#include "splat/splat_choice.h"
#include "splat/tiles.h"
#include "stability/case_run.h"
#include "stability/polished_ceiling.h"
#include "stability/scenes.h"
#include "stability/splat_oracle.h"

namespace rcs::stability {
namespace {

/// A wall seen from 5 m, and one record at the middle of it.
struct OneRecord {
    View view{look_at_camera("c", {0, 0, 0}, {0, 0, -1}, 1.0), 33, 33, {0.5, 0.5}};
    GBuffer g = wavy_wall(view, {0, 0, 0});
    std::size_t pixel = 33 * 16 + 20;
    Record record;

    OneRecord()
    {
        while (!g.covered(pixel)) ++pixel;
        record.position = g.position(pixel);
        record.normal = g.normal(pixel);
        record.irradiance = {1.0f, 2.0f, 3.0f};
        record.translation_gradient = {glm::vec3(9.0f), glm::vec3(-9.0f), glm::vec3(5.0f)};
        record.rotation_gradient = {glm::vec3(7.0f), glm::vec3(-7.0f), glm::vec3(3.0f)};
        record.spacing_radius = 0.5f;
        record.footprint = 0.1f;
    }
};

void pixel_at_a_record(CaseRun& run)
{
    const OneRecord one;
    for (const SplatMethod method : kSplatMethods) {
        const SplatBuffer sums = splat_by(run, method, {one.record}, one.g, one.view, {0.2f, 1.0f});
        const double w = static_cast<double>(sums.weight[one.pixel]);
        run.figure(std::abs(w - 1.0), "weight, " + name_of(method));
        const float got[] = {sums.weighted_r[one.pixel], sums.weighted_g[one.pixel], sums.weighted_b[one.pixel]};
        for (int c = 0; c < 3; ++c)
            run.figure(std::abs(static_cast<double>(got[c]) / w / static_cast<double>(one.record.irradiance[c]) - 1.0),
                       "irradiance, " + name_of(method));
    }
}

void normals_longer_than_one(CaseRun& run)
{
    OneRecord one;
    for (const float stretch : {1.0f + 2e-7f, 1.0f + 1e-6f, 1.0f - 1e-7f}) {
        one.record.normal = stretch * one.g.normal(one.pixel);
        for (const SplatMethod method : kSplatMethods) {
            const SplatBuffer sums = splat_by(run, method, {one.record}, one.g, one.view, {0.2f, 1.0f});
            // sqrt(1e-7) / 0.2 is what a turn below float precision may take from the weight.
            run.figure(std::abs(static_cast<double>(sums.weight[one.pixel]) - 1.0), "weight, " + name_of(method));
        }
    }
}

void many_records_on_a_pixel(CaseRun& run)
{
    const View view{look_at_camera("c", {0, 0, 0}, {0, 0, -1}, 1.0), 17, 13, {0.5, 0.5}};
    const GBuffer g = wavy_wall(view, {0, 0, 0});
    std::vector<Record> records = random_records(g, 100'000, 3);
    for (std::size_t k = 0; k < records.size(); ++k) {
        records[k].spacing_radius *= 4.0f;
        records[k].irradiance *= 1e6f;
        for (std::size_t c = 0; c < 3; ++c) {  // so steep that many extrapolations would be negative
            records[k].translation_gradient[c] *= 1e6f;
            records[k].rotation_gradient[c] *= 1e6f;
        }
    }
    const SplatSettings options{0.3f, 2.0f};
    const std::vector<SplatSums> exact = double_loop(records, g, options);
    for (const SplatMethod method : kSplatMethods) {
        const SplatBuffer sums = splat_by(run, method, records, g, view, options);
        for (std::size_t i = 0; i < g.size(); ++i) {
            if (!g.covered(i) || exact[i].weight < 1.0) continue;
            run.figure(std::abs(static_cast<double>(sums.weight[i]) / exact[i].weight - 1.0),
                       "sum of weights, " + name_of(method));
            run.figure(std::abs(static_cast<double>(sums.weighted_g[i]) / exact[i].g - 1.0),
                       "sum of light, " + name_of(method));
        }
    }
}

void order_of_records(CaseRun& run)
{
    const View view{look_at_camera("c", {0, 0, 0}, {0, 0, -1}, 1.0), 65, 43, {0.5, 0.5}};
    const GBuffer g = wavy_wall(view, {0, 0, 0});
    const std::vector<Record> records = random_records(g, 2000, 5);
    std::vector<Record> shuffled = records;
    std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937(11));
    for (const SplatMethod method : kSplatMethods) {
        const SplatBuffer a = splat_by(run, method, records, g, view, {0.3f, 2.0f});
        const SplatBuffer b = splat_by(run, method, shuffled, g, view, {0.3f, 2.0f});
        const SplatBuffer again = splat_by(run, method, records, g, view, {0.3f, 2.0f});
        run.require(a.weight == again.weight && a.weighted_g == again.weighted_g,
                    "the same order gives other bits, " + name_of(method));
        for (std::size_t i = 0; i < g.size(); ++i)
            if (a.weight[i] > 0.01f)
                run.figure(std::abs(static_cast<double>(b.weighted_g[i]) - static_cast<double>(a.weighted_g[i])) /
                               static_cast<double>(std::max(a.weighted_g[i], 0.1f * a.weight[i])),
                           "sum of light, " + name_of(method));
    }
}

/// Light whose vector irradiance is linear in space, F(p) = F0 + J p: a plane with normal n gets F(p) . n, and both
/// gradients follow by differentiating that.
struct LinearField {
    glm::dvec3 at_origin{0.2, 0.3, 2.0};
    glm::dmat3 slope{glm::dvec3(0.05, 0.02, 0.01), glm::dvec3(-0.03, 0.04, 0.06), glm::dvec3(0.02, -0.01, 0.03)};

    glm::dvec3 vector(glm::dvec3 p) const { return at_origin + slope * p; }
    double irradiance(glm::dvec3 p, glm::dvec3 n) const { return glm::dot(vector(p), n); }

    void set(Record& r) const
    {
        const glm::dvec3 n(r.normal), f = vector(glm::dvec3(r.position));
        r.irradiance = glm::vec3(static_cast<float>(glm::dot(f, n)));
        r.translation_gradient.fill(glm::vec3(glm::transpose(slope) * n));
        r.rotation_gradient.fill(glm::vec3(glm::cross(n, f)));
        r.gradient_scale = 1.0f;
    }

    /// By how much first order misses the irradiance at (p, n) from a record at (q, m): of second order.
    double remainder(glm::dvec3 p, glm::dvec3 n, glm::dvec3 q, glm::dvec3 m) const
    {
        return glm::dot(vector(p) - vector(q), m - n) + glm::dot(vector(q), m) * (1.0 - glm::dot(m, n));
    }
};

/// A splat is a mean of its records' extrapolations: it lies between the least and the most that they are off by,
/// whatever their weights.
void records_of_a_known_field(CaseRun& run)
{
    const LinearField field;
    const View view{look_at_camera("c", {0, 0, 0}, {0, 0, -1}, 1.0), 49, 33, {0.5, 0.5}};
    const GBuffer g = wavy_wall(view, {0, 0, 0});
    std::vector<Record> records = random_records(g, 400, 7);
    for (Record& r : records) field.set(r);
    const SplatSettings options{0.3f, 1.0f};
    for (const SplatMethod method : kSplatMethods) {
        const SplatBuffer sums = splat_by(run, method, records, g, view, options);
        int seen = 0;
        for (std::size_t i = 0; i < g.size(); ++i) {
            if (!g.covered(i) || sums.weight[i] < 0.1f) continue;
            const glm::dvec3 p(g.position(i)), n(g.normal(i));
            double low = std::numeric_limits<double>::infinity(), high = -low;
            for (const Record& r : records) {
                const glm::dvec3 q(r.position), m(r.normal);
                if (glm::distance(p, q) > 1.001 * static_cast<double>(r.spacing_radius)) continue;
                low = std::min(low, field.remainder(p, n, q, m));
                high = std::max(high, field.remainder(p, n, q, m));
            }
            const double truth = field.irradiance(p, n);
            const double off = static_cast<double>(sums.weighted_g[i] / sums.weight[i]) - truth;
            run.figure(std::max({low - off, off - high, 0.0}) / truth, "irradiance, " + name_of(method));
            ++seen;
        }
        run.require(seen > 400, "records serve only " + std::to_string(seen) + " pixels");
    }
}

/// Gathers with many rays at points (x, 0, 0) of a floor that is instance 0. @param turn  of the normal, towards -x
std::vector<Record> gather_on_floor(CaseRun& run, const Scene& scene, const std::vector<float>& x, double turn)
{
    const RayScene rays = build_ray_scene(scene, run.pool());
    GBuffer g;
    g.width = static_cast<int>(x.size());
    g.height = 1;
    for (auto* plane : {&g.position_y, &g.position_z, &g.normal_z}) plane->assign(x.size(), 0.0f);
    g.position_x = x;
    g.normal_x.assign(x.size(), static_cast<float>(-std::sin(turn)));
    g.normal_y.assign(x.size(), static_cast<float>(std::cos(turn)));
    g.geometric_normal.assign(x.size(), {0, 1, 0});
    g.footprint.assign(x.size(), 0.01f);
    g.position_error.assign(x.size(), 1e-6f);
    g.instance.assign(x.size(), 0);
    g.primitive.assign(x.size(), 0);
    std::vector<std::uint32_t> pixels(x.size());
    std::iota(pixels.begin(), pixels.end(), 0u);
    RecordSettings options;
    options.rays = 16384;
    RecordStats stats;
    return gather_records(rays, g, pixels, options, run.pool(), stats);
}

/// What lobes show goes along with who sees it.
void gradients_below_a_lobe(CaseRun& run)
{
    constexpr float kRoughness = 0.55f;
    constexpr double kAside = 0.1;
    constexpr std::size_t kRecords = 8;
    const Scene scene = polished_ceiling(kRoughness);
    for (const double x : {1.0, 2.0}) {
        const std::vector<Record> records =
            gather_on_floor(run, scene, std::vector<float>(kRecords, static_cast<float>(x)), 0.0);
        double slope = 0.0;
        for (const Record& r : records) slope += static_cast<double>(r.translation_gradient[1].x) / kRecords;
        const double truth =
            (below_polished_ceiling(x + kAside, kRoughness) - below_polished_ceiling(x - kAside, kRoughness)) /
            (2.0 * kAside);
        run.figure(std::abs(slope / truth - 1.0), "translation gradient, " + text_of(x) + " m beside a lobe's middle");
    }
}

void gradients_of_a_record(CaseRun& run)
{
    const std::vector<glm::dvec3> wall = {{0, 0, -200}, {0, 0, 200}, {0, 2, 200}, {0, 2, -200}};
    for (const double distance : {0.5, 1.0, 2.0}) {
        const Record r = gather_on_floor(run, lit_corner(), {static_cast<float>(distance)}, 0.0).front();
        const auto floor = [&](double x) { return polygon_irradiance(wall, {x, 0, 0}, {0, 1, 0}); };
        const double slope = (floor(distance + 1e-4) - floor(distance - 1e-4)) / 2e-4;
        run.figure(std::abs(r.irradiance.g / floor(distance) - 1.0), "irradiance");
        run.figure(std::abs(r.translation_gradient[1].x / slope - 1.0),
                   "translation gradient, " + text_of(distance) + " m from the wall");
        run.figure(std::abs(r.translation_gradient[1].z / slope), "translation gradient along the wall");
        // Turned towards the wall all of it stays above the horizon; E of a turned plane is the projection of the
        // vector irradiance, whose other component is that of a plane that faces the wall.
        const double facing = polygon_irradiance(wall, {distance, 0, 0}, {-1, 0, 0});
        const glm::dvec3 towards = glm::cross(glm::dvec3(0, 1, 0), glm::dvec3(-1, 0, 0));
        run.figure(std::abs(glm::dot(glm::dvec3(r.rotation_gradient[1]), towards) / facing - 1.0),
                   "rotation gradient, " + text_of(distance) + " m from the wall");
    }
    gradients_below_a_lobe(run);
}

void spacing_of_neighbours(CaseRun& run)
{
    std::mt19937 random(5);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    std::vector<Record> records(600);
    for (Record& r : records) {
        r.position = {4.0f * unit(random), 4.0f * unit(random), 0.0f};
        r.harmonic_mean_distance = unit(random) < 0.05f ? 0.02f : 2.0f;
        r.footprint = 1e-4f;  // so small that pixels set no least radius
        r.gradient_reach = 100.0f;
    }
    RecordSettings options;
    options.min_reach = 1e-3f;
    options.max_reach = 1e6f;
    std::vector<Record> reversed(records.rbegin(), records.rend());
    limit_spacing(records, options, run.pool());
    limit_spacing(reversed, options, run.pool());
    for (std::size_t i = 0; i < records.size(); ++i) {
        double near = 2.0;
        for (const Record& other : records)
            near = std::min(near, static_cast<double>(other.harmonic_mean_distance) +
                                      glm::distance(glm::dvec3(records[i].position), glm::dvec3(other.position)));
        near = std::min(near, static_cast<double>(records[i].harmonic_mean_distance));
        run.figure(std::abs(records[i].spacing_radius / (options.error_tolerance * near) - 1.0),
                   "radius against the least over all neighbours");
        run.require(records[i].spacing_radius == reversed[records.size() - 1 - i].spacing_radius,
                    "the order of records changes radii");
    }
}

}  // namespace

std::vector<SuiteCase> record_cases()
{
    const std::string group = "records";
    return {
        {{"B1", group, "A pixel exactly at a record", "weight 1/0", "= weight 1 and the record's own irradiance", 1e-5,
          "a few roundings of floats", true},
         pixel_at_a_record},
        {{"B2", group, "Normals longer or shorter than 1 by rounding", "square root of a negative", "= weight 1", 6e-3,
          "sqrt(1e-6) / 0.2: what so small a turn takes from the weight", true},
         normals_longer_than_one},
        {{"B10", group, "100,000 records on a pixel, irradiance of 10^6, steep gradients",
          "sums lose precision, light below 0", "same as a loop in double precision", 1e-4,
          "what quads and tiles may differ by anywhere", false},
         many_records_on_a_pixel},
        {{"B12", group, "The same records in another order", "sums depend on order",
          "same sums; the same order has the same bits", 1e-5, "a few hundred floats added in another order", true},
         order_of_records},
        {{"B13", group, "Gradients of records beside a lit wall, and below a polished ceiling",
          "a sign or a ring of the hemisphere lost; lobes taken to stay where they are seen",
          "= derivatives of Lambert's formula, and of a sum over the ceiling", 0.03,
          "16,384 rays; bias falls as the rings get finer", true},
         gradients_of_a_record},
        {{"B14", group, "Neighbour clamping of 600 random records", "radii that depend on the order of insertion",
          "= least of R_j + distance over all neighbours, whatever the order", 1e-5, "roundings of a distance", true},
         spacing_of_neighbours},
        {{"B15", group, "Records of a field of light that is linear in space", "a gradient with the wrong sign or axis",
          "= the field, but for what first order cannot know, which has a formula", 1e-5,
          "roundings of floats; the remainder is exact", true},
         records_of_a_known_field},
    };
}

}  // namespace rcs::stability
