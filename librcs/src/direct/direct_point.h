#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <glm/glm.hpp>

#include "direct/direct.h"
#include "lamps/candidates.h"
#include "lamps/gathered_lamps.h"
#include "lamps/lights.h"
#include "lamps/movers.h"
#include "lamps/power_heuristic.h"
#include "material/bsdf.h"
#include "rays/shadow_batch.h"
#include "rays/surface.h"
#include "rcs/direct_light.h"
#include "scene/environment.h"
#include "util/random.h"

namespace rcs {

/// What light does at a point: how much of it arrives, and how much its glossy lobes send to the viewer.
struct Lit {
    glm::vec3 irradiance{0.0f};
    glm::vec3 glossy{0.0f};
};

/// What shadow rays found of one lamp, low-discrepancy over it: more of them go on from there.
struct LampSamples {
    int count = 0;
    double free = 0.0, possible = 0.0;  ///< sums of cosine-weighted samples: that arrive at all, and all there are
    glm::dvec3 seen{0.0};               ///< what arrives of them, each channel; times the radiance if that varies
    glm::dvec3 glossy{0.0};             ///< what the glossy lobes make of that

    bool has_free() const { return free > 0.0; }
    bool has_hidden() const { return free < possible * (1.0 - 1e-6); }
};

/// A point's first look at its lamps, of which a second one need not be told again.
struct FirstLook {
    static constexpr std::size_t kMostLamps = 8;  ///< the most important: of others it is told again

    bool is_over = false;
    Lit punctual, along_lobes;
    LampSamples peaks;  ///< `seen` and `glossy` are sums of what they bring
    std::array<LampSamples, kMostLamps> lamp;
};

/// Light of lamps and of the sky's peaks at single points. Diffuse: the exact unoccluded irradiance of each triangle
/// times the share of it that shadow rays find free. Glossy: the same shadow rays times the BSDF; where a lobe is
/// narrower than the lamps, rays along the lobe as well, combined by the power heuristic (Veach and Guibas 1995).
class DirectLight {
public:
    // Up to this many emissive triangles are all evaluated at each point; of more, half as many are drawn from a tree.
    static constexpr std::size_t kTriangleCandidates = LightTree::kMostParts;

    /// How a point is seen; no `bsdf`: it is Lambertian.
    struct Viewer {
        const Bsdf* bsdf = nullptr;
        glm::vec3 outgoing{0.0f};
    };

    /// One triangle, or the part of one above the horizon, as one point sees it.
    struct LampView {
        std::array<glm::vec3, 3> corner;  // relative to the point
        std::uint32_t triangle;           // index into Lights::triangles
        std::uint32_t number;             // of its random stream
        glm::vec3 irradiance;             // if nothing stood between, exact (Lambert's formula)
        float importance;
        float scale;  // how many lamps it stands for
        LampSamples found;
        std::size_t first_shot = 0;  // of those that are on their way
    };

    struct Workspace {
        std::array<LampCandidate, kTriangleCandidates> candidates;
        std::vector<LampView> lamps;
        ShadowBatch shadow;
        std::vector<float> weight;                // of each shadow ray
        std::vector<glm::vec3> radiance, glossy;  // it brings: of the lamp, where that varies; and by the glossy lobes
        HitPacket packet;
        LampSight sight;  // of the last point
        std::uint64_t rays = 0;

        Workspace() { reset(packet.ray); }
        void clear_shots();
        void trace_shots(const RayScene& scene);
    };

    DirectLight(const RayScene& rays, const DirectSettings& options);

    /// @param mixed  lamps (bits as of LampSight) that may be hidden in part, and get more shadow rays
    /// @param first  of the point: becomes what a first look found, or tells a second one of it; null: neither
    Lit at(const SurfacePoint& point, const Viewer& viewer, std::uint64_t key, Workspace& w,
           std::uint64_t mixed = ~0ull, FirstLook* first = nullptr) const;

    /// Whether irradiance_of_seen() is worth a try: a few lamps with a size and no others, which send the same
    /// everywhere, and nothing tints it.
    bool knows_by_shape() const;
    /// Irradiance at a point that sees each lamp wholly or not at all; none if `sight` does not say that of each lamp.
    std::optional<glm::vec3> irradiance_of_seen(const SurfacePoint& point, const LampSight& sight, Workspace& w) const;

    /// @param boxes  around what has moved, as it was and as it is
    Movers movers(std::span<const Bounds> boxes) const { return {boxes, lights_, sky_.has_peaks()}; }

    /// Whether each point draws some of the lamps.
    bool draws() const { return !lights_.triangles.empty() && (options_.lamp_picks > 0 || candidates_.draws()); }

