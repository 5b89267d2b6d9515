#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <memory>
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
    /// One image of the chain.
    struct Level {
        int width = 0;                                     ///< [px], >= 1
        int height = 0;                                    ///< [px], >= 1
        std::vector<std::array<std::uint16_t, 4>> texels;  ///< RGBA, row by row from the top
    };
    /// The chain, as a vector that nobody changes: copies of a texture share it.
    class Levels {
    public:
        Levels() = default;
        /// Shares them; moving does no less, so that there is none whose levels are gone.
        Levels(const Levels&) = default;
        /// The same.
        Levels& operator=(const Levels&) = default;
        /// Takes them over.
        RCS_API Levels(std::vector<Level> levels);
        /// Those.
        Levels(std::initializer_list<Level> levels) : Levels(std::vector<Level>(levels)) {}

        /// How many there are.
        std::size_t size() const noexcept { return count_; }
        /// Whether there is none.
        bool empty() const noexcept { return count_ == 0; }
        /// @param i  below size()
        const Level& operator[](std::size_t i) const { return first_[i]; }
        /// The full size.
        const Level& front() const { return first_[0]; }
        /// The 1x1 one.
        const Level& back() const { return first_[count_ - 1]; }
        /// From the full size on.
        const Level* begin() const noexcept { return first_; }
        /// Behind the last one.
        const Level* end() const noexcept { return first_ + count_; }
        /// Of sizes and texels, found once for all that share them.
        RCS_API std::uint64_t hash() const;

    private:
        struct Held;
        std::shared_ptr<const Held> held_;
        const Level* first_ = nullptr;  // theirs, one step nearer
        std::size_t count_ = 0;
    };
    std::string name;          ///< as the file calls it, for messages; may be empty
    Levels levels;             ///< [0] is full size, the last one is 1x1
    std::string content = {};  ///< hash of the image file and of how its numbers were meant; "": made otherwise
};

/// What a texture shows beyond its edges (glTF 2.0, section 5.26: sampler).
enum class Wrap : std::uint8_t { repeat, mirrored_repeat, clamp_to_edge };

/// How a material uses a texture (glTF's textureInfo, sampler and KHR_texture_transform).
struct TextureSlot {
    int texture = -1;                                                 ///< index into Scene::textures, -1: none
    int uv_set = 0;                                                   ///< 0: Mesh::uvs, 1: Mesh::uvs1
    Wrap wrap_u = Wrap::repeat;                                       ///< beyond the left and right edge
    Wrap wrap_v = Wrap::repeat;                                       ///< beyond the upper and lower edge
    bool nearest = false;                                             ///< magnified without interpolation
    glm::mat3x2 texture_from_uv{1.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f};  ///< applied to (u, v, 1)

    /// Whether there is a texture.
    bool used() const { return texture >= 0; }
};

/// What a material's alpha means (glTF 2.0, section 3.9.4): nothing, seen or not by a cutoff, part of the light lets
/// through.
enum class AlphaMode : std::uint8_t { opaque, mask, blend };

/// glTF 2.0's metallic-roughness surface with its common extensions. A factor and its texture multiply.
/// Code that sets base_color alone gets a Lambertian surface: `specular` is 0 here, and 1 in a glTF file.
struct Material {
    std::string name;                        ///< as the file calls it; may be empty
    glm::vec3 base_color{1.0f};              ///< [0, 1]
    float alpha = 1.0f;                      ///< [0, 1]
    TextureSlot base_color_texture;          ///< RGB colour, A alpha
    float metallic = 0.0f;                   ///< [0, 1]
    float roughness = 1.0f;                  ///< perceptual, [0, 1]; GGX width = its square
    TextureSlot metallic_roughness_texture;  ///< G roughness, B metallic
    TextureSlot normal_texture;              ///< tangent space
    float normal_scale = 1.0f;               ///< of the normal texture's x and y
    glm::vec3 emission{0.0f};                ///< radiance [W m^-2 sr^-1]; from the front only unless double_sided
    TextureSlot emission_texture;            ///< RGB
    float ior = 1.5f;                        ///< of the dielectric, >= 1 (KHR_materials_ior)
    float specular = 0.0f;               ///< strength of the dielectric's reflection, [0, 1] (KHR_materials_specular)
    TextureSlot specular_texture;        ///< A
    glm::vec3 specular_color{1.0f};      ///< of the dielectric's reflection at normal incidence, >= 0
    TextureSlot specular_color_texture;  ///< RGB
    float transmission = 0.0f;           ///< thin-walled, [0, 1] (KHR_materials_transmission)
    TextureSlot transmission_texture;    ///< R
    float clearcoat = 0.0f;              ///< [0, 1] (KHR_materials_clearcoat)
    float clearcoat_roughness = 0.0f;    ///< [0, 1]
    TextureSlot clearcoat_texture;       ///< R
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
    AlphaMode alpha_mode = AlphaMode::opaque;        ///< what alpha means
    bool unlit = false;  ///< shows its base colour as radiance to the camera, reflects nothing (KHR_materials_unlit)
    bool double_sided = false;  ///< if not, the camera does not see back faces; light still stops there
};

