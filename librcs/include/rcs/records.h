#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <glm/glm.hpp>

#include "rcs/api.h"
#include "rcs/effect_plan.h"
#include "rcs/gbuffer.h"
#include "rcs/light_cache.h"
#include "rcs/log.h"
#include "rcs/ray_scene.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// What a ray of a watched record goes along.
struct WatchedWay {
    glm::vec3 direction{0.0f};  ///< unit
    float length = -1.0f;       ///< [m]; +inf: it hits nothing; < 0: it is not shot
    std::uint32_t ray = 0;      ///< number of the ray, or of that which hit what this shadow ray begins at
};

/// Where a record's rays start, and what a few of them brought when its light was last looked at: whether it still
/// holds once the scene has changed. Scene space.
struct RecordWatch {
    glm::vec3 origin{0.0f};            ///< of the rays [m]
    glm::vec3 geometric_normal{0.0f};  ///< unit; 0: nothing is known of it
    std::uint32_t instance = 0;        ///< it lies on
    std::uint32_t state = 0;           ///< of the scene, counted by the session, whose light it has, as far as is known
    std::uint32_t gathered = 0;        ///< ... when it was gathered
    float light = 0.0f;                ///< its irradiance then, on luminance [W m^-2]
    std::uint32_t touched = 0;         ///< ... when it or a record around last saw a change
    std::uint32_t view = 0;            ///< of the session, the last one that it was in
    bool is_shown = false;             ///< that one, or one before it, has shown its light about as it is
    bool records_off = false;          ///< of gathers at contacts: those around were off, as that view found
    std::vector<glm::vec3> seen;       ///< radiance by ray [W m^-2 sr^-1]; empty: it is not watched
    std::vector<WatchedWay> ways;      ///< of those rays by number, then of the shadow rays from what they hit
};

/// One irradiance record: what the hemisphere over p_k, n_k sends, how that changes nearby, and how
/// far it may be trusted. Scene space.
struct Record {
    glm::vec3 position{0.0f};            ///< p_k [m]
    glm::vec3 normal{0.0f, 0.0f, 1.0f};  ///< n_k, unit
    glm::vec3 irradiance{0.0f};          ///< E_k [W m^-2]
    glm::vec3 of_lamps{0.0f};            ///< part of E_k that gathered lamps send straight here [W m^-2]
    /// Per colour: gradient for a rotation of the normal; E changes by dot(cross(n_k, n), g) [W m^-2 rad^-1]
    std::array<glm::vec3, 3> rotation_gradient{};
    /// Per colour: gradient for a move within the tangent plane; E changes by dot(p - p_k, g) [W m^-3]
    std::array<glm::vec3, 3> translation_gradient{};
    float harmonic_mean_distance = 0.0f;  ///< R_k before any limit [m]; may be +inf (nothing hit)
    float minimum_distance = 0.0f;        ///< to the nearest hit, grazing rays left out [m]; may be +inf
    /// E_k over its translation gradient, on luminance, as first gathered [m]: that far away the expansion reaches
    /// zero or twice its value; may be +inf
    float gradient_reach = std::numeric_limits<float>::infinity();
    int rays = 0;                 ///< hemisphere rays that it was gathered with
    float footprint = 0.0f;       ///< side of a pixel on the surface where it was made [m]
    float noise = 0.0f;           ///< standard error of E_k relative to it, on luminance
    float spacing_radius = 0.0f;  ///< a R_k after all limits [m]: within it no other record is needed
    float gradient_scale = 1.0f;  ///< how much of the translation gradient to trust, in [0, 1]: less than 1
                                  ///< where the least spacing overrides the reach of the expansion
    float closeness =
        1.0f;  ///< its least R_k over RecordSettings::min_reach, in (0, 1]: less where the error asks for it
    glm::vec3 correction{0.0f};  ///< what the last splat adds to E_k, for what light does between records [W m^-2]
    float breadth = 1.0f;        ///< of the last splat's influence, in (0, 1]: less than 1 where records lie as close
                                 ///< as they may and their expansions still disagree
    std::uint32_t gathered_lamps = 0;  ///< GatheredLamps::id; records of others must not be mixed with them
    /// Incoming radiance times cosine in spherical harmonics of scene space (Krivanek et al. 2005, with the cosine
    /// taken in), that of gathered lamps left out: 36 coefficients of red, of green, of blue [W m^-2]. Empty unless
    /// options.radiance asked for it.
    std::vector<float> radiance;
    std::vector<float> radiance_of_lamps;  ///< the same of gathered lamps alone; empty as well where there are none
    RecordWatch watch;                     ///< whether it still holds once the scene has changed
};

