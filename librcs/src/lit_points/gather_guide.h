#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "hit_light/hit_radiance.h"
#include "lamps/movers.h"
#include "lit_points/importance.h"
#include "lit_points/learned_visibility.h"
#include "lit_points/light_clusters.h"
#include "lit_points/light_survey.h"
#include "lit_points/lit_points.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// Where records look for light: points on lit surfaces, and what earlier records learned of who sees which.
///
/// Part of the light that surfaces reflect from lamps and sky is gathered at lit points, bound / (bound + G) of what a
/// surface sends over a geometry term G = cos cos / d^2; the rest is left to rays. Every bound gives the same light;
/// what is near stays with the rays, so that no point, whose area is only known by chance, counts for much.
class GatherGuide {
public:
    /// @param points  about how many, dark ones counted
    GatherGuide(const LightSurvey& survey, double points, ThreadPool& pool);

    /// False: there is nothing to look at.
    bool has_light() const { return clusters_.size() > 0; }

    /// Part of a gather's rays that are looks, in [0, 1); 0: rays find the light as well. As measured on the scene.
    float share = 0.0f;
    /// Error of as many rays alone over that with looks, in the same time; > 0. As measured on the scene.
    float gain = 1.0f;

    bool can_be_lit(std::uint32_t instance) const { return lit_[instance] != 0; }
    /// @param normal  of the face, unit, to the side in question [m^-2]
    float bound(glm::vec3 position, glm::vec3 normal) const
    {
        return bound(position, importance_.leaf(position, normal));
    }
    /// The same in two steps: memory that the second reads is asked for by the first. @return of bound()
    std::uint64_t begin_bound(glm::vec3 position, glm::vec3 normal) const
    {
        const std::uint64_t leaf = importance_.leaf(position, normal);
        importance_.prefetch(leaf);
        return leaf;
    }
    float bound(glm::vec3 position, std::uint64_t leaf) const
    {
        return moved_ && moved_->touch(position) ? 0.0f : bound_.at(importance_.of(leaf));
    }
    /// Leaves to rays what may be lit otherwise than the points were. @return whether enough of what is seen of them
    /// remains
    bool leave_out(Movers moved, ThreadPool& pool);

    /// A lit point to look at.
    struct Choice {
        std::uint32_t point;
        std::uint16_t cluster;
        glm::vec3 direction;   ///< unit, from the place
        float distance;        ///< [m]
        float part;            ///< geometry term, times the part of the light that is gathered here [m^-2]
        float inverse_chance;  ///< of the choice: a free look brings both times radiance times area
    };
    /// Where looks start.
    struct Place {
        glm::vec3 position, normal;  ///< shading, unit
        LookCells cells;
    };
    /// Working memory of a choice.
    struct Scratch {
        struct Stratum {
            std::uint32_t cluster;
            glm::vec2 u;
        };
        std::vector<float> importance;  ///< by cluster
        std::vector<double> sums;       ///< running, of these
        std::vector<Stratum> strata;
    };
    /// Chooses points by what they may send to a place, one of each of `count` strata of all light; fewer where strata
    /// send nothing. Sums over choices are unbiased.
    /// @param random  of the place
    void choose(const Place& place, int count, RandomStream& random, Scratch& scratch,
                std::vector<Choice>& choices) const;

    /// About what each cluster of points sends to a place, and is seen of it. @param importance  room for clusters()
    /// @param least_chance  that a cluster is taken to be seen with
    void weigh_clusters(const Place& place, float* importance,
                        float least_chance = LearnedVisibility::kLeastChance) const;
    std::size_t clusters() const { return clusters_.size(); }
    float power(std::size_t cluster) const { return clusters_.power(cluster); }
    /// Chooses a point of a cluster by what it may send to a place. @param inverse_chance  of the cluster's choice
    /// @return whether it sends anything
    bool choose_of(std::size_t cluster, glm::vec3 position, glm::vec3 normal, float inverse_chance, glm::vec2 u,
                   Choice& choice) const;
    /// Sets the choice's way from a place.
    void aim(glm::vec3 position, Choice& choice) const;

    LookCells cells(glm::vec3 position, glm::vec3 normal) const { return learned_.cells(position, normal); }
    const LitPoints& lit() const { return lit_points_; }
    const LightClusters& light_clusters() const { return clusters_; }
    void learn(std::span<const Look> looks) { learned_.learn(looks); }

private:
    std::vector<std::uint8_t> lit_;  // per instance
    Importance importance_;
    PointDensity bound_;           // of the bound
    std::optional<Movers> moved_;  // since points were lit
    int moves_ = 0;                // since then
    LitPoints lit_points_;
    LightClusters clusters_;
    LearnedVisibility learned_;
};

}  // namespace rcs
