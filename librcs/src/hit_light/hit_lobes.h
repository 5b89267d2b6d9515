#pragma once

#include <span>

#include <glm/glm.hpp>

#include "hit_light/hit_radiance.h"
#include "material/bsdf.h"
#include "util/random.h"

namespace rcs {

/// How a surface that was met along narrow lobes reflects. Its own narrow lobes go on as rays, which find by themselves
/// what shines and what else there is. The wider the lobes are through which the surface is seen, the more of its light
/// comes by evaluating them, widened, for lamps and sky, and from the light cache as if they were diffuse: a few rays
/// through wide lobes would see small lamps in mirrors as single bright dots (path space regularisation: Kaplanyan and
/// Dachsbacher 2013). Both ways give the same light, so one can give way to the other by degrees.
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
        float width = 0.0f;    ///< of the lobes so far with this one
        float density = 0.0f;  ///< [1/sr] for the power heuristic, with that of sampling lamps and sky
    };
    /// @param throughput  of the path so far, >= 0: where little is left, few paths go on for the others
    Onward sample(glm::vec3 throughput, RandomStream& random) const;

private:
    /// A lobe that rays may follow, alone.
    struct Part {
        Bsdf exact, wide;
        float share;     // of its light that rays bring
        glm::vec3 left;  // of the light by the layers above
        float width;     // with the lobes so far
    };
    std::span<const Part> parts() const { return {part_, static_cast<std::size_t>(count_)}; }
    glm::vec3 ray_albedo(const Part& part) const;

    glm::vec3 outgoing_;
    glm::vec3 diffuse_;  // albedo
    int count_ = 0;
    Part part_[kMostLobes];  // from the bottom
};

/// Whether any surface may have lobes so narrow that rays go on there.
bool has_narrow_lobes(const Scene& scene);

}  // namespace rcs
