#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "rcs/api.h"
#include "rcs/camera.h"
#include "rcs/log.h"

namespace rcs {

/// A texture with its full mip chain, box filtered. Texels are 16-bit fractions of 1 in linear light (a dark
/// 8-bit sRGB step is 20 codes wide); alpha, where a material uses it, is linear as well.
struct Texture {
    struct Level {
        int width = 0;
        int height = 0;
        std::vector<std::array<std::uint16_t, 4>> texels;  ///< RGBA, row by row from the top
    };
    std::string name;
    std::vector<Level> levels;  ///< [0] is full size, the last one is 1x1
};

enum class Wrap : std::uint8_t { repeat, mirrored_repeat, clamp_to_edge };

/// How a material uses a texture (glTF's textureInfo, sampler and KHR_texture_transform).
struct TextureSlot {
    int texture = -1;  ///< index into Scene::textures, -1: none
    int uv_set = 0;    ///< 0: Mesh::uvs, 1: Mesh::uvs1
    Wrap wrap_u = Wrap::repeat, wrap_v = Wrap::repeat;
    bool nearest = false;                                             ///< magnified without interpolation
    glm::mat3x2 texture_from_uv{1.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f};  ///< applied to (u, v, 1)

    bool used() const { return texture >= 0; }
};

enum class AlphaMode : std::uint8_t { opaque, mask, blend };

/// glTF 2.0's metallic-roughness surface with its common extensions. A factor and its texture multiply.
/// Code that sets base_color alone gets a Lambertian surface: `specular` is 0 here, and 1 in a glTF file.
struct Material {
    std::string name;
    glm::vec3 base_color{1.0f};              ///< [0, 1]
    float alpha = 1.0f;                      ///< [0, 1]
    TextureSlot base_color_texture;          ///< RGB colour, A alpha
    float metallic = 0.0f;                   ///< [0, 1]
    float roughness = 1.0f;                  ///< perceptual, [0, 1]; GGX width = its square
    TextureSlot metallic_roughness_texture;  ///< G roughness, B metallic
    TextureSlot normal_texture;              ///< tangent space
    float normal_scale = 1.0f;
    glm::vec3 emission{0.0f};  ///< radiance [W m^-2 sr^-1]; from the front only unless double_sided
    TextureSlot emission_texture;
    float ior = 1.5f;                ///< of the dielectric, >= 1 (KHR_materials_ior)
    float specular = 0.0f;           ///< strength of the dielectric's reflection, [0, 1] (KHR_materials_specular)
    TextureSlot specular_texture;    ///< A
    glm::vec3 specular_color{1.0f};  ///< of the dielectric's reflection at normal incidence, >= 0
    TextureSlot specular_color_texture;
    float transmission = 0.0f;                       ///< thin-walled, [0, 1] (KHR_materials_transmission)
    TextureSlot transmission_texture;                ///< R
    float clearcoat = 0.0f;                          ///< [0, 1] (KHR_materials_clearcoat)
    float clearcoat_roughness = 0.0f;                ///< [0, 1]
    TextureSlot clearcoat_texture;                   ///< R
    TextureSlot clearcoat_roughness_texture;         ///< G
    glm::vec3 sheen_color{0.0f};                     ///< [0, 1] (KHR_materials_sheen)
    float sheen_roughness = 0.0f;                    ///< perceptual, [0, 1]
    TextureSlot sheen_color_texture;                 ///< RGB
    TextureSlot sheen_roughness_texture;             ///< A
    float anisotropy = 0.0f;                         ///< strength, [0, 1] (KHR_materials_anisotropy)
    float anisotropy_rotation = 0.0f;                ///< from the tangent, counter-clockwise [rad]
    TextureSlot anisotropy_texture;                  ///< RG direction, B strength
    float diffuse_transmission = 0.0f;               ///< [0, 1] (KHR_materials_diffuse_transmission)
    TextureSlot diffuse_transmission_texture;        ///< A
    glm::vec3 diffuse_transmission_color{1.0f};      ///< [0, 1]
    TextureSlot diffuse_transmission_color_texture;  ///< RGB
    float alpha_cutoff = 0.5f;                       ///< mask: seen where alpha >= cutoff
    AlphaMode alpha_mode = AlphaMode::opaque;
    bool unlit = false;  ///< shows its base colour as radiance to the camera, reflects nothing (KHR_materials_unlit)
    bool double_sided = false;  ///< if not, the camera does not see back faces; light still stops there
};

/// Triangles of one material, in object space. Front faces are counter-clockwise.
struct Mesh {
    std::string name;
    std::vector<glm::vec3> positions;
    std::vector<glm::vec3> normals;   ///< empty (flat shading) or one unit vector per position
    std::vector<glm::vec2> uvs;       ///< empty or one per position
    std::vector<glm::vec2> uvs1;      ///< the second set; empty or one per position
    std::vector<glm::vec4> colors;    ///< multiply the base colour and alpha, linear; empty or one per position
    std::vector<glm::vec4> tangents;  ///< xyz unit, w = -1 or 1, for normal textures; empty or one per position
    std::vector<glm::uvec3> triangles;
    int material = 0;
};

struct Instance {
    std::string name;  ///< of its node; unnamed ones are "node 7" by their number in the file
    int mesh = 0;
    glm::dmat4 world_from_object{1.0};  ///< affine; a negative determinant mirrors
};

enum class LightKind { point, spot, directional };

/// A light without size (KHR_lights_punctual).
struct PunctualLight {
    std::string name;
    LightKind kind = LightKind::point;
    glm::vec3 intensity{1.0f};  ///< colour x intensity: [W sr^-1] point and spot, [W m^-2] directional
    glm::dvec3 position{0.0};
    glm::dvec3 direction{0.0, 0.0, -1.0};                  ///< unit, the way the light travels
    float range = std::numeric_limits<float>::infinity();  ///< [m], light fades to 0 there
    float inner_cone = 0.0f;                               ///< half angle of full intensity [rad]; spot
    float outer_cone = 0.785f;                             ///< half angle of no intensity [rad], > inner_cone; spot
};

/// Radiance from infinitely far away by direction: a latitude-longitude image. Row 0 looks up (+Y), the middle
/// column of the unrotated image along -Z, columns to its right towards +X.
struct EnvironmentImage {
    std::string name;
    int width = 0;
    int height = 0;
    std::vector<glm::vec3> radiance;  ///< scene-linear [W m^-2 sr^-1], row by row from the top; finite, >= 0
    double rotation = 0.0;            ///< turns the sky about +Y, counter-clockwise seen from above [rad]

