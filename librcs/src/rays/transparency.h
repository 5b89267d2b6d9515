#pragma once

#include <cstdint>

#include <glm/glm.hpp>

#include "rays/packet.h"

namespace rcs {

/// A surface as a ray goes through it: how much of it is there, and the colour of the light that goes straight on,
/// between its texels and through its thin wall.
struct Veil {
    float coverage = 1.0f;
    glm::vec3 transmittance{0.0f};
};
/// @param direction  of the ray, scene space, need not be unit
Veil veil_at(const RayScene& rays, const Hit& hit, glm::vec3 direction);

/// How rays of one query pass, and what they have passed. Embree asks about surfaces in any order, about some twice
/// (spatial splits), and about some beyond the final hit.
struct Passage {
    enum class Rule { by_chance, weighted, everything };
    static constexpr int kMost = 12;  ///< tinted surfaces a ray; beyond, tint gives way to chance

    struct Crossing {
        float t;
        std::uint32_t instance, primitive;
        glm::vec3 weight;
    };
    const RayScene& rays;
    Rule rule;
    int count[RayPacket::kWidth] = {};
    Crossing crossings[RayPacket::kWidth][kMost];

    Passage(const RayScene& r, Rule how) : rays(r), rule(how) {}
};

/// A ray at a surface; in the space of its mesh if that is instanced.
struct Meeting {
    std::uint32_t lane;
    bool is_instanced;
    Hit hit;
    glm::vec3 origin, direction;
};
/// Whether the ray goes on; if so, its passage is noted.
bool goes_on(Passage& passage, const Meeting& meeting);

/// Product of all that the lane's ray went through.
glm::vec3 product(const Passage& passage, std::uint32_t lane);

/// What to multiply the light with that comes along the lane's ray from its hit, or from the sky if null.
glm::vec3 weight_of(const Passage& passage, std::uint32_t lane, const Hit* hit, glm::vec3 direction);

}  // namespace rcs
