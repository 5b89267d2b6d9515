#include "gbuffer/visibility.h"

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <utility>

#include <gtest/gtest.h>
#include <glm/gtc/matrix_transform.hpp>

#include "rcs/error.h"

namespace {

using namespace rcs;

constexpr std::uint32_t kNone = 0xffffffffu;
using Id = std::pair<std::uint32_t, std::uint32_t>;  // instance, primitive

GlContext& gl()
{
    static GlContext context;
    return context;
}

Mesh mesh_of(std::vector<glm::vec3> positions, std::vector<glm::uvec3> triangles, int material = 0)
{
    Mesh mesh;
    mesh.positions = std::move(positions);
    mesh.triangles = std::move(triangles);
    mesh.material = material;
    return mesh;
}

/// A rectangle in the plane z that faces +z, towards the default camera.
Mesh quad(float x0, float y0, float x1, float y1, float z, int material = 0)
{
    return mesh_of({{x0, y0, z}, {x1, y0, z}, {x1, y1, z}, {x0, y1, z}}, {{0, 1, 2}, {0, 2, 3}}, material);
}

/// Material 0 is single-sided, material 1 double-sided; one instance of each mesh.
Scene scene_of(std::vector<Mesh> meshes)
{
    Scene scene;
    scene.materials.resize(2);
    scene.materials[1].double_sided = true;
    scene.meshes = std::move(meshes);
    for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
        scene.instances.emplace_back();
        scene.instances.back().mesh = static_cast<int>(m);
    }
    return scene;
}

/// A parallel view in which one unit is one pixel: image position (x, y) is the point (x, -y, *).
View pixel_view(int width, int height)
{
    View view;
    view.camera.projection = Projection::orthographic;
    view.camera.ymag = height / 2.0;
    const glm::dvec3 centre(width / 2.0, -height / 2.0, 0.0);
    view.camera.world_from_view = glm::translate(glm::dmat4(1.0), centre);
    view.width = width;
    view.height = height;
    return view;
}

View perspective_view(int width, int height, double yfov)
{
    View view;
    view.camera.yfov = yfov;
    view.width = width;
    view.height = height;
    return view;
}

Id id_at(const Visibility& visibility, const View& view, int x, int y)
{
    const std::size_t pixel =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(view.width) + static_cast<std::size_t>(x);
    return {visibility.instance[pixel], visibility.primitive[pixel]};
}

TEST(Visibility, OfATriangleIsThePixelsWhoseCentresItCovers)
{
    const Scene scene =
        scene_of({mesh_of({{1.25f, -1.25f, -1}, {1.25f, -6.25f, -1}, {6.25f, -1.25f, -1}}, {{0, 1, 2}})});
    const View view = pixel_view(9, 7);
    const Visibility seen = render_visibility(gl(), scene, view);
    int covered = 0;
    for (int y = 0; y < 7; ++y)
        for (int x = 0; x < 9; ++x) {
            const double dx = x + 0.5 - 1.25;
            const double dy = y + 0.5 - 1.25;
            const bool inside = dx > 0.0 && dy > 0.0 && dx + dy < 5.0;
            covered += inside;
            EXPECT_EQ(id_at(seen, view, x, y), inside ? Id(0, 0) : Id(kNone, kNone)) << x << " " << y;
        }
    EXPECT_EQ(covered, 15);
}

