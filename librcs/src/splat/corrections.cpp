#include "splat/corrections.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include <glm/glm.hpp>

#include "shared/weight.h"
#include "splat/gpu_records.h"
#include "util/color.h"
#include "util/median_split.h"

namespace rcs {
namespace {

// Smoothed residuals hold so much of the noise of those that they are made of.
constexpr float kNoiseLeft = 0.25f;

gpu::vec3 scalars(glm::vec3 v) { return {v.x, v.y, v.z}; }

/// The spheres that records influence, to be asked for those around a point.
class InfluenceTree {
public:
    InfluenceTree(std::span<const Record> records, float overlap)
    {
        for (std::uint32_t i = 0; i < records.size(); ++i) {
            const float radius = influence_radius(records[i], overlap);
            if (radius > 0.0f) spheres_.push_back({records[i].position, radius, i});
        }
        nodes_.reserve(spheres_.size() / 2);
        if (!spheres_.empty()) build(0, spheres_.size());
    }

    /// Shows `visit` every record around `p` and the radius of its influence, always in the same order, and a few more.
    template <typename Visit>
    void around(glm::vec3 p, const Visit& visit) const
    {
        std::array<std::uint32_t, 64> stack;  // halves: 2^32 spheres are 32 deep
        std::size_t waiting = 0;
        if (!nodes_.empty()) stack[waiting++] = 0;
        while (waiting > 0) {
            const std::uint32_t id = stack[--waiting];
            const Node& node = nodes_[id];
            if (glm::any(glm::lessThan(p, node.low)) || glm::any(glm::greaterThan(p, node.high))) continue;
            if (node.right == 0) {
                for (std::uint32_t k = node.begin; k < node.end; ++k) visit(spheres_[k].record, spheres_[k].radius);
            } else {
                stack[waiting++] = node.right;
                stack[waiting++] = id + 1;
            }
        }
    }

private:
    struct Sphere {
        glm::vec3 centre;
        float radius;
        std::uint32_t record;
    };
    struct Node {
        glm::vec3 low, high;
        std::uint32_t begin, end;  // of spheres_
        std::uint32_t right;       // the left child follows its parent; 0 marks a leaf
    };
    static constexpr std::size_t kLeaf = 8;

    std::uint32_t build(std::size_t begin, std::size_t end)
    {
        constexpr float kNowhere = std::numeric_limits<float>::infinity();
        const auto id = static_cast<std::uint32_t>(nodes_.size());
        Node node{glm::vec3(kNowhere), glm::vec3(-kNowhere), static_cast<std::uint32_t>(begin),
                  static_cast<std::uint32_t>(end), 0};
        for (std::size_t k = begin; k < end; ++k) {
            node.low = glm::min(node.low, spheres_[k].centre - spheres_[k].radius);
            node.high = glm::max(node.high, spheres_[k].centre + spheres_[k].radius);
        }
        nodes_.push_back(node);
        if (end - begin <= kLeaf) return id;
        const std::size_t middle = split_at_median(spheres_, begin, end, node.high - node.low,
                                                   [](const Sphere& s) -> const glm::vec3& { return s.centre; });
        build(begin, middle);
        const std::uint32_t right = build(middle, end);
        nodes_[id].right = right;
        return id;
    }

    std::vector<Sphere> spheres_;
    std::vector<Node> nodes_;
};

/// What a splat is off by at a record.
struct Residual {
    glm::vec3 light{0.0f};  // what the record holds and the splat does not say
    double variance = 0.0;  // of that one's luminance, from the noise that records tell of themselves
};

/// Sums over the records around others, as a splat weighs them.
class Neighbours {
public:
    Neighbours(std::span<const Record> records, const SplatSettings& options)
        : records_(records),
          tree_(records, options.overlap),
          inverse_normal_tolerance_(1.0f / (options.error_tolerance * options.overlap))
    {
    }

    /// Shows `add` those that have weight at record j: their numbers, weights, and where j lies from them.
    template <typename Add>
    void weigh(std::size_t j, const Add& add) const
    {
        const Record& here = records_[j];
        tree_.around(here.position, [&](std::uint32_t k, float radius) {
            const Record& r = records_[k];
            const glm::vec3 d = here.position - r.position;
            if (!(glm::dot(d, d) < radius * radius)) return;
            const float weight = gpu::rcs_interpolation_weight(scalars(d), scalars(here.normal), scalars(r.normal),
                                                               1.0f / radius, inverse_normal_tolerance_);
            if (weight > 0.0f) add(k, weight, d);
        });
    }

    Residual residual(std::size_t j) const
    {
        const Record& here = records_[j];
        glm::dvec3 light(0.0);
        double weights = 0.0, variance = 0.0;
        weigh(j, [&](std::uint32_t k, float weight, glm::vec3 d) {
            const Record& r = records_[k];
            const gpu::vec3 turn = scalars(glm::cross(r.normal, here.normal));
            for (int c = 0; c < 3; ++c) {
                const auto color = static_cast<std::size_t>(c);
                light[c] += static_cast<double>(
                    weight * gpu::rcs_extrapolate(r.irradiance[c], scalars(d), turn,
                                                  scalars(r.gradient_scale * r.translation_gradient[color]),
                                                  scalars(r.rotation_gradient[color])));
            }
            weights += static_cast<double>(weight);
            variance += static_cast<double>(weight * weight) * variance_of(r);
        });
        if (!(weights > 0.0)) return {};
        // The record itself has weight 1 among them.
        const double own = variance_of(here) * (1.0 - 2.0 / weights);
        return {here.irradiance - glm::vec3(light / weights), std::max(0.0, own + variance / (weights * weights))};
    }

    /// The residuals around record j, smoothed, as far as they are more than noise.
    glm::vec3 correction(std::size_t j, std::span<const Residual> residuals) const
    {
        glm::dvec3 light(0.0);
        double weights = 0.0, squares = 0.0, noise = 0.0;
        weigh(j, [&](std::uint32_t k, float weight, glm::vec3) {
            const auto l = static_cast<double>(luminance(residuals[k].light));
            light += glm::dvec3(weight * residuals[k].light);
            weights += static_cast<double>(weight);
            squares += static_cast<double>(weight) * l * l;
            noise += static_cast<double>(weight) * residuals[k].variance;
        });
        if (!(weights > 0.0 && squares > 0.0 && std::isfinite(squares))) return glm::vec3(0.0f);
        const double share = 1.0 - static_cast<double>(kNoiseLeft) * noise / squares;
        return glm::vec3(std::max(0.0, share) / weights * light);
    }

private:
    static double variance_of(const Record& r)
    {
        const double deviation = static_cast<double>(r.noise) * static_cast<double>(luminance(r.irradiance));
        return deviation * deviation;
    }

    std::span<const Record> records_;
    InfluenceTree tree_;
    float inverse_normal_tolerance_;
};

}  // namespace

void set_corrections(std::vector<Record>& records, const SplatSettings& options, ThreadPool& pool)
{
    constexpr std::size_t kChunk = 256;
    const Neighbours neighbours(records, options);
    std::vector<Residual> residuals(records.size());
    pool.parallel_for(records.size(), kChunk, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t j = begin; j < end; ++j) residuals[j] = neighbours.residual(j);
    });
    pool.parallel_for(records.size(), kChunk, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t j = begin; j < end; ++j)
            records[j].correction = glm::max(neighbours.correction(j, residuals), -records[j].irradiance);
    });
}

}  // namespace rcs
