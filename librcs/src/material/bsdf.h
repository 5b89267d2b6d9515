#pragma once

#include <glm/glm.hpp>

namespace rcs {

/// How one surface point scatters light, textures looked up: a Lambertian base below a GGX specular lobe below
/// a clear coat, and thin transmission. Directions point away from the surface.
///
/// - Specular (glTF 2.0, appendix B): GGX with Smith's height-correlated masking (Heitz 2014), Schlick's
///   Fresnel between f0 and f90. What single scattering loses is given back by the factor
///   1 + f0 (1 - E) / E (Turquin 2019; E: the lobe's directional albedo for Fresnel = 1): a white metal
///   reflects everything at every roughness.
/// - Layers: what lies below a lobe gets 1 minus that lobe's directional albedo at the viewer's angle ("albedo
///   scaling"). So the diffuse part stays a colour times the irradiance, which is what records hold; the price
///   is that swapping the two directions changes the value a little.
/// - Transmission through the thin wall: the specular lobe mirrored to the other side, times what the specular
///   reflection leaves, times the colour.
struct Bsdf {
    glm::vec3 normal{0.0f, 0.0f, 1.0f};  ///< shading, unit, on the viewer's side
    glm::vec3 geometric_normal{0.0f, 0.0f, 1.0f};
    glm::vec3 diffuse{0.0f};       ///< albedo of the base
    glm::vec3 f0{0.0f};            ///< specular reflectance at normal incidence
    float f90 = 0.0f;              ///< and at grazing; 0 with f0 = 0: no specular lobe
    float alpha = 1.0f;            ///< GGX width (roughness squared), in [kLeastAlpha, 1]
    float coat = 0.0f;             ///< strength of the clear coat (f0 0.04, f90 1)
    float coat_alpha = 1.0f;       ///< its GGX width
    glm::vec3 transmission{0.0f};  ///< colour of what passes straight on below the specular reflection

    /// A mirror is a lobe of this width: narrower than any pixel, wide enough for float arithmetic.
    static constexpr float kLeastAlpha = 1e-3f;
    /// glTF's clear coat has an index of refraction of 1.5.
    static constexpr float kCoatF0 = 0.04f;
    /// Transmission by a lobe up to this width shows what is straight behind it (half a degree).
    static constexpr float kStraightAlpha = 0.01f;

    bool has_specular() const { return f90 > 0.0f; }
    bool has_coat() const { return coat > 0.0f; }
    bool transmits() const { return transmission != glm::vec3(0.0f); }
    bool is_frosted() const { return transmits() && alpha > kStraightAlpha; }
};

/// What multiplies irradiance / pi on the reflecting side. @param cosine  of `outgoing` to the shading normal
glm::vec3 diffuse_albedo(const Bsdf& bsdf, float cosine);

/// Directional albedo of specular lobe and coat together: what a uniform sky of radiance 1 reflects by them.
glm::vec3 specular_albedo(const Bsdf& bsdf, float cosine);

/// The same of the transmission.
glm::vec3 transmission_albedo(const Bsdf& bsdf, float cosine);

/// f(outgoing, incoming) [1/sr] without the cosine; 0 where a direction is on the wrong side of the shading or the
/// geometric normal (the diffuse part is also seen from below the shading normal: smooth silhouettes stay lit).
/// All of it, and specular lobe, coat and transmission alone.
glm::vec3 evaluate(const Bsdf& bsdf, glm::vec3 outgoing, glm::vec3 incoming);
glm::vec3 evaluate_glossy(const Bsdf& bsdf, glm::vec3 outgoing, glm::vec3 incoming);

struct BsdfSample {
    glm::vec3 incoming{0.0f};  ///< unit
    glm::vec3 weight{0.0f};    ///< f |cosine| / density; 0: no light can come from there
    float density = 0.0f;      ///< [1/sr]
    float alpha = 1.0f;        ///< width of the lobe that was picked; 1: diffuse
};
/// Samples specular lobe, coat and transmission, each in proportion to its share (visible normals: Heitz 2018).
/// @param choice  in [0, 1): picks the lobe   @param u  in [0, 1)^2: the direction
BsdfSample sample_glossy(const Bsdf& bsdf, glm::vec3 outgoing, float choice, glm::vec2 u);
/// Density with which sample_glossy() picks `incoming` [1/sr].
float glossy_density(const Bsdf& bsdf, glm::vec3 outgoing, glm::vec3 incoming);

/// The same for all lobes, the diffuse one included.
BsdfSample sample(const Bsdf& bsdf, glm::vec3 outgoing, float choice, glm::vec2 u);
float density(const Bsdf& bsdf, glm::vec3 outgoing, glm::vec3 incoming);

}  // namespace rcs