TEST(Visibility, OfAShiftedLensIsThatOfAPartOfALargerPicture)
{
    // Strips side by side and one above the other, each its own instance.
    std::vector<Mesh> meshes;
    for (int i = 0; i < 40; ++i) {
        const float x = -2.0f + 0.1f * static_cast<float>(i);
        meshes.push_back(quad(x, -2.0f, x + 0.093f, -1.5f + 0.17f * static_cast<float>(i % 7),
                              -2.0f - 0.01f * static_cast<float>(i)));
    }
    const Scene scene = scene_of(std::move(meshes));
    for (const Projection projection : {Projection::perspective, Projection::orthographic}) {
        View wide = perspective_view(160, 120, 2.0 * std::atan(0.9));
        wide.camera.projection = projection;
        wide.camera.ymag = 1.8;
        View part = wide;  // 40 x 30 pixels of it, half of their height to the right of its middle and one below
        part.width = 40;
        part.height = 30;
        part.camera.yfov = 2.0 * std::atan(0.9 / 4.0);
        part.camera.ymag = 1.8 / 4.0;
        part.camera.lens_shift = {0.5, -1.0};
        const Visibility whole = render_visibility(gl(), scene, wide), seen = render_visibility(gl(), scene, part);
        int covered = 0, different = 0;
        for (int y = 0; y < 30; ++y)
            for (int x = 0; x < 40; ++x) {
                const Id id = id_at(seen, part, x, y);
                covered += id.first != kNone;
                different += id != id_at(whole, wide, 60 + 15 + x, 45 + 30 + y);
            }
        EXPECT_GT(covered, 100);
        EXPECT_LE(different, 2) << "but for samples on an edge";
    }
}

TEST(Visibility, InPerspectiveFollowsTheFieldOfView)
{
    // At depth 2 a vertical field of view of 90 degrees is 4 high: 12 pixels, so 1/3 unit a pixel.
    const Scene scene = scene_of({quad(-1, 0, 1, 1, -2)});
    const View view = perspective_view(24, 12, std::acos(0.0));
    const Visibility seen = render_visibility(gl(), scene, view);
    for (int y = 0; y < 12; ++y)
        for (int x = 0; x < 24; ++x) {
            const bool inside = x >= 9 && x < 15 && y >= 3 && y < 6;
            EXPECT_EQ(id_at(seen, view, x, y).first, inside ? 0u : kNone) << x << " " << y;
        }
}

TEST(Visibility, ShowsTheNearerOfTwoQuadsInWhateverOrder)
{
    const View views[] = {pixel_view(4, 4), perspective_view(4, 4, 1.0)};
    for (const View& view : views) {
        const Mesh near = quad(-50, -50, 50, 50, -3);
        const Mesh far = quad(-50, -50, 50, 50, -3.01f);
        EXPECT_EQ(id_at(render_visibility(gl(), scene_of({near, far}), view), view, 1, 2).first, 0u);
        EXPECT_EQ(id_at(render_visibility(gl(), scene_of({far, near}), view), view, 1, 2).first, 1u);
    }
}

TEST(Visibility, ShowsTheFirstOfCoincidentQuads)
{
    const Scene scene = scene_of({quad(-50, -40, 50, 50, -3), quad(-50, -40, 50, 50, -3)});
    const View view = perspective_view(33, 17, 1.0);
    const Visibility seen = render_visibility(gl(), scene, view);
    for (const std::uint32_t instance : seen.instance) EXPECT_EQ(instance, 0u);
}

// Depth over 10^6 : 1, and a floor that begins below the camera: steps of 0.1 % of the distance stay apart.
TEST(Visibility, SeparatesLayersByAThousandthOfTheirDistance)
{
    std::vector<Mesh> meshes;
    for (const float depth : {0.01f, 1.0f, 100.0f, 10000.0f}) {
        meshes.push_back(quad(-depth, -depth, depth, depth, -depth * 1.001f, 1));
        meshes.push_back(quad(-depth, -depth, depth, depth, -depth, 1));
        for (Mesh* mesh : {&meshes[meshes.size() - 2], &meshes.back()})
            for (glm::vec3& p : mesh->positions) p.y += 0.95f * depth;  // lets farther layers show below
    }
    const float floor = -1.0f;
    for (const float y : {floor * 1.001f, floor})
        meshes.push_back(
            mesh_of({{-1e4f, y, 50}, {1e4f, y, 50}, {1e4f, y, -1e4f}, {-1e4f, y, -1e4f}}, {{0, 1, 2}, {0, 2, 3}}, 1));
    const View view = perspective_view(101, 101, 1.5);
    const Visibility seen = render_visibility(gl(), scene_of(meshes), view);
    for (std::size_t i = 0; i < seen.instance.size(); ++i)
        EXPECT_TRUE(seen.instance[i] == kNone || seen.instance[i] % 2 == 1) << i << " sees " << seen.instance[i];
    EXPECT_EQ(id_at(seen, view, 50, 90).first, 9u);
}

