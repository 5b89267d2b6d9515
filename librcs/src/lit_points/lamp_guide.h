#pragma once

#include <array>
#include <span>
#include <tuple>
#include <vector>

#include "cells/cell_table.h"
#include "hit_light/lamp_finder.h"
#include "lit_points/gather_guide.h"

namespace rcs {

/// Points on gathered lamps, and where they are seen from, as looks from visible points and from what those see found.
class LampGuide final : public LampFinder {
public:
    /// @param gathered  any; its finder is not used
    LampGuide(const RayScene& rays, const EffectSet& effects, const GatheredLamps& gathered, const GBuffer& gbuffer,
              const View& view, std::uint64_t seed, ThreadPool& pool);

    HitLights::Sample sample(const SurfacePoint& point, RandomStream& random) const override;
    float part_left(const SurfacePoint& point, const HitLights::Sample& sample,
                    const EmissiveTriangle& lamp) const override;

private:
    void learn(const RayScene& rays, std::span<const SurfaceSample> places, std::uint64_t seed, ThreadPool& pool);
    void weigh_cells(std::span<const SurfaceSample> places);

    /// Running sums of the clusters' chances in a cell, of each level.
    struct Chances {
        CellTable table;
        std::vector<float> sums;  // by cell: some of them, as steps, then one per cluster
    };
    std::size_t steps() const;
    const float* chances_at(const SurfacePoint& point) const;
    void add_chances(const GatherGuide::Place& place, std::vector<float>& sums) const;

    GatherGuide guide_;
    std::array<Chances, std::tuple_size_v<LookCells>> cells_;
};

}  // namespace rcs
