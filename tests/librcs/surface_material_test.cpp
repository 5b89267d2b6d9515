#include "rays/surface_material.h"

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <glm/gtc/matrix_transform.hpp>

#include "material/normal_map.h"
#include "rays/surface.h"
#include "rcs/thread_pool.h"
#include "scene/texture.h"
#include "support/lobes.h"
#include "support/scenes.h"
#include "util/random.h"

namespace rcs::test {
namespace {

constexpr float kCode = 1.0f / 65535.0f;

/// One unit square in z = 0 that faces +z, uv = (x, 1 - y): v runs down as in glTF's images.
struct Square {
    Scene scene;
    Material& material() { return scene.materials[0]; }
    Mesh& mesh() { return scene.meshes[0]; }

    Square()
    {
        scene.materials.emplace_back();
        Mesh m = quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0);
        for (const glm::vec3& p : m.positions) {
            m.uvs.emplace_back(p.x, 1.0f - p.y);
            m.uvs1.emplace_back(0.5f * p.x, 0.25f);
        }
        add_mesh(scene, m);
    }

    int add(int width, int height, const std::vector<glm::vec4>& texels)
    {
        Texture::Level level{width, height, {}};
        for (const glm::vec4& t : texels) {
            std::array<std::uint16_t, 4> codes{};
            for (int c = 0; c < 4; ++c)
                codes[static_cast<std::size_t>(c)] = static_cast<std::uint16_t>(t[c] * 65535.0f + 0.5f);
            level.texels.push_back(codes);
        }
        scene.textures.push_back(make_texture("t", std::move(level)));
        return static_cast<int>(scene.textures.size()) - 1;
    }

