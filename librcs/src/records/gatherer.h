#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "cells/direct_cells.h"
#include "hit_light/hit_radiance.h"
#include "lamps/gathered_lamps.h"
#include "lit_points/arrival_map.h"
#include "lit_points/gather_guide.h"
#include "material/moving_views.h"
#include "radiance/radiance_sums.h"
#include "rays/hit_surface.h"
#include "rays/packet.h"
#include "rays/shadow_batch.h"
#include "rcs/records.h"
#include "records/hemisphere.h"
#include "util/basis.h"

namespace rcs {

/// Where a record is born.
struct Birth {
    glm::vec3 position;  ///< scene space, on the surface
    glm::vec3 origin;    ///< of its rays: moved off the surface by the rounding bound
    glm::vec3 normal, geometric_normal;
    float footprint;
    std::uint32_t instance;
    std::uint64_t key;
    std::uint64_t light = 0;  ///< sets samples of light where rays end apart that have the same rays
};

/// @param sample  sets the gathers at this place apart: each has its own rays
Birth birth_at(const GBuffer& g, std::uint32_t pixel, std::uint64_t seed, std::uint64_t sample = 0);
/// The same of a record that is_born(), there: gathers again with the same rays.
Birth birth_of(const Record& record, std::uint64_t seed, std::uint64_t sample = 0);

/// Light that arrives at a hit over a shadow ray, and where the hit's albedo is to be looked up: only if it counts.
struct ShadowedLight {
    static constexpr std::int32_t kReflected = -1;

    std::uint32_t cell;
    std::int32_t material;  ///< kReflected: there is no albedo to look up
    glm::vec3 radiance;     ///< towards the record; of a white surface unless kReflected
    glm::vec3 normal;       ///< shading, at the hit
    glm::vec3 to_light;
    glm::vec2 uv;
    float uv_per_length;
    ChangeAlong moving;  ///< of radiance as the record moves, if kReflected: else it is unset, and there is none
};

/// Light of a gathered lamp that a cell's ray hit [W m^-2 sr^-1].
struct LampHit {
    std::uint32_t cell;
    glm::vec3 radiance;
};

/// Cells first .. first + count - 1 of a hemisphere, which one packet holds.
struct PacketCells {
    std::size_t first = 0;
    int count = 0;
    std::uint32_t active = 0;  ///< bit i is set where the ray of cell first + i leaves the surface

    bool is_active(int i) const { return (active >> i & 1u) != 0u; }
};

/// What a gather is made of.
struct GatherSize {
    HemisphereGrid grid;
    int looks = 0;  ///< at lit points
    int aimed = 0;  ///< rays aimed by where light arrives from

    int rays() const { return grid.cells + looks + aimed; }
    /// Number of the first aimed ray's cell: they have packets of their own.
    int first_aimed() const { return (grid.cells + RayPacket::kWidth - 1) / RayPacket::kWidth * RayPacket::kWidth; }
    int cells() const { return aimed > 0 ? first_aimed() + aimed : grid.cells; }
};

/// Of a gather that aims some of its rays.
struct AimedRays {
    std::vector<float> chances;       ///< running, by bin of the ArrivalMap
    std::vector<std::uint16_t> bins;  ///< of it, by cell
    std::vector<float>
        scale;  ///< by cell: what its ray counts for over one of a hemisphere alone; empty: none is aimed
    HemisphereSamples colors;         ///< of the hemisphere's cells, as sums take them
    std::vector<ArrivedRay> arrived;  ///< of all gathers so far, for learning
    std::vector<Arrivals> gathers;
    std::uint64_t rays = 0;

    explicit AimedRays(int most_cells) : colors(most_cells) {}
    float scale_of(std::size_t cell) const { return scale.empty() ? 1.0f : scale[cell]; }
};

/// Working memory for a record at a time: a thread's, or that of one of a wave.
struct GatherWorkspace {
    std::vector<float> x, y, z;
    Basis frame{glm::vec3(0.0f, 0.0f, 1.0f)};  ///< that the cells lie in
    std::vector<PacketCells> cells;            ///< of the packets that are used
    std::vector<HitPacket> packets;
    std::vector<LaneWeights> weights;  ///< of the packets' rays, where surfaces let light through
    ShadowBatch shadow, look_rays;
    std::vector<ShadowedLight> lights;  ///< what each shadow ray brings if it is free
    std::vector<LampHit> lamp_hits;
    HemisphereSamples samples;
    ChangeAlong moving{};  ///< of the cells' radiance in all as the record moves and what it sees stays: by other views
    RadianceSums radiance;
    GatherGuide::Scratch scratch;
    AimedRays aimed;
    std::vector<GatherGuide::Choice> choices;
    std::vector<glm::vec3> arrived;  ///< irradiance of each choice
    std::vector<Look> looks;         ///< of all records gathered so far, for learning
    float cell_width = 0.0f;         ///< side of a cell's solid angle where the cosine is 1 [sqrt(sr)]
    float least_hit_alpha = 0.0f;    ///< of lobes that the cells' rays hit
    /// Of the last record: standard errors of what rays and what looks brought, and of the lit points that all records
    /// share, on luminance [W m^-2].
    float error_of_rays = 0.0f, error_of_looks = 0.0f, error_of_points = 0.0f;
    bool keeps_ways = false;
    std::vector<WatchedWay> ways, shadow_ways;  ///< of the rays traced, by cell, and of shadow rays, if they are kept
    std::uint64_t wanted = ~std::uint64_t{0};   ///< bit by cell: others of the first 64 are not traced
    std::uint64_t hemisphere_rays = 0;
    std::uint64_t shadow_rays = 0;
    std::uint64_t looks_shot = 0;  ///< at lit points

