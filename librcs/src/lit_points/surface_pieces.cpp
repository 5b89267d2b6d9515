#include "lit_points/surface_pieces.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "rays/hit_surface.h"
#include "rays/ray_scene_impl.h"
#include "scene/mesh_traits.h"
#include "util/random.h"

namespace rcs {
namespace {

// Triangles looked at; of more, a part.
constexpr double kMostTriangles = 1 << 20;
// A piece's longest edge may be so many edges of the cell about its middle.
constexpr float kCellsLong = 6.0f;
// ... and so many times that where nothing is seen: importance looks as far around.
constexpr float kUnseenLonger = 8.0f;
constexpr int kMostHalvings = 14;  // of a triangle
constexpr std::size_t kPiecesOfARange = 1024;

struct Corner {
    glm::vec2 weights;
    glm::vec3 position;
};

Corner middle(const Corner& a, const Corner& b)
{
    return {0.5f * (a.weights + b.weights), 0.5f * (a.position + b.position)};
}

/// Cuts the longest edge until the piece is small.
void cut(const SurfaceCut& of, const std::array<Corner, 3>& c, int halvings, SurfacePiece piece,
         std::vector<SurfacePiece>& out)
{
    const glm::vec3 centre = (c[0].position + c[1].position + c[2].position) / 3.0f;
    std::size_t longest = 0;
    float length2[3];
    for (std::size_t i = 0; i < 3; ++i) {
        const glm::vec3 edge = c[(i + 1) % 3].position - c[i].position;
        length2[i] = glm::dot(edge, edge);
        if (length2[i] > length2[longest]) longest = i;
    }
    const CellGrid& grid = of.importance.grid();
    float most = kCellsLong / static_cast<float>(std::sqrt(of.part)) * grid.edge(grid.level(centre));
    if (length2[longest] > most * most && !(of.importance.at(centre, piece.normal).seen > 0.0f)) most *= kUnseenLonger;
    if (length2[longest] > most * most && halvings < kMostHalvings) {
        piece.area *= 0.5f;
        const Corner &a = c[longest], &b = c[(longest + 1) % 3], &opposite = c[(longest + 2) % 3];
        const Corner m = middle(a, b);
        cut(of, {a, m, opposite}, halvings + 1, piece, out);
        cut(of, {m, b, opposite}, halvings + 1, piece, out);
        return;
    }
    for (std::size_t i = 0; i < 3; ++i) {
        piece.corner[i] = c[i].weights;
        piece.probe[i] = 0.5f * (centre + c[i].position);
    }
    piece.probe[3] = centre;
    out.push_back(piece);
}

struct Range {
    std::uint32_t instance, first, count;  // of primitives
    bool front_only;
};

void add_triangle(const SurfaceCut& of, const Range& range, std::uint32_t primitive, float weight,
                  std::vector<SurfacePiece>& out)
{
    const RayScene& rays = of.rays;
    const std::uint32_t instance = range.instance;
    const RayInstance& i = instance_of(rays, instance);
    const std::array<glm::vec3, 3> c = triangle_corners(rays, instance, primitive);
    const glm::vec3 cross = glm::cross(c[1] - c[0], c[2] - c[0]);
    const float length = glm::length(cross);
    if (!(length > 0.0f) || !std::isfinite(length)) return;
    SurfacePiece piece{};
    piece.instance = instance;
    piece.primitive = primitive;
    piece.area = 0.5f * length * weight;
    const glm::vec3 face = cross * ((i.mirrored ? -1.0f : 1.0f) / length);
    for (const float side : {1.0f, -1.0f}) {  // rays see both, whatever the camera does
        if (side < 0.0f && range.front_only) continue;
        piece.normal = side * face;
        cut(of, {Corner{{0.0f, 0.0f}, c[0]}, Corner{{1.0f, 0.0f}, c[1]}, Corner{{0.0f, 1.0f}, c[2]}}, 0, piece, out);
    }
}

}  // namespace

bool can_be_lit(const RayScene& rays, std::uint32_t instance)
{
    const RayInstance& i = instance_of(rays, instance);
    const Material& m = rays.scene().materials[static_cast<std::size_t>(i.material)];
    const std::size_t mesh = static_cast<std::size_t>(rays.scene().instances[instance].mesh);
    const MeshTraits& traits = rays.impl().traits[mesh];
    return traits.is(kReflects) && !traits.is(kSeeThrough) && !m.unlit && m.diffuse_transmission <= 0.0f;
}

std::vector<SurfacePiece> surface_pieces(const SurfaceCut& of, std::uint64_t seed, ThreadPool& pool)
{
    const RayScene& rays = of.rays;
    const GatheredLamps* const lamps = of.lamps;
    std::vector<Range> ranges;
    double triangles = 0.0;
    for (std::uint32_t i = 0; i < rays.impl().instances.size(); ++i) {
        if (lamps ? !lamps->has(i) : !can_be_lit(rays, i)) continue;
        const bool front_only =
            lamps && !rays.scene().materials[static_cast<std::size_t>(instance_of(rays, i).material)].double_sided;
        const std::uint32_t count = static_cast<std::uint32_t>(instance_of(rays, i).mesh->triangles.size());
        triangles += count;
        for (std::uint32_t first = 0; first < count; first += kPiecesOfARange)
            ranges.push_back({i, first, std::min<std::uint32_t>(kPiecesOfARange, count - first), front_only});
    }
    const float share = static_cast<float>(std::min(1.0, kMostTriangles / std::max(1.0, triangles)));
    std::vector<std::vector<SurfacePiece>> parts(ranges.size());
    pool.parallel_for(ranges.size(), 1, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t r = begin; r < end; ++r) {
            RandomStream random(stream_key(seed, Stream::lit_points, r));
            for (std::uint32_t t = 0; t < ranges[r].count; ++t)
                if (share == 1.0f || random.next() < share)
                    add_triangle(of, ranges[r], ranges[r].first + t, 1.0f / share, parts[r]);
        }
    });
    std::vector<SurfacePiece> pieces;
    std::size_t all = 0;
    for (const auto& part : parts) all += part.size();
    pieces.reserve(all);
    for (const auto& part : parts) pieces.insert(pieces.end(), part.begin(), part.end());
    return pieces;
}

PointOnPiece point_on(const RayScene& rays, const SurfacePiece& piece, glm::vec2 u)
{
    const float root = std::sqrt(u.x);
    const glm::vec2 at =
        (1.0f - root) * piece.corner[0] + root * (1.0f - u.y) * piece.corner[1] + root * u.y * piece.corner[2];
    const RayInstance& i = instance_of(rays, piece.instance);
    PointOnPiece result;
    result.hit = {0.0f, at.x, at.y, piece.instance, piece.primitive};
    result.point = surface_at(rays, piece.instance, piece.primitive, at.x, at.y, -piece.normal);
    result.uv_per_length = i.triangles[piece.primitive].uv_density() * i.inverse_scale;
    return result;
}

}  // namespace rcs
