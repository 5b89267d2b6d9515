#pragma once

#include <string>

#include <glm/glm.hpp>

#include "rcs/scene.h"
#include "scene/gltf_texture.h"

namespace rcs {

/// KHR_materials_pbrSpecularGlossiness, as a file says it.
struct SpecularGlossiness {
    glm::vec3 diffuse{1.0f}, specular{1.0f};  ///< [0, 1]
    float glossiness = 1.0f;                  ///< [0, 1]
    TextureSlot diffuse_texture;              ///< RGB
    TextureSlot specular_texture;             ///< RGB specular, A glossiness
};

/// Sets the material's base to the same surface: a dielectric of that reflectance at normal incidence, roughness 1 -
/// glossiness, and the base colour diffuse (1 - max(specular)). All three are exact; texels that are products of two
/// textures are filtered as products.
/// @param user  names the material in messages
/// @return false where the two textures are mapped differently: the base colour then has the mean of the specular one
bool set_specular_glossiness(const SpecularGlossiness& from, TextureReader& textures, const std::string& user,
                             Material& material);

}  // namespace rcs
