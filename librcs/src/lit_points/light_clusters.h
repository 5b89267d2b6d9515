#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "lit_points/lit_points.h"

namespace rcs {

/// Lit points in groups that lie together and look the same way, for the choice among them.
class LightClusters {
public:
    static constexpr std::size_t kMost = 512;

    LightClusters() = default;
    /// Sorts the points by cluster.
    explicit LightClusters(LitPoints& lit);

    std::size_t size() const { return first_.empty() ? 0 : first_.size() - 1; }
    float power(std::size_t cluster) const { return power_[cluster]; }  ///< of its points together

    /// Multiplies weights of the clusters by about what each sends to a place if nothing stands between.
    void weigh(glm::vec3 position, glm::vec3 normal, float* weights) const;

    /// About how a lobe weighs what comes from each cluster: GGX's distribution of half vectors, widened by the
    /// cluster's size, is added to `weights`. @param outgoing  unit   @param alpha  GGX width
    /// @param weights  room for size()
    void add_lobe(glm::vec3 position, glm::vec3 normal, glm::vec3 outgoing, float alpha, float strength,
                  float* weights) const;

    /// A cluster's points as they are sorted, the first and how many.
    struct Range {
        std::uint32_t first, count;
    };
    Range points_of(std::size_t cluster) const { return {first_[cluster], first_[cluster + 1] - first_[cluster]}; }

    /// One of a few points of a cluster by what they send to a place (resampled importance sampling; Talbot et al.
    /// 2005).
    struct Pick {
        std::uint32_t point;
        float part;            ///< GatherGuide's of it [m^-2]; 0: none of them sends anything
        float inverse_chance;  ///< of a sum over the cluster's points that is estimated by this one
    };
    /// @param u  in [0, 1)^2
    Pick pick(std::size_t cluster, glm::vec3 position, glm::vec3 normal, glm::vec2 u) const;
    /// Asks for the memory that pick() will read.
    void prefetch(std::size_t cluster, float u) const;
    static constexpr int kCandidates = 8;

    /// Bounds are known only after points are lit; points whose bound is 0 have no part in it. @param points  as sorted
    /// here
    void set_bounds(const std::vector<LitPoint>& points);

private:
    std::vector<std::uint32_t> first_;                   // per cluster and one more: of its points
    std::vector<float> x_, y_, z_, radius_;              // bounding sphere
    std::vector<float> normal_x_, normal_y_, normal_z_;  // mean, not unit: shorter where normals differ
    std::vector<float> spread_;                          // of the normals about it: sine, more or less
    std::vector<float> power_;
    // Of the points, cluster by cluster; the first few of each again at its end, so that any run of candidates can be
    // read in one piece. Their order inside a cluster is random.
    struct Candidates {
        std::vector<float> x, y, z, normal_x, normal_y, normal_z, power, bound;
    };
    Candidates candidates_;

    /// The first of a run of candidates in its cluster, and the number of that among all.
    struct Run {
        std::uint32_t offset;
        std::size_t at;
    };
    Run run_of(std::size_t cluster, float u) const
    {
        const std::uint32_t begin = first_[cluster], count = first_[cluster + 1] - begin;
        const std::uint32_t offset = std::min(count - 1, static_cast<std::uint32_t>(u * static_cast<float>(count)));
        return {offset, begin + cluster * (kCandidates - 1) + offset};
    }
};

}  // namespace rcs