TEST(Visibility, LeavesOutBackFacesOfSingleSidedMaterials)
{
    const View view = pixel_view(4, 4);
    for (const int material : {0, 1}) {
        Mesh back = quad(0, -4, 4, 0, -1, material);
        for (glm::uvec3& t : back.triangles) std::swap(t.y, t.z);
        const Id expected = material == 0 ? Id(1, 0) : Id(0, 0);
        const Visibility seen = render_visibility(gl(), scene_of({back, quad(0, -4, 4, 0, -2)}), view);
        EXPECT_EQ(id_at(seen, view, 2, 0).first, expected.first);
    }
}

TEST(Visibility, TakesAMirroredInstancesFrontsForFronts)
{
    const View view = pixel_view(4, 4);
    Scene scene = scene_of({quad(-4, -4, 0, 0, -1)});
    scene.instances[0].world_from_object = glm::scale(glm::dmat4(1.0), glm::dvec3(-1, 1, 1));
    const Visibility seen = render_visibility(gl(), scene, view);
    for (const std::uint32_t instance : seen.instance) EXPECT_EQ(instance, 0u);

    scene.instances[0].world_from_object =
        glm::scale(glm::dmat4(1.0), glm::dvec3(-1, 1, -1)) * glm::translate(glm::dmat4(1.0), glm::dvec3(0, 0, 2));
    for (const std::uint32_t instance : render_visibility(gl(), scene, view).instance)
        EXPECT_EQ(instance, kNone);  // turned by 180 degrees: its back
}

TEST(Visibility, SamplesAtThePixelOffset)
{
    const Scene scene = scene_of({quad(0, -2.7f, 3.3f, 0, -1)});
    for (const Projection projection : {Projection::orthographic, Projection::perspective})
        for (const double ox : {0.0, 0.2, 0.4, 0.99})
            for (const double oy : {0.1, 0.6, 0.8}) {
                View view = pixel_view(7, 5);
                view.camera.projection = projection;
                view.camera.yfov = 2.0 * std::atan(2.5);  // 5 units high at depth 1
                view.pixel_offset = {ox, oy};
                const Visibility seen = render_visibility(gl(), scene, view);
                EXPECT_EQ(id_at(seen, view, 2, 1).first, 0u);
                EXPECT_EQ(id_at(seen, view, 3, 0).first == 0, 3 + ox < 3.3) << ox;
                EXPECT_EQ(id_at(seen, view, 1, 2).first == 0, 2 + oy < 2.7) << oy;
                EXPECT_EQ(id_at(seen, view, 4, 0).first, kNone);
                EXPECT_EQ(id_at(seen, view, 1, 3).first, kNone);
            }
}

TEST(Visibility, EndsAtTheCameraPlane)
{
    View view = pixel_view(4, 4);
    // A slope whose upper half lies in front of the plane and whose lower half behind it.
    const Scene slope = scene_of({mesh_of({{0, 0, -2}, {0, -4, 2}, {4, -4, 2}, {4, 0, -2}}, {{0, 1, 2}, {0, 2, 3}})});
    const Visibility seen = render_visibility(gl(), slope, view);
    for (int x = 0; x < 4; ++x)
        for (int y = 0; y < 4; ++y) EXPECT_EQ(id_at(seen, view, x, y).first, y < 2 ? 0u : kNone) << x << " " << y;
    const Scene behind = scene_of({quad(0, -4, 4, 0, 0.5f, 1)});
    for (const std::uint32_t i : render_visibility(gl(), behind, view).instance) EXPECT_EQ(i, kNone);
    view.camera.projection = Projection::perspective;
    for (const std::uint32_t i : render_visibility(gl(), behind, view).instance) EXPECT_EQ(i, kNone);
}