    bool empty() const { return radiance.empty(); }
};

/// What is rendered. Scene space: metres, right-handed, Y up as in glTF, moved by `origin` so that
/// coordinates stay small where a file puts its objects far from zero.
struct Scene {
    std::string name;
    std::vector<Texture> textures;
    std::vector<Material> materials;
    std::vector<Mesh> meshes;
    std::vector<Instance> instances;
    std::vector<PunctualLight> lights;
    std::vector<Camera> cameras;
    glm::vec3 sky_radiance{0.0f};  ///< constant, from every direction a ray can leave the scene in
    EnvironmentImage environment;  ///< added to sky_radiance unless empty
    glm::dvec3 origin{0.0};        ///< world position of scene-space zero
};

/// The name that stands for all animations of a file.
inline constexpr const char* kAllAnimations = "all";

struct LoadOptions {
    /// Of the file's animations [s], held at their first and last keyframe; none: the pose that nodes and
    /// meshes have by themselves. Animations play together; one that moves what an earlier one moves is left out.
    std::optional<double> time;
    /// The one that poses the scene, by its name or its number (0 is the first); "" or "all": all of them.
    std::string animation = {};
};

/// Loads a .gltf or .glb file, or builds a scene made in code when `source` starts with "demo:"
/// ("demo:cornell", "demo:atrium"; more in demo_scene_names()).
/// Warns through `log` of each feature that the file uses and this build ignores.
/// A file without a camera gets one that frames it; one without lamps and emission, a sky_radiance of 1.
/// @throws Error not_found, bad_file, unsupported: one sentence that names file and culprit.
RCS_API Scene load_scene(const std::string& source, const LogFunction& log = {}, const LoadOptions& options = {});

/// The files that load_scene(path) reads: the .gltf or .glb file itself, then the buffers and images that it names,
/// relative to its folder and each once. @throws Error as load_scene() does
RCS_API std::vector<std::string> scene_files(const std::string& path);

/// Reads a latitude-longitude image in any format that OpenImageIO knows (8- and 16-bit files are taken for sRGB).
/// Values that are negative or not finite are repaired, with a warning through `log`.
/// @throws Error bad_file: one sentence that names the file and what is wrong
RCS_API EnvironmentImage load_environment(const std::string& path, const LogFunction& log = {});

/// Names of the built-in scenes, each beginning with "demo:".
RCS_API std::vector<std::string> demo_scene_names();

/// The camera with that name, or with that number (0 is the first); "" gives the first one.
/// @throws Error not_found; the message lists the cameras there are.
RCS_API const Camera& find_camera(const Scene& scene, const std::string& name_or_number);

/// Checks indices, ranges and finiteness of everything in `scene`.
/// @throws Error bad_file that names the element.
RCS_API void validate(const Scene& scene);

struct Bounds {
    glm::dvec3 min{std::numeric_limits<double>::infinity()};
    glm::dvec3 max{-std::numeric_limits<double>::infinity()};
};
/// Scene-space bounding box of all instances; min > max if there is no geometry.
RCS_API Bounds bounds_of(const Scene& scene);

/// Moves scene-space zero to the middle of geometry that lies far from it (beyond 16 of its diagonals), where floats
/// are coarse; cameras and lights go along, `origin` tells where. load_scene() does it; scenes made in code may need
/// it.
RCS_API void move_origin(Scene& scene);

}  // namespace rcs