    /// Seen along `outgoing` (unit, towards the viewer) at (x, y) of the square.
    MaterialValues at(float x, float y, glm::vec3 outgoing = {0, 0, 1}, TextureFilter filter = {})
    {
        ThreadPool pool(1);
        const RayScene rays = build_ray_scene(scene, pool);
        // By hand: rays go on where there is no coverage. Triangles (0,0) (1,0) (1,1) and (0,0) (1,1) (0,1).
        const Hit hit = x >= y ? Hit{1.0f, x - y, y, 0, 0} : Hit{1.0f, x, y - x, 0, 1};
        const SurfacePoint point = surface_at(rays, hit.instance, hit.primitive, hit.u, hit.v, -outgoing);
        return material_at(rays, hit, point, outgoing, filter);
    }
};

void expect_near(glm::vec3 value, glm::vec3 expected, float tolerance, const std::string& what = "")
{
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(value[c], expected[c], tolerance) << what << " channel " << c;
}

TEST(MaterialAt, ADefaultMaterialIsLambertian)
{
    Square s;
    s.material().base_color = {0.3f, 0.5f, 0.7f};
    const MaterialValues v = s.at(0.4f, 0.3f);
    EXPECT_EQ(lobe_of<Diffuse>(v.bsdf).color, s.material().base_color);
    EXPECT_EQ(v.bsdf.count, 1u);
    EXPECT_EQ(v.alpha, 1.0f);
    expect_near(v.bsdf.normal, {0, 0, 1}, 1e-6f);
}

TEST(MaterialAt, FollowsTheGltfFormulasOfMetalAndDielectric)
{
    Square s;
    Material& m = s.material();
    m.base_color = {0.8f, 0.6f, 0.4f};
    m.specular = 1.0f;
    m.roughness = 0.5f;
    MaterialValues v = s.at(0.4f, 0.3f);
    expect_near(lobe_of<Specular>(v.bsdf).color, glm::vec3(0.04f), 1e-6f);
    EXPECT_FLOAT_EQ(lobe_of<Specular>(v.bsdf).level, 1.0f);
    EXPECT_FLOAT_EQ(lobe_of<Specular>(v.bsdf).alpha, 0.25f);
    expect_near(lobe_of<Diffuse>(v.bsdf).color, m.base_color, 1e-6f);

    m.metallic = 1.0f;
    v = s.at(0.4f, 0.3f);
    expect_near(lobe_of<Specular>(v.bsdf).color, m.base_color, 1e-6f);
    EXPECT_EQ(lobe_of<Diffuse>(v.bsdf).color, glm::vec3(0.0f));

    m.metallic = 0.25f;
    m.specular = 0.5f;
    m.ior = 2.0f;  // f0 1/9
    m.specular_color = {1.0f, 20.0f, 0.5f};
    v = s.at(0.4f, 0.3f);
    // glTF: min(f0 tint, 1) specular, mixed with the metal by 1/4
    expect_near(lobe_of<Specular>(v.bsdf).color,
                {0.75f * 0.5f / 9.0f + 0.2f, 0.75f * 0.5f + 0.15f, 0.75f * 0.25f / 9.0f + 0.1f}, 1e-5f);
    EXPECT_FLOAT_EQ(lobe_of<Specular>(v.bsdf).level, 0.75f * 0.5f + 0.25f);
    expect_near(lobe_of<Diffuse>(v.bsdf).color, 0.75f * m.base_color, 1e-6f);
    m.roughness = 0.0f;
    EXPECT_FLOAT_EQ(lobe_of<Specular>(s.at(0.4f, 0.3f).bsdf).alpha, kLeastAlpha);
}

TEST(MaterialAt, TransmissionTakesItsShareOfTheDiffusePart)
{
    Square s;
    s.material().base_color = {0.8f, 0.6f, 0.4f};
    s.material().specular = 1.0f;
    s.material().transmission = 0.75f;
    const MaterialValues v = s.at(0.4f, 0.3f);
    expect_near(lobe_of<Diffuse>(v.bsdf).color, 0.25f * s.material().base_color, 1e-6f);
    expect_near(lobe_of<Transmission>(v.bsdf).color, 0.75f * s.material().base_color, 1e-6f);
}

TEST(MaterialAt, EachTextureScalesItsOwnValue)
{
    Square s;
    Material& m = s.material();
    const int t = s.add(1, 1, {{0.2f, 0.4f, 0.6f, 0.8f}});
    m.specular = m.metallic = m.roughness = m.clearcoat = m.clearcoat_roughness = 1.0f;
    m.alpha_mode = AlphaMode::blend;
    m.emission = {10, 10, 10};
    const auto value = [&](TextureSlot Material::* slot) {
        (m.*slot).texture = t;
        const MaterialValues v = s.at(0.3f, 0.3f);
        (m.*slot).texture = -1;
        return v;
    };
    expect_near(lobe_of<Specular>(value(&Material::base_color_texture).bsdf).color, {0.2f, 0.4f, 0.6f}, kCode);
    EXPECT_NEAR(value(&Material::base_color_texture).alpha, 0.8f, kCode);
    expect_near(value(&Material::emission_texture).emission, {2, 4, 6}, 20 * kCode);
    EXPECT_NEAR(lobe_of<Specular>(value(&Material::metallic_roughness_texture).bsdf).alpha, 0.4f * 0.4f, 2 * kCode);
    expect_near(lobe_of<Diffuse>(value(&Material::metallic_roughness_texture).bsdf).color, glm::vec3(0.4f), 2 * kCode);
    EXPECT_NEAR(lobe_of<Coat>(value(&Material::clearcoat_texture).bsdf).level, 0.2f, kCode);
    EXPECT_NEAR(lobe_of<Coat>(value(&Material::clearcoat_roughness_texture).bsdf).alpha, 0.4f * 0.4f, 2 * kCode);
    m.metallic = 0.0f;
    EXPECT_NEAR(lobe_of<Specular>(value(&Material::specular_texture).bsdf).level, 0.8f, kCode);
    expect_near(lobe_of<Specular>(value(&Material::specular_color_texture).bsdf).color,
                0.04f * glm::vec3(0.2f, 0.4f, 0.6f), kCode);
    m.transmission = 1.0f;
    expect_near(lobe_of<Transmission>(value(&Material::transmission_texture).bsdf).color, glm::vec3(0.2f), kCode);
}

TEST(MaterialAt, VertexColoursMultiplyColourAndAlpha)
{
    Square s;
    s.material().base_color = glm::vec3(0.5f);
    s.material().alpha_mode = AlphaMode::blend;
    s.mesh().colors = {{0, 0, 0, 0}, {1, 0, 0, 0}, {1, 1, 0, 1}, {0, 1, 0, 1}};  // red = x, green = y = alpha
    const MaterialValues v = s.at(0.25f, 0.125f);
    expect_near(lobe_of<Diffuse>(v.bsdf).color, {0.125f, 0.0625f, 0.0f}, 1e-6f);
    EXPECT_NEAR(v.alpha, 0.125f, 1e-6f);
}

TEST(MaterialAt, TheSecondUvSetAndTheTransformAreApplied)
{
    Square s;
    s.material().base_color_texture.texture =
        s.add(4, 1, {{0.1f, 0, 0, 1}, {0.2f, 0, 0, 1}, {0.3f, 0, 0, 1}, {0.4f, 0, 0, 1}});
    TextureSlot& slot = s.material().base_color_texture;
    slot.nearest = true;
    EXPECT_NEAR(lobe_of<Diffuse>(s.at(0.9f, 0.5f).bsdf).color.r, 0.4f, kCode);
    slot.uv_set = 1;  // u = x / 2
    EXPECT_NEAR(lobe_of<Diffuse>(s.at(0.9f, 0.5f).bsdf).color.r, 0.2f, kCode);
    slot.texture_from_uv = {1, 0, 0, 1, 0.5f, 0};
    EXPECT_NEAR(lobe_of<Diffuse>(s.at(0.9f, 0.5f).bsdf).color.r, 0.4f, kCode);
    slot.texture_from_uv = {2, 0, 0, 1, 0, 0};
    EXPECT_NEAR(lobe_of<Diffuse>(s.at(0.6f, 0.5f).bsdf).color.r, 0.3f, kCode);
    // A filter given in the first set covers half as much of the second: two of four texels, not all.
    slot = {.texture = 0, .uv_set = 1};
    const TextureFilter wide{{4.0f, 0.0f}, {0.0f, 1.0f}};
    EXPECT_NEAR(lobe_of<Diffuse>(s.at(0.6f, 0.5f, {0, 0, 1}, wide).bsdf).color.r, 0.25f, 0.01f);
}

TEST(MaterialAt, MasksAndBlendsAndIsOpaqueOtherwise)
{
    Square s;
    s.material().base_color_texture.texture = s.add(2, 1, {{1, 1, 1, 0.4f}, {1, 1, 1, 0.6f}});
    s.material().base_color_texture.nearest = true;
    EXPECT_EQ(s.at(0.2f, 0.5f).alpha, 1.0f);
    s.material().alpha_mode = AlphaMode::mask;
    EXPECT_EQ(s.at(0.2f, 0.5f).alpha, 0.0f);
    EXPECT_EQ(s.at(0.8f, 0.5f).alpha, 1.0f);
    s.material().alpha_mode = AlphaMode::blend;
    s.material().alpha = 0.5f;
    EXPECT_NEAR(s.at(0.2f, 0.5f).alpha, 0.2f, kCode);
    EXPECT_NEAR(alpha_at(s.scene, s.mesh(), 0, 0.7f, 0.2f), 0.3f, kCode);  // triangle 0: x = u + v = 0.9
    EXPECT_NEAR(alpha_at(s.scene, s.mesh(), 1, 0.1f, 0.8f), 0.2f, kCode);  // triangle 1: x = u = 0.1
}

TEST(MaterialAt, UnlitShowsItsColourAndReflectsNothing)
{
    Square s;
    s.material().base_color = {0.2f, 0.3f, 0.4f};
    s.material().specular = 1.0f;
    s.material().unlit = true;
    const MaterialValues v = s.at(0.5f, 0.4f);
    EXPECT_EQ(v.emission, s.material().base_color);
    EXPECT_EQ(lobe_of<Diffuse>(v.bsdf).color, glm::vec3(0.0f));
    EXPECT_EQ(v.bsdf.count, 0u);
}

TEST(MaterialAt, EmitsFromTheFrontUnlessDoubleSided)
{
    Square s;
    s.material().emission = {1, 2, 3};
    EXPECT_EQ(s.at(0.5f, 0.4f).emission, glm::vec3(1, 2, 3));
    EXPECT_EQ(s.at(0.5f, 0.4f, {0, 0, -1}).emission, glm::vec3(0.0f));
    s.material().double_sided = true;
    EXPECT_EQ(s.at(0.5f, 0.4f, {0, 0, -1}).emission, glm::vec3(1, 2, 3));
}

/// A normal texture of one texel that leans towards u by atan(0.6 / 0.8), and towards -v by none.
constexpr glm::vec4 kLeanU{0.8f, 0.5f, 0.9f, 1.0f};
constexpr glm::vec4 kLeanUp{0.5f, 0.8f, 0.9f, 1.0f};

TEST(NormalMap, RedLeansAlongUAndGreenUpTheImage)
{
    Square s;
    s.material().normal_texture.texture = s.add(1, 1, {kLeanU});
    expect_near(s.at(0.4f, 0.3f).bsdf.normal, {0.6f, 0.0f, 0.8f}, 1e-4f);
    s.material().normal_texture.texture = s.add(1, 1, {kLeanUp});
    expect_near(s.at(0.4f, 0.3f).bsdf.normal, {0.0f, 0.6f, 0.8f}, 1e-4f);
    s.material().normal_scale = 0.5f;
    expect_near(s.at(0.4f, 0.3f).bsdf.normal, glm::normalize(glm::vec3(0.0f, 0.3f, 0.8f)), 1e-4f);
    s.material().normal_scale = -1.0f;
    expect_near(s.at(0.4f, 0.3f).bsdf.normal, {0.0f, -0.6f, 0.8f}, 1e-4f);
}

TEST(NormalMap, GivenTangentsSayTheSameAsTextureCoordinates)
{
    for (const glm::vec4 texel : {kLeanU, kLeanUp}) {
        for (const bool mirrored_uv : {false, true}) {
            for (const double mirror : {1.0, -1.0}) {
                Square s;
                if (mirrored_uv)
                    for (glm::vec2& uv : s.mesh().uvs) uv.x = 1.0f - uv.x;
                s.material().normal_texture.texture = s.add(1, 1, {texel});
                s.material().double_sided = true;
                s.scene.instances[0].world_from_object = glm::rotate(glm::dmat4(1.0), 0.4, {0.0, 0.0, 1.0}) *
                                                         glm::scale(glm::dmat4(1.0), {mirror, 1.0, 1.0});
                const glm::vec3 derived = s.at(0.4f, 0.3f).bsdf.normal;
                s.mesh().normals.assign(4, {0, 0, 1});
                s.mesh().tangents.assign(4, mirrored_uv ? glm::vec4(-1, 0, 0, -1) : glm::vec4(1, 0, 0, 1));
                expect_near(s.at(0.4f, 0.3f).bsdf.normal, derived, 1e-4f);
            }
        }
    }
}

TEST(NormalMap, OfWhatMirrorsNothingIsTheSameFromEverywhere)
{
    Square s;
    s.material().normal_texture.texture = s.add(1, 1, {kLeanU});
    const glm::vec3 low = glm::normalize(glm::vec3(-1.0f, 0.0f, 0.1f));
    expect_near(s.at(0.4f, 0.3f, low).bsdf.normal, {0.6f, 0.0f, 0.8f}, 1e-4f);
    // Never further from the surface than where half of what it looks at is inside.
    s.material().normal_texture.texture = s.add(1, 1, {glm::vec4(1.0f, 0.5f, 0.5f, 1.0f)});
    EXPECT_NEAR(s.at(0.4f, 0.3f, low).bsdf.normal.z, 0.1f, 1e-3f);
    s.material().metallic = 1.0f;  // what mirrors is bent to the viewer
    EXPECT_GT(glm::dot(s.at(0.4f, 0.3f, low).bsdf.normal, low), 0.0f);
}

TEST(NormalMap, IsReadAsItWasBaked)
{
    // Baking divides a normal by what is interpolated between the corners as it comes out, short where corners differ.
    Square s;
    s.material().normal_texture.texture = s.add(1, 1, {kLeanU});
    const glm::vec3 left = glm::normalize(glm::vec3(-1, 0, 1)), right = glm::normalize(glm::vec3(1, 0, 1));
    const glm::vec3 along_left = glm::normalize(glm::vec3(1, 0, 1)), along_right = glm::normalize(glm::vec3(1, 0, -1));
    for (const glm::vec3 p : s.mesh().positions) {
        s.mesh().normals.push_back(p.x < 0.5f ? left : right);
        s.mesh().tangents.emplace_back(p.x < 0.5f ? along_left : along_right, 1.0f);
    }
    const glm::vec3 normal = glm::mix(left, right, 0.25f), tangent = glm::mix(along_left, along_right, 0.25f);
    expect_near(s.at(0.25f, 0.4f).bsdf.normal, glm::normalize(0.6f * tangent + 0.8f * normal), 1e-4f);
    // A stretched object turns it as it turns normals.
    s.scene.instances[0].world_from_object = glm::scale(glm::dmat4(1.0), {2.0, 1.0, 1.0});
    const glm::vec3 bent = 0.6f * tangent + 0.8f * normal;
    expect_near(s.at(0.25f, 0.4f).bsdf.normal, glm::normalize(bent * glm::vec3(0.5f, 1.0f, 1.0f)), 1e-4f);
}

TEST(NormalMap, TheBackIsTheFrontTurnedInsideOut)
{
    Square s;
    s.material().normal_texture.texture = s.add(1, 1, {kLeanU});
    expect_near(s.at(0.4f, 0.3f, {0, 0, -1}).bsdf.normal, {-0.6f, 0.0f, -0.8f}, 1e-4f);
}

TEST(NormalMap, NeverBendsTheMirrorDirectionBelowTheSurface)
{
    RandomStream random(5);
    const auto on_hemisphere = [&] {
        const float z = std::max(1e-5f, random.next() * random.next());
        const float phi = 6.2831853f * random.next();
        return glm::vec3(std::sqrt(1.0f - z * z) * std::cos(phi), std::sqrt(1.0f - z * z) * std::sin(phi), z);
    };
    const glm::vec3 up(0, 0, 1);
    for (int i = 0; i < 20000; ++i) {
        const glm::vec3 shading = on_hemisphere(), outgoing = on_hemisphere();
        const glm::vec3 n = keep_mirror_above(shading, up, outgoing);
        const glm::vec3 mirrored = 2.0f * glm::dot(n, outgoing) * n - outgoing;
        EXPECT_GT(mirrored.z, 0.0f);
        EXPECT_GT(glm::dot(n, outgoing), 0.0f);
        EXPECT_NEAR(glm::length(n), 1.0f, 1e-5f);
        const glm::vec3 before = 2.0f * glm::dot(shading, outgoing) * shading - outgoing;
        if (before.z > 0.01f) {
            EXPECT_EQ(n, shading);
        }
    }
}

TEST(NormalMap, WithoutTextureCoordinatesTheNormalStays)
{
    Square s;
    s.mesh().uvs.clear();
    s.material().normal_texture.texture = s.add(1, 1, {kLeanU});
    expect_near(s.at(0.4f, 0.3f).bsdf.normal, {0, 0, 1}, 1e-6f);
}

/// The definition of each wrap mode on texel indices.
int wrapped_index(int i, int n, Wrap wrap)
{
    if (wrap == Wrap::clamp_to_edge) return std::clamp(i, 0, n - 1);
    if (wrap == Wrap::repeat) return ((i % n) + n) % n;
    const int j = ((i % (2 * n)) + 2 * n) % (2 * n);
    return j < n ? j : 2 * n - 1 - j;
}

TEST(SampleSlot, WrapsAsItsSamplerSays)
{
    Square s;
    const int width = 5, height = 3;
    RandomStream random(11);
    std::vector<glm::vec4> texels;
    for (int i = 0; i < width * height; ++i)
        texels.emplace_back(random.next(), random.next(), random.next(), random.next());
    TextureSlot slot{.texture = s.add(width, height, texels)};
    for (const Wrap wrap_u : {Wrap::repeat, Wrap::mirrored_repeat, Wrap::clamp_to_edge}) {
        for (const Wrap wrap_v : {Wrap::repeat, Wrap::mirrored_repeat, Wrap::clamp_to_edge}) {
            slot.wrap_u = wrap_u;
            slot.wrap_v = wrap_v;
            for (int n = 0; n < 500; ++n) {
                const glm::vec2 uv(8.0f * random.next() - 4.0f, 8.0f * random.next() - 4.0f);
                const double x = static_cast<double>(uv.x) * width - 0.5, y = static_cast<double>(uv.y) * height - 0.5;
                glm::dvec4 expected(0.0);
                for (int j = 0; j < 2; ++j)
                    for (int i = 0; i < 2; ++i) {
                        const int column = static_cast<int>(std::floor(x)) + i,
                                  row = static_cast<int>(std::floor(y)) + j;
                        const double weight = (1.0 - std::fabs(x - column)) * (1.0 - std::fabs(y - row));
                        expected +=
                            weight *
                            glm::dvec4(texels[static_cast<std::size_t>(wrapped_index(row, height, wrap_v) * width +
                                                                       wrapped_index(column, width, wrap_u))]);
                    }
                slot.nearest = false;
                const glm::vec4 value = sample_slot(s.scene, slot, uv, glm::vec2(0.0f), glm::vec2(0.0f));
                for (int c = 0; c < 4; ++c) EXPECT_NEAR(value[c], expected[c], 2e-5);

                slot.nearest = true;
                const auto nearest = texels[static_cast<std::size_t>(
                    wrapped_index(static_cast<int>(std::floor(uv.y * height)), height, wrap_v) * width +
                    wrapped_index(static_cast<int>(std::floor(uv.x * width)), width, wrap_u))];
                const glm::vec4 one = sample_slot_nearest(s.scene, slot, uv, 0);
                if (std::fabs(x - std::floor(x) - 0.5) > 1e-4 && std::fabs(y - std::floor(y) - 0.5) > 1e-4) {
                    EXPECT_NEAR(one.r, nearest.r, kCode);
                    EXPECT_EQ(sample_slot(s.scene, slot, uv, glm::vec2(0.0f), glm::vec2(0.0f)), one);
                }
            }
        }
    }
    EXPECT_EQ(sample_slot_nearest(s.scene, TextureSlot{}, {0.5f, 0.5f}, 3), glm::vec4(1.0f));
}

TEST(MakeTexture, KeepsTheMeanOfAlpha)
{
    Square s;
    RandomStream random(2);
    std::vector<glm::vec4> texels;
    double sum = 0.0;
    for (int i = 0; i < 13 * 7; ++i) {
        texels.emplace_back(0.5f, 0.5f, 0.5f, random.next());
        sum += static_cast<double>(texels.back().a) / (13 * 7);
    }
    const Texture& t = s.scene.textures[static_cast<std::size_t>(s.add(13, 7, texels))];
    EXPECT_NEAR(texel_value(t.levels.back(), 0, 0).a, sum, 3 * kCode);
}

}  // namespace
}  // namespace rcs::test