TEST(Visibility, TakesAnyImageSize)
{
    const std::pair<int, int> sizes[] = {{1, 1}, {1, 4096}, {8193, 3}, {3, 16384}};
    for (const auto& [width, height] : sizes) {
        const float half_width = 2.0f + 2.0f * static_cast<float>(width) / static_cast<float>(height);
        const Scene scene = scene_of({quad(-half_width, -2, half_width, 2, -3)});
        const Visibility seen = render_visibility(gl(), scene, perspective_view(width, height, 1.0));
        ASSERT_EQ(seen.instance.size(), static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
        std::size_t holes = 0;
        for (const std::uint32_t instance : seen.instance) holes += instance != 0;
        EXPECT_EQ(holes, 0u) << width << " x " << height;
    }
}

TEST(Visibility, RefusesAnImageThatTheGlCannotDraw)
{
    const Scene scene = scene_of({quad(-1, -1, 1, 1, -3)});
    try {
        render_visibility(gl(), scene, perspective_view(1 << 20, 1, 1.0));
        FAIL() << "nothing was thrown";
    } catch (const Error& e) {
        EXPECT_EQ(static_cast<int>(e.code()), static_cast<int>(ErrorCode::unsupported));
    }
}

// 4.5 million pixels are drawn in two bands.
TEST(Visibility, OfALargeImageHasNoSeamBetweenItsBands)
{
    const View view = pixel_view(3000, 1500);
    const Scene scene = scene_of({mesh_of({{0, 0, -1}, {0, -1500, -1}, {3000, 0, -1}}, {{0, 1, 2}})});
    const Visibility seen = render_visibility(gl(), scene, view);
    std::size_t wrong = 0;
    for (int y = 0; y < view.height; ++y)
        for (int x = 0; x < view.width; ++x) {
            const double inside = 1.0 - (x + 0.5) / 3000 - (y + 0.5) / 1500;
            if (std::abs(inside) < 1e-5) continue;  // on the edge, to 1/256 px
            wrong += (id_at(seen, view, x, y).first == 0) != (inside > 0.0);
        }
    EXPECT_EQ(wrong, 0u);
}

TEST(Visibility, OfASceneWithoutGeometryIsEmpty)
{
    for (const std::uint32_t i : render_visibility(gl(), Scene{}, perspective_view(2, 2, 1.0)).instance)
        EXPECT_EQ(i, kNone);
}

/// The nearest triangle along a ray (Cramer's rule on origin + t direction = a + u (b-a) + v (c-a)).
Id nearest_hit(const Scene& scene, const CameraRay& ray)
{
    Id nearest(kNone, kNone);
    double nearest_t = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        const Mesh& mesh = scene.meshes[static_cast<std::size_t>(scene.instances[i].mesh)];
        const bool both_sides = scene.materials[static_cast<std::size_t>(mesh.material)].double_sided;
        for (std::size_t k = 0; k < mesh.triangles.size(); ++k) {
            std::array<glm::dvec3, 3> p;
            for (int c = 0; c < 3; ++c)
                p[static_cast<std::size_t>(c)] =
                    glm::dvec3(scene.instances[i].world_from_object *
                               glm::dvec4(glm::dvec3(mesh.positions[mesh.triangles[k][c]]), 1.0));
            const glm::dvec3 e1 = p[1] - p[0];
            const glm::dvec3 e2 = p[2] - p[0];
            const glm::dvec3 normal = glm::cross(e1, e2);
            const double facing = -glm::dot(normal, ray.direction);
            const bool mirrored = glm::determinant(glm::dmat3(scene.instances[i].world_from_object)) < 0.0;
            if (facing == 0.0 || (!both_sides && (mirrored ? facing > 0.0 : facing < 0.0))) continue;
            const glm::dvec3 s = ray.origin - p[0];
            const double t = glm::dot(normal, s) / facing;
            const double u = glm::dot(e2, glm::cross(s, ray.direction)) / facing;
            const double v = -glm::dot(e1, glm::cross(s, ray.direction)) / facing;
            if (t <= 0.0 || u < 0.0 || v < 0.0 || u + v > 1.0 || t >= nearest_t) continue;
            nearest_t = t;
            nearest = {static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(k)};
        }
    }
    return nearest;
}