    /// Whether rays stand for more than themselves: only lamps without size need no average.
    bool averages() const { return !lights_.triangles.empty() || sky_.has_peaks(); }

    /// Whether `mixed` counts for anything. Of many lamps few are drawn, others at each point: of these it is told by
    /// their own rays. Where lamps are picked there is no time for it.
    bool takes_mixed() const
    {
        return options_.lamp_picks == 0 && ((!lights_.triangles.empty() && !candidates_.draws()) || sky_.has_peaks());
    }

private:
    static constexpr std::uint64_t kBitOfPeaks = 1ull << 63;
    static constexpr std::uint64_t bit_of_lamp(std::uint32_t number) { return 1ull << number % 63u; }

    DirectLight(const RayScene& rays, const DirectSettings& options, const EffectSet& effects);

    class GlossyLanes;

    /// The lobes that reflect, and how they share the work with the lamps.
    struct Lobes {
        const Bsdf* bsdf = nullptr;  // the viewer's; set if there are any
        LobeSet reflecting = 0, transmitting = 0, lit_behind = 0;
        LobeSet lit_by_gathered = 0;    // of the reflecting ones, those whose gathered lamps nothing else finds
        std::optional<SeenLobes> seen;  // the reflecting ones
        glm::vec3 outgoing{0.0f};
        float diffuse = 0.0f;         // luminance of the diffuse albedo over pi
        int samples = 0;              // rays along the lobes
        float counted = 0.0f;         // as how many the heuristic counts them
        float total_estimate = 0.0f;  // of all triangles; set where there are samples
        bool any = false;
        bool is_behind = false;  // of the surface that records lie on
    };

    Lit on_this_side(const SurfacePoint& point, Lobes& lobes, std::uint64_t key, Workspace& w, std::uint64_t mixed,
                     FirstLook* first) const;
    Lobes make_lobes(const Viewer& viewer) const;
    /// Of the reflecting lobes f times the cosine.
    static glm::vec3 glossy(const Lobes& lobes, glm::vec3 to_light);
    static glm::vec3 glossy(const Bsdf& bsdf, const SeenLobes& seen, glm::vec3 to_light);
    bool is_gathered(const EmissiveTriangle& triangle, const Lobes& lobes) const
    {
        return options_.gathered && !lobes.is_behind && options_.gathered->has(triangle.instance);
    }
    void choose_samples(const SurfacePoint& point, const Workspace& w, Lobes& lobes) const;

    Lit punctual(const SurfacePoint& point, const Lobes& lobes, Workspace& w) const;
    void add_triangles(const SurfacePoint& point, const Lobes& lobes, RandomStream& random, std::uint64_t key,
                       std::uint64_t mixed, Workspace& w, FirstLook* first, Lit& lit) const;
    void add_peaks(const SurfacePoint& point, const Lobes& lobes, std::uint64_t key, std::uint64_t mixed, Workspace& w,
                   FirstLook* first, Lit& lit) const;
    Lit along_lobes(const SurfacePoint& point, const Lobes& lobes, std::uint64_t key, Workspace& w) const;

    void pick_lamps(float total, RandomStream& random, std::vector<LampView>& lamps) const;
    void find_lamps(const SurfacePoint& point, const Lobes& lobes, RandomStream& random, Workspace& w) const;
    void aim(const SurfacePoint& point, const Lobes& lobes, LampView& lamp, int samples, std::uint64_t key,
             GlossyLanes& lanes, Workspace& w) const;
    template <typename Samples>
    void shoot(const SurfacePoint& point, const Lobes& lobes, std::uint64_t key, const Samples& samples,
               Workspace& w) const;
    void shoot_at_peaks(const SurfacePoint& point, const Lobes& lobes, int samples, std::uint64_t key,
                        LampSamples& peaks, Workspace& w) const;
    glm::vec3 light_along(const SurfacePoint& point, const Lobes& lobes, const HitPacket& packet, int lane,
                          float& lamp_density) const;
    bool may_meet_lamp(const SurfacePoint& point, glm::vec3 direction) const;

    // Shadow rays per steradian in a direction, as the heuristic counts them: a function of point and lamp
    // alone, not of which lamps were drawn, so that the weights of both ways to find a lamp add up to 1.
    float samples_towards(std::uint32_t triangle, const SurfacePoint& point, const Lobes& lobes) const;
    float peak_samples_towards(glm::vec3 direction) const;

    const RayScene& rays_;
    DirectSettings options_;
    Lights lights_;
    const Environment& sky_;
    LampCandidates candidates_;
};

}  // namespace rcs