/// Triangles of one material, in object space. Front faces are counter-clockwise.
struct Mesh {
    std::string name;                   ///< as the file calls it; may be empty
    std::vector<glm::vec3> positions;   ///< of its vertices [m]; finite
    std::vector<glm::vec3> normals;     ///< empty (flat shading) or one unit vector per position
    std::vector<glm::vec2> uvs;         ///< empty or one per position
    std::vector<glm::vec2> uvs1;        ///< the second set; empty or one per position
    std::vector<glm::vec4> colors;      ///< multiply the base colour and alpha, linear; empty or one per position
    std::vector<glm::vec4> tangents;    ///< xyz unit, w = -1 or 1, for normal textures; empty or one per position
    std::vector<glm::uvec3> triangles;  ///< indices of their vertices
    int material = 0;                   ///< index into Scene::materials
};

/// A mesh that stands somewhere.
struct Instance {
    std::string name;                   ///< of its node; unnamed ones are "node 7" by their number in the file
    int mesh = 0;                       ///< index into Scene::meshes
    glm::dmat4 world_from_object{1.0};  ///< affine; a negative determinant mirrors
};

/// Where the light of a lamp without size comes from.
enum class LightKind { point, spot, directional };

/// A light without size (KHR_lights_punctual).
struct PunctualLight {
    std::string name;                      ///< as the file calls it; may be empty
    LightKind kind = LightKind::point;     ///< what of the rest counts
    glm::vec3 intensity{1.0f};             ///< colour x intensity: [W sr^-1] point and spot, [W m^-2] directional
    glm::dvec3 position{0.0};              ///< scene space [m]; point and spot
    glm::dvec3 direction{0.0, 0.0, -1.0};  ///< unit, the way the light travels
    float range = std::numeric_limits<float>::infinity();  ///< [m], light fades to 0 there
    float inner_cone = 0.0f;                               ///< half angle of full intensity [rad]; spot
    float outer_cone = 0.785f;                             ///< half angle of no intensity [rad], > inner_cone; spot
};

/// Radiance from infinitely far away by direction: a latitude-longitude image. Row 0 looks up (+Y), the middle
/// column of the unrotated image along -Z, columns to its right towards +X.
struct EnvironmentImage {
    std::string name;                 ///< its file, for messages
    int width = 0;                    ///< [px]; 0: there is none
    int height = 0;                   ///< [px]
    std::vector<glm::vec3> radiance;  ///< scene-linear [W m^-2 sr^-1], row by row from the top; finite, >= 0
    double rotation = 0.0;            ///< turns the sky about +Y, counter-clockwise seen from above [rad]

    /// Whether there is none.
    bool empty() const { return radiance.empty(); }
};

/// What is rendered. Scene space: metres, right-handed, Y up as in glTF, moved by `origin` so that
/// coordinates stay small where a file puts its objects far from zero.
struct Scene {
    std::string name;                   ///< of its file or demo
    std::vector<Texture> textures;      ///< that materials use
    std::vector<Material> materials;    ///< that meshes are of
    std::vector<Mesh> meshes;           ///< that instances are of
    std::vector<Instance> instances;    ///< all that there is to see
    std::vector<PunctualLight> lights;  ///< lamps without size; others are instances whose material has emission
    std::vector<Camera> cameras;        ///< from which it can be seen, the first one by default
    glm::vec3 sky_radiance{0.0f};       ///< constant, from every direction a ray can leave the scene in
    EnvironmentImage environment;       ///< added to sky_radiance unless empty
    glm::dvec3 origin{0.0};             ///< world position of scene-space zero
};

/// The name that stands for all animations of a file.
inline constexpr const char* kAllAnimations = "all";

/// What of a file is loaded.
struct LoadOptions {
    /// Of the file's animations [s], held at their first and last keyframe; none: the pose that nodes and
    /// meshes have by themselves. Animations play together; one that moves what an earlier one moves is left out.
    std::optional<double> time = {};
    /// The one that poses the scene, by its name or its number (0 is the first); "" or "all": all of them.
    std::string animation = {};
    /// Textures that this scene has of the same images are shared with it in place of being decoded again; may be null.
    const Scene* like = nullptr;
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

/// A box along the axes of scene space; empty as it begins.
struct Bounds {
    glm::dvec3 min{std::numeric_limits<double>::infinity()};   ///< lower corner [m]
    glm::dvec3 max{-std::numeric_limits<double>::infinity()};  ///< upper corner [m]
};
/// Scene-space bounding box of all instances; min > max if there is no geometry.
RCS_API Bounds bounds_of(const Scene& scene);

/// Moves scene-space zero to the middle of geometry that lies far from it (beyond 16 of its diagonals), where floats
/// are coarse; cameras and lights go along, `origin` tells where. load_scene() does it; scenes made in code may need
/// it.
RCS_API void move_origin(Scene& scene);

}  // namespace rcs