/// Triangles all around the camera, some behind it, some large enough to reach from before to behind it.
Scene triangle_soup(unsigned seed, int count)
{
    std::mt19937 engine(seed);
    std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
    const auto point = [&](float scale) {
        const float x = uniform(engine);
        const float y = uniform(engine);
        return scale * glm::vec3(x, y, uniform(engine));
    };
    Scene scene = scene_of({Mesh{}, Mesh{}, Mesh{}});
    for (int k = 0; k < count; ++k) {
        Mesh& mesh = scene.meshes[static_cast<std::size_t>(k % 3)];
        const glm::vec3 centre = point(10.0f);
        const float size = k % 10 == 0 ? 12.0f : 2.0f;
        const unsigned first = static_cast<unsigned>(mesh.positions.size());
        for (int c = 0; c < 3; ++c) mesh.positions.push_back(centre + point(size));
        mesh.triangles.push_back({first, first + 1, first + 2});
    }
    scene.meshes[1].material = 1;
    scene.instances[1].world_from_object = glm::rotate(glm::dmat4(1.0), 0.7, glm::dvec3(1, 2, 3));
    scene.instances[2].world_from_object = glm::scale(glm::dmat4(1.0), glm::dvec3(1, -1.5, 1));
    return scene;
}

/// What GL sees at a pixel must be what a ray sees somewhere within `reach` pixels of the sample: GL moves
/// corners to a grid of 1/256 px (its eight subpixel bits), so by at most 1/512 px along each axis.
void expect_same_as_rays(const Scene& scene, const View& view)
{
    const double reach = 1.0 / 256;
    const Visibility seen = render_visibility(gl(), scene, view);
    int differ = 0;
    int covered = 0;
    for (int y = 0; y < view.height; ++y)
        for (int x = 0; x < view.width; ++x) {
            const Id id = id_at(seen, view, x, y);
            const double at_x = x + view.pixel_offset.x;
            const double at_y = y + view.pixel_offset.y;
            covered += id.first != kNone;
            if (nearest_hit(scene, camera_ray(view, at_x, at_y)) == id) continue;
            ++differ;
            bool found = false;
            for (int k = 0; k < 32 && !found; ++k) {
                const double angle = 0.19634954 * k;  // 2 pi / 32
                found = nearest_hit(scene, camera_ray(view, at_x + reach * std::cos(angle),
                                                      at_y + reach * std::sin(angle))) == id;
            }
            EXPECT_TRUE(found) << x << " " << y << " sees " << id.first << ":" << id.second;
        }
    const int pixels = view.width * view.height;
    EXPECT_GT(covered, pixels / 4);
    // Edges cross about a tenth of the pixels of this picture, and move by at most a hundredth of a pixel.
    EXPECT_LE(differ, pixels / 500);
}

TEST(Visibility, OfATriangleSoupIsWhatRaysSee)
{
    for (const unsigned seed : {1u, 2u, 3u}) {
        const Scene scene = triangle_soup(seed, 200);
        View view = perspective_view(97, 71, 0.3 + 0.7 * seed);
        view.camera = look_at_camera("", {1, 2, 3}, {-2, 1.5 * seed, -1}, view.camera.yfov);
        view.pixel_offset = {0.25 * seed, 0.5};
        expect_same_as_rays(scene, view);
        view.camera.projection = Projection::orthographic;
        view.camera.ymag = 6.0;
        expect_same_as_rays(scene, view);
    }
}

}  // namespace