    /// What is left of a cell's light once its ray has gone through what lets light through: set where anything does.
    glm::vec3 weight_of(std::size_t cell) const
    {
        return weights[cell / RayPacket::kWidth].weight[cell % RayPacket::kWidth];
    }

    /// @param most_cells  of the largest grid to come
    explicit GatherWorkspace(int most_cells) : samples(most_cells), aimed(most_cells)
    {
        const std::size_t packets_needed =
            static_cast<std::size_t>((most_cells + RayPacket::kWidth - 1) / RayPacket::kWidth);
        x.resize(packets_needed * RayPacket::kWidth);
        y.resize(x.size());
        z.resize(x.size());
        packets.resize(packets_needed);
        weights.resize(packets_needed);
        for (HitPacket& packet : packets) reset(packet.ray);
    }
};

/// Gathers one record at a time: what depends on the scene and options alone is prepared once. A gather has steps, so
/// that the rays of many can be traced together: aim(), the packets, shade(), the shadow rays and looks, finish().
class Gatherer {
public:
    /// @param scene  its cache counts whatever the bounces; its guide may be null: then rays find all light
    Gatherer(const LitScene& scene, const RecordSettings& options);

    /// All steps, rays traced by the processor.
    Record gather(const Birth& birth, const GatherSize& size, GatherWorkspace& w) const;
    /// Fills w.packets, of which w.cells says the active lanes, and w.look_rays.
    void aim(const Birth& birth, const GatherSize& size, GatherWorkspace& w) const;
    /// Light that leaves what the packets' rays hit, as far as it takes no ray; those that it takes are in w.shadow.
    void shade(const Birth& birth, GatherWorkspace& w) const;
    Record finish(const Birth& birth, const GatherSize& size, GatherWorkspace& w) const;
    /// Light that arrives now less what had been seen, along the same rays: irradiance, gradients and radiance of it,
    /// and in place of the relative noise the standard error [W m^-2].
    /// @param seen  radiance by cell, becomes that of now
    Record difference(const Birth& birth, const HemisphereGrid& grid, std::span<glm::vec3> seen,
                      GatherWorkspace& w) const;

private:
    void aim_cells(const Birth& birth, const HemisphereGrid& grid, GatherWorkspace& w) const;
    void trace_cells(GatherWorkspace& w) const;
    void shade_cells(const PacketCells& cells, std::uint64_t key, GatherWorkspace& w) const;
    void note_sky(const HitPacket& packet, const PacketCells& cells, HemisphereSamples& s) const;
    void note_lamp(const HitPacket& packet, int lane, const HitSurface& hit, std::uint32_t cell,
                   GatherWorkspace& w) const;
    void add_lamps(const GatherSize& size, HemisphereIntegrals& integrals, GatherWorkspace& w, Record& record) const;
    /// A surface that a lane's ray hit.
    struct Met : HitSurface {
        int lane;
        std::uint64_t leaf = 0;                     // of GatherGuide::begin_bound(), then of DirectCells::begin()
        RandomStream random{0};                     // of its light
        float part = 0.0f;                          // of rays_part()
        bool is_served = false;                     // cells may know its light
        const DirectCells::Light* light = nullptr;  // what they know; null: nothing
    };
    void find_known(const HitPacket& packet, std::span<Met> hits, std::uint64_t key, const PacketCells& cells,
                    GatherWorkspace& w) const;
    void shade_hit(const HitPacket& packet, Met& hit, std::uint32_t cell, GatherWorkspace& w) const;
    bool add_known(const HitPacket& packet, const Met& hit, std::uint32_t cell, GatherWorkspace& w) const;
    void add_moving(const ChangeAlong& moving, std::uint32_t cell, glm::vec3 part, GatherWorkspace& w) const;
    float rays_part(const HitPacket& packet, const Met& hit, float cosine, RandomStream random) const;
    void aim_looks(const Birth& birth, int looks, GatherWorkspace& w) const;
    void finish_looks(const Birth& birth, GatherWorkspace& w, Record& record) const;
    void add_looks(float scale, GatherWorkspace& w) const;
    std::vector<float> radiance(const GatherSize& size, GatherWorkspace& w) const;
    std::vector<float> radiance_of_lamps(const GatherSize& size, GatherWorkspace& w) const;
    /// Light over shadow rays, once they are traced.
    void add_shadowed(GatherWorkspace& w) const;

    const RayScene& rays_;
    HitRadiance radiance_;
    const GatherGuide* guide_;
    const GatheredLamps* gathered_;  // null: none
    const ArrivalMap* map_;          // null: rays go everywhere
    const DirectCells* direct_;      // null: shadow rays find all light
    bool has_bounce_;
    bool keeps_radiance_;
};

}  // namespace rcs