/// How records are placed and gathered.
struct RecordSettings {
    float error_tolerance = 0.2f;  ///< a, in (0, 1]; smaller is finer
    int rays = 128;                ///< hemisphere rays per record at first, in [16, 65536]; rounded to M x N strata
    float noise_target = 0.02f;    ///< standard error wanted at a pixel relative to its irradiance, > 0, where records
                                   ///< lie as far apart as they may; ones f times as close may have f^(2/3) times as
                                   ///< much. Where there is more, a record gets more
    int refinement = 16;           ///< rays, so many times `rays` at the most, >= 1
    float min_reach = 15.0f;       ///< least R_k [px], in (0, max_reach]: a times it is the closest spacing
    float max_reach = 60.0f;       ///< largest R_k [px]: a times it is the widest spacing
    float steepest = 1.0f / 3.0f;  ///< of min_reach, what the least R_k falls to where light is steep, in (0, 1]
    float gradient_limit = 3.0f;   ///< R_k is at most so many times E/|grad E|, > 0
    bool radiance = false;         ///< records also keep radiance by direction, for glossy surfaces
    int bounces = 1;         ///< in [0, 64]. 0: only the sky's own light arrives; 1: light reflected once as well;
                             ///< more take a light cache
    std::uint64_t seed = 1;  ///< of its rays
    std::optional<EffectSet> effects = std::nullopt;  ///< of a plan; none: what the scene has, wherever it lies
};

/// What gathering records took.
struct RecordStats {
    std::uint64_t records = 0;          ///< that were made
    std::uint64_t hemisphere_rays = 0;  ///< over their hemispheres
    std::uint64_t shadow_rays = 0;      ///< from what those met to lamps
    std::uint64_t looks = 0;            ///< shadow rays of records to lit points
    std::uint64_t lit_points = 0;       ///< that records look at; 0: rays alone find their light
    std::uint64_t aimed_rays = 0;       ///< of hemisphere_rays, those that went where light had come from
    std::uint64_t direct_cells = 0;    ///< where rays end, of which direct light is known; 0: their shadow rays find it
    std::uint64_t gathered_lamps = 0;  ///< surfaces whose own light records gather, in place of pixels' shadow rays
    std::uint64_t waves = 0;           ///< of holes that were filled
    std::uint64_t refined = 0;         ///< records that got more rays because their neighbourhood was noisy
    std::uint64_t refining_rays = 0;   ///< those rays and looks, also part of the others
    std::uint64_t watched = 0;         ///< records brought up to date, of earlier views, as the scene has changed
    std::uint64_t looked_again = 0;    ///< of those, with rays that may meet what has changed
    std::uint64_t renewed = 0;         ///< of the watched, gathered again where they are
};

/// Where gathers look for light besides where their rays lead: made by the renderer for a view (method.md).
class ArrivalMap;
class GatherGuide;
/// Lamps whose light records gather, as they gather that of the sky (method.md).
struct GatheredLamps;
/// Direct light where gather rays end, as it was found once for all (method.md).
struct DirectCells;
/// Traces rays of gathers on a graphics device: made by the renderer (method.md).
class RayCaster;

/// What gather rays see: the scene, and on its surfaces the light of later bounces.
struct LitScene {
    const RayScene& rays;           ///< what they can meet
    const LightCache* cache;        ///< of RecordSettings::bounces - 1 bounces, where that is more than 0; else unused
    GatherGuide* guide;             ///< tells gathers where to look; null: they look everywhere
    const GatheredLamps* gathered;  ///< null: none
    RayCaster* caster;              ///< of these rays; null: the processor traces them
    const DirectCells* direct;      ///< of lamps and sky; null: shadow rays find it
    ArrivalMap* arrivals;           ///< tells gathers where to aim some of their rays; null: they go everywhere

    /// @param r,c,g,lamps,device,d,map  of the members above
    LitScene(const RayScene& r, const LightCache* c = nullptr, GatherGuide* g = nullptr,
             const GatheredLamps* lamps = nullptr, RayCaster* device = nullptr, const DirectCells* d = nullptr,
             ArrivalMap* map = nullptr)
        : rays(r), cache(c), guide(g), gathered(lamps), caster(device), direct(d), arrivals(map)
    {
    }

    /// The same to a judge of records: what all of them share of direct light may be off for all, and where rays are
    /// aimed depends on the records before.
    LitScene by_samples() const { return {rays, cache, guide, gathered, caster, nullptr}; }
};

/// Gathers one record at each of the given visible points.
/// @param pixels  indices into the G-buffer, each covered
/// @return one record for each, in the same order
RCS_API std::vector<Record> gather_records(const LitScene& scene, const GBuffer& gbuffer,
                                           const std::vector<std::uint32_t>& pixels, const RecordSettings& options,
                                           ThreadPool& pool, RecordStats& stats);

/// Sets every record's spacing radius: a R_k, limited by the relative gradient, by neighbours (no
/// record may claim more than a neighbour's radius plus the distance to it; Krivanek et al. 2006,
/// neighbour clamping, here as the order-free fixed point) and to a range of pixels on the surface.
RCS_API void limit_spacing(std::vector<Record>& records, const RecordSettings& options, ThreadPool& pool);

/// Adds records until every visible point is within the spacing radius of one: waves of holes on a
/// hierarchy of pixel grids, coarse to fine. Which pixels a wave takes follows from the image and the seed
/// alone, so the records do not depend on timing, threads or the GL.
/// @param view  the view that `gbuffer` was made for
/// @param records  those there are already; the new ones are appended, all spacing radii brought up to date
RCS_API void place_records(const LitScene& scene, const GBuffer& gbuffer, const View& view,
                           const RecordSettings& options, ThreadPool& pool, std::vector<Record>& records,
                           RecordStats& stats, const ProgressFunction& progress = {});

/// @throws Error bad_argument: the field, its value and its range
RCS_API void validate(const RecordSettings& options);

}  // namespace rcs
