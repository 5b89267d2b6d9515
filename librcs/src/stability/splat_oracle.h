#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "rcs/splat.h"

/// Surfaces and records without any GL or rays, and what a splat of them has to give.
namespace rcs::stability {

/// A wavy wall in front of a camera at `eye`, as a G-buffer without any GL: normals from the wave's slope.
inline GBuffer wavy_wall(const View& view, glm::dvec3 eye)
{
    GBuffer g;
    g.width = view.width;
    g.height = view.height;
    g.camera_position = eye;
    const std::size_t n = g.size();
    for (auto* plane : {&g.position_x, &g.position_y, &g.position_z, &g.normal_x, &g.normal_y, &g.normal_z})
        plane->assign(n, 0.0f);
    g.footprint.assign(n, 0.01f);
    g.instance.assign(n, 0);
    g.primitive.assign(n, 0);
    for (int y = 0; y < g.height; ++y) {
        for (int x = 0; x < g.width; ++x) {
            const std::size_t i = static_cast<std::size_t>(y * g.width + x);
            const CameraRay ray = camera_ray(view, x + 0.5, y + 0.5);
            const glm::dvec3 from = ray.origin - eye;
            const double across = from.x + ray.direction.x;
            const glm::dvec3 p = from + ray.direction * (5.0 + 0.1 * std::sin(6.0 * across));
            const glm::dvec3 normal = glm::normalize(glm::dvec3(-0.3 * std::cos(6.0 * across), 0.1, 1.0));
            g.position_x[i] = static_cast<float>(p.x);
            g.position_y[i] = static_cast<float>(p.y);
            g.position_z[i] = static_cast<float>(p.z);
            g.normal_x[i] = static_cast<float>(normal.x);
            g.normal_y[i] = static_cast<float>(normal.y);
            g.normal_z[i] = static_cast<float>(normal.z);
            if ((x + 3 * y) % 41 == 0) g.instance[i] = GBuffer::kNone;
        }
    }
    return g;
}

/// Records at random pixels with random contents, some of them off the surface and behind the camera.
inline std::vector<Record> random_records(const GBuffer& g, int count, unsigned seed)
{
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    std::vector<Record> records;
    for (int k = 0; k < count; ++k) {
        const std::size_t i = static_cast<std::size_t>(unit(random) * static_cast<float>(g.size() - 1));
        Record r;
        r.position = g.scene_position(i) + 0.05f * glm::vec3(unit(random), unit(random), unit(random));
        if (k % 17 == 0)
            r.position = glm::vec3(g.camera_position) + glm::vec3(unit(random), unit(random), unit(random)) * 0.2f;
        r.normal = glm::normalize(g.normal(i) + 0.1f * glm::vec3(unit(random), unit(random), unit(random)));
        r.irradiance = {unit(random), unit(random), 10.0f * unit(random)};
        for (std::size_t c = 0; c < 3; ++c) {
            r.translation_gradient[c] = glm::vec3(unit(random), unit(random), unit(random)) - 0.5f;
            r.rotation_gradient[c] = glm::vec3(unit(random), unit(random), unit(random)) - 0.5f;
        }
        r.spacing_radius = 0.02f + 0.5f * unit(random) * unit(random);
        r.breadth = 0.3f + 0.7f * unit(random);
        r.gradient_scale = k % 3 == 0 ? unit(random) : 1.0f;
        r.noise = 0.1f * unit(random);
        r.harmonic_mean_distance = 1.0f;
        r.footprint = 0.01f;
        records.push_back(r);
    }
    return records;
}

struct SplatSums {
    double r = 0.0, g = 0.0, b = 0.0, weight = 0.0;
};

/// The definition of docs/method.md as geometry, not as the shared header writes it: every record at every pixel, in
/// double precision. It holds sums to the definition: bounds, bins, blending, rounding. Whether the definition
/// extrapolates light rightly is another question, which records of a known field answer (case B15).
inline std::vector<SplatSums> double_loop(const std::vector<Record>& records, const GBuffer& g, const SplatSettings& o)
{
    std::vector<SplatSums> pixels(g.size());
    for (std::size_t i = 0; i < g.size(); ++i) {
        if (!g.covered(i)) continue;
        for (const Record& record : records) {
            const glm::dvec3 k = glm::dvec3(record.position) - g.camera_position;
            const glm::dvec3 kn(record.normal);
            const glm::dvec3 n(g.normal(i));
            const glm::dvec3 d = glm::dvec3(g.position(i)) - k;
            const double overlap = static_cast<double>(o.overlap);
            const double wide = std::max(std::min(2.0, overlap), overlap * record.gradient_scale);
            const double radius = record.spacing_radius * std::max(1.0, record.breadth * wide);
            const double tolerance = static_cast<double>(o.error_tolerance) * o.overlap;
            // Across the record's tangent plane a distance counts twice; of unit normals at an angle of theta
            // sqrt(1 - cos theta) is the chord over sqrt(2).
            const glm::dvec3 across = glm::dot(d, kn) * kn;
            const double chord = glm::length(n - kn);
            const double error =
                glm::length((d - across) + 2.0 * across) / radius + chord / std::numbers::sqrt2 / tolerance;
            const double w = std::max(0.0, 1.0 - error);
            const glm::dvec3 turn = glm::cross(kn, n);
            const auto value = [&](std::size_t c) {
                return std::max(0.0,
                                record.irradiance[static_cast<int>(c)] +
                                    record.gradient_scale * glm::dot(d, glm::dvec3(record.translation_gradient[c])) +
                                    glm::dot(turn, glm::dvec3(record.rotation_gradient[c])));
            };
            pixels[i].r += w * value(0);
            pixels[i].g += w * value(1);
            pixels[i].b += w * value(2);
            pixels[i].weight += w;
        }
    }
    return pixels;
}

/// Largest difference of the sums, relative to them where they are at least half of one record's at its centre.
/// @param brightest  irradiance of the brightest record
/// Below, an absolute error counts: the dot product of two normals is off by 1e-7, and its distance from 1, where
/// they are nearly the same, enters the weight through a square root.
inline double largest_difference(const SplatBuffer& a, const std::vector<SplatSums>& b, glm::dvec3 brightest)
{
    const auto difference = [](float got, double expected, double one_record) {
        return std::abs(static_cast<double>(got) - expected) / std::max(expected, 0.5 * one_record);
    };
    double worst = 0.0;
    for (std::size_t i = 0; i < b.size(); ++i) {
        worst = std::max(
            {worst, difference(a.weight[i], b[i].weight, 1.0), difference(a.weighted_r[i], b[i].r, brightest.r),
             difference(a.weighted_g[i], b[i].g, brightest.g), difference(a.weighted_b[i], b[i].b, brightest.b)});
    }
    return worst;
}

}  // namespace rcs::stability
