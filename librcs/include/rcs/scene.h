#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "rcs/camera.h"
#include "rcs/log.h"

namespace rcs {

/// A scene-linear RGB texture with its full mip chain, box filtered. Texels are 16-bit fractions of
/// 1 in linear light (a dark 8-bit sRGB step is 20 codes wide), wrapped by repetition.
struct Texture {
    struct Level {
        int width = 0;
        int height = 0;
        std::vector<std::array<std::uint16_t, 4>> texels;  ///< RGB and one unused, row by row from the top
    };
    std::string name;
    std::vector<Level> levels;  ///< [0] is full size, the last one is 1x1
};

/// A Lambertian surface. Albedo = base_color x texture, in [0, 1].
struct Material {
    std::string name;
    glm::vec3 base_color{1.0f};
    int base_color_texture = -1;  ///< index into Scene::textures, or -1
    glm::vec3 emission{0.0f};     ///< radiance [W m^-2 sr^-1]; from the front only unless double_sided
    bool double_sided = false;    ///< if not, the camera does not see back faces; light still stops there
};

/// Triangles of one material, in object space. Front faces are counter-clockwise.
struct Mesh {
    std::string name;
    std::vector<glm::vec3> positions;
    std::vector<glm::vec3> normals;  ///< empty (flat shading) or one unit vector per position
    std::vector<glm::vec2> uvs;      ///< empty or one per position
    std::vector<glm::uvec3> triangles;
    int material = 0;
};

struct Instance {
    std::string name;
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
    glm::dvec3 direction{0.0, 0.0, -1.0};  ///< unit, the way the light travels
    float range = std::numeric_limits<float>::infinity();  ///< [m], light fades to 0 there
    float inner_cone = 0.0f;   ///< half angle of full intensity [rad]; spot
    float outer_cone = 0.785f; ///< half angle of no intensity [rad], > inner_cone; spot
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
    glm::dvec3 origin{0.0};        ///< world position of scene-space zero
};

/// Loads a .gltf or .glb file, or builds a scene made in code when `source` starts with "demo:"
/// ("demo:cornell", "demo:atrium"; more in demo_scene_names()).
/// Warns through `log` of each feature that the file uses and this build ignores.
/// @throws Error not_found, bad_file, unsupported: one sentence that names file and culprit.
Scene load_scene(const std::string& source, const LogFunction& log = {});

/// Names of the built-in scenes, each beginning with "demo:".
std::vector<std::string> demo_scene_names();

/// The camera with that name, or with that number (0 is the first); "" gives the first one.
/// @throws Error not_found; the message lists the cameras there are.
const Camera& find_camera(const Scene& scene, const std::string& name_or_number);

/// Checks indices, ranges and finiteness of everything in `scene`.
/// @throws Error bad_file that names the element.
void validate(const Scene& scene);

struct Bounds {
    glm::dvec3 min{std::numeric_limits<double>::infinity()};
    glm::dvec3 max{-std::numeric_limits<double>::infinity()};
};
/// Scene-space bounding box of all instances; min > max if there is no geometry.
Bounds bounds_of(const Scene& scene);

}  // namespace rcs
