#pragma once

#include <span>

#include <glm/glm.hpp>

#include "hit_light/hit_radiance.h"
#include "material/bsdf.h"
#include "util/random.h"

namespace rcs {

/// How a surface that was met along narrow lobes reflects. Its own narrow lobes go on as rays, which find by themselves
/// what shines and what else there is. The wider the lobes are through which the surface is seen, the more of the light
/// of lamps and sky comes by evaluating them, their peaks spread: a few rays through wide lobes would see small lamps
/// in mirrors as single bright dots (path space regularisation: Kaplanyan and Dachsbacher 2013). What surfaces reflect
/// makes none; that is taken from the light cache as if the lobes were diffuse only where all is blurred. Both ways
/// give the same light, so one can give way to the other by degrees.
class HitLobes {
public:
    /// @param bsdf  of the surface; what it transmits is left to rays that go straight on
    /// @param outgoing  unit, towards the ray's origin   @param width  GGX width of the lobes so far, together
    /// @param is_curved  the surface: then it shrinks lamps to dots, and what is evaluated is wider
    HitLobes(const Bsdf& bsdf, glm::vec3 outgoing, float width, bool is_curved);

    /// BSDF times the weight of light that was found by sampling lamps and sky, not by rays that go on [1/sr].
    /// @param density  of that sampling [1/sr]; 0: no ray can find the light
    glm::vec3 evaluate(glm::vec3 incoming, float density) const;
    /// Directional albedo for light that is the same from everywhere, without the part that rays bring.
    glm::vec3 albedo() const;

    /// A ray that goes on, and what the light along it is to be multiplied with; 0: none.
    struct Onward {
        glm::vec3 direction{0.0f};
        glm::vec3 weight{0.0f};
        float of_lamps = 1.0f;  ///< what lamps and sky send is to be multiplied with as well, in [0, 1]
        float width = 0.0f;     ///< of the lobes so far with this one
        float density = 0.0f;   ///< [1/sr] for the power heuristic, with that of sampling lamps and sky
    };
    /// @param throughput  of the path so far, >= 0: where little is left, few paths go on for the others
    /// @param only_lamps  and sky are what the ray is to find
    Onward sample(glm::vec3 throughput, bool only_lamps, RandomStream& random) const;

private:
    /// A lobe that rays may follow, alone.
    struct Part {
        Bsdf exact, wide;
        float share;        // of what surfaces reflect that rays bring
        float lamps_share;  // of the light of lamps and sky: no more than that
        glm::vec3 left;     // of the light by the layers above
        float width;        // with the lobes so far
    };
    std::span<const Part> parts() const { return {part_, static_cast<std::size_t>(count_)}; }
    glm::vec3 ray_albedo(const Part& part, float share) const;

    glm::vec3 outgoing_;
    glm::vec3 diffuse_;  // albedo
    int count_ = 0;
    Part part_[kMostLobes];  // from the bottom
};

/// Whether any surface may have lobes so narrow that rays go on there.
bool has_narrow_lobes(const Scene& scene);

}  // namespace rcs
