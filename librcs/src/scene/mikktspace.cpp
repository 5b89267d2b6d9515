#include "scene/mikktspace.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cfloat>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <tuple>

namespace rcs {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFu;

bool is_something(float x) { return std::fabs(x) > FLT_MIN; }

bool is_something(glm::vec3 v) { return is_something(v.x) || is_something(v.y) || is_something(v.z); }

glm::vec3 unit_if_any(glm::vec3 v) { return is_something(v) ? glm::normalize(v) : v; }

glm::vec3 along_surface(glm::vec3 v, glm::vec3 normal) { return unit_if_any(v - glm::dot(normal, v) * normal); }

struct Face {
    std::array<std::uint32_t, 3> corners{};                        ///< welded vertices
    std::array<std::uint32_t, 3> neighbours{kNone, kNone, kNone};  ///< across the edges from corners 0, 1, 2
    std::array<std::uint32_t, 3> groups{kNone, kNone, kNone};      ///< that the corners belong to
    glm::vec3 along_u{0.0f};
    bool upright = false;   ///< is the texture not mirrored
    bool undecided = true;  ///< its mapping has no area: it goes with its neighbours
    bool is_flat = false;   ///< two corners are in one place: it takes no part

    int corner_at(std::uint32_t vertex) const { return corners[0] == vertex ? 0 : corners[1] == vertex ? 1 : 2; }
    std::uint32_t before(int corner) const { return neighbours[static_cast<std::size_t>(corner > 0 ? corner - 1 : 2)]; }
    std::uint32_t after(int corner) const { return neighbours[static_cast<std::size_t>(corner)]; }
};

struct Group {
    std::uint32_t vertex = 0;
    bool upright = false;
    std::vector<std::uint32_t> faces;
};

class Tangents {
public:
    Tangents(const Mesh& mesh, const std::vector<glm::vec2>& uvs) : mesh_(mesh), uvs_(uvs) {}

    std::vector<glm::vec4> make()
    {
        weld();
        for (std::size_t i = 0; i < faces_.size(); ++i) map(faces_[i]);
        find_neighbours();
        std::vector<glm::vec4> made(3 * faces_.size(), glm::vec4(0.0f, 0.0f, 0.0f, -1.0f));
        for (std::uint32_t face = 0; face < faces_.size(); ++face) {
            if (faces_[face].is_flat || faces_[face].undecided) continue;
            for (int corner = 0; corner < 3; ++corner) {
                if (faces_[face].groups[static_cast<std::size_t>(corner)] == kNone) add_group(face, corner, made);
            }
        }
        copy_to_flat_faces(made);
        return made;
    }

private:
    /// Vertices that are the same in all that matters are one, the first of them.
    void weld()
    {
        using Key = std::array<std::uint32_t, 8>;
        std::vector<Key> keys(mesh_.positions.size());
        for (std::size_t i = 0; i < keys.size(); ++i) {
            const glm::vec3 p = mesh_.positions[i], n = mesh_.normals[i];
            const std::array<float, 8> values{p.x, p.y, p.z, n.x, n.y, n.z, uvs_[i].x, uvs_[i].y};
            for (std::size_t k = 0; k < values.size(); ++k) {
                keys[i][k] = std::bit_cast<std::uint32_t>(values[k] + 0.0f);  // -0 is 0
            }
        }
        std::vector<std::uint32_t> order(keys.size());
        std::iota(order.begin(), order.end(), 0u);
        std::sort(order.begin(), order.end(),
                  [&](std::uint32_t a, std::uint32_t b) { return std::tie(keys[a], a) < std::tie(keys[b], b); });
        std::vector<std::uint32_t> first(keys.size());
        for (std::size_t i = 0; i < order.size(); ++i) {
            const bool same = i > 0 && keys[order[i]] == keys[order[i - 1]];
            first[order[i]] = same ? first[order[i - 1]] : order[i];
        }
        faces_.resize(mesh_.triangles.size());
        for (std::size_t i = 0; i < faces_.size(); ++i) {
            for (int k = 0; k < 3; ++k) faces_[i].corners[static_cast<std::size_t>(k)] = first[mesh_.triangles[i][k]];
        }
    }

    void map(Face& face) const
    {
        const auto& [a, b, c] = face.corners;
        const glm::vec3 pa = mesh_.positions[a], pb = mesh_.positions[b], pc = mesh_.positions[c];
        face.is_flat = pa == pb || pb == pc || pc == pa;
        if (face.is_flat) return;
        const glm::vec2 d1 = uvs_[b] - uvs_[a], d2 = uvs_[c] - uvs_[a];
        const glm::vec3 e1 = pb - pa, e2 = pc - pa;
        const float area = d1.x * d2.y - d1.y * d2.x;
        face.upright = area > 0.0f;
        if (!is_something(area) || !std::isfinite(area)) return;
        const glm::vec3 s = d2.y * e1 - d1.y * e2, t = d1.x * e2 - d2.x * e1;
        const float s_length = glm::length(s), t_length = glm::length(t);
        if (is_something(s_length)) face.along_u = (face.upright ? 1.0f : -1.0f) / s_length * s;
        face.undecided = !is_something(s_length / std::fabs(area)) || !is_something(t_length / std::fabs(area));
    }

    /// Each edge joins at most two triangles, that pass it in opposite directions.
    void find_neighbours()
    {
        struct Edge {
            std::uint32_t low, high, face;
            bool rises;
            std::uint8_t side;
        };
        std::vector<Edge> edges;
        edges.reserve(3 * faces_.size());
        for (std::uint32_t i = 0; i < faces_.size(); ++i) {
            if (faces_[i].is_flat) continue;
            for (std::uint8_t k = 0; k < 3; ++k) {
                const std::uint32_t from = faces_[i].corners[k], to = faces_[i].corners[k < 2 ? k + 1u : 0u];
                edges.push_back({std::min(from, to), std::max(from, to), i, from < to, k});
            }
        }
        std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
            return std::tie(a.low, a.high, a.face) < std::tie(b.low, b.high, b.face);
        });
        std::vector<const Edge*> waiting;  // of one place and direction; those before `next` have found theirs
        std::size_t next = 0;
        for (const Edge& edge : edges) {
            const bool here =
                next < waiting.size() && waiting[next]->low == edge.low && waiting[next]->high == edge.high;
            if (!here) {
                waiting.clear();
                next = 0;
            }
            if (here && waiting[next]->rises != edge.rises) {
                const Edge& other = *waiting[next++];
                faces_[edge.face].neighbours[edge.side] = other.face;
                faces_[other.face].neighbours[other.side] = edge.face;
            } else {
                waiting.push_back(&edge);
            }
        }
    }

    /// All that is joined to this corner, and its tangent.
    void add_group(std::uint32_t face, int corner, std::vector<glm::vec4>& made)
    {
        const std::uint32_t number = groups_++;
        Group group{faces_[face].corners[static_cast<std::size_t>(corner)], faces_[face].upright, {}};
        std::vector<std::uint32_t> ahead{face};
        while (!ahead.empty()) {
            const std::uint32_t at = ahead.back();
            ahead.pop_back();
            if (at == kNone || !join(group, number, at)) continue;
            const int own = faces_[at].corner_at(group.vertex);
            ahead.push_back(faces_[at].before(own));
            ahead.push_back(faces_[at].after(own));
        }
        std::sort(group.faces.begin(), group.faces.end());
        const glm::vec4 tangent(mean(group), group.upright ? 1.0f : -1.0f);
        for (const std::uint32_t member : group.faces) {
            made[3 * std::size_t{member} + static_cast<std::size_t>(faces_[member].corner_at(group.vertex))] = tangent;
        }
    }

    /// Whether the face belongs to the group and did not before.
    bool join(Group& group, std::uint32_t number, std::uint32_t at)
    {
        Face& face = faces_[at];
        std::uint32_t& own = face.groups[static_cast<std::size_t>(face.corner_at(group.vertex))];
        if (own != kNone) return false;
        const bool is_free = face.groups[0] == kNone && face.groups[1] == kNone && face.groups[2] == kNone;
        if (face.undecided && is_free) face.upright = group.upright;
        if (face.upright != group.upright) return false;
        own = number;
        group.faces.push_back(at);
        return true;
    }

    /// Of the tangents along the surface, weighted by the angles that the faces have there.
    glm::vec3 mean(const Group& group) const
    {
        const glm::vec3 normal = mesh_.normals[group.vertex];
        glm::vec3 sum(0.0f);
        for (const std::uint32_t member : group.faces) {
            const Face& face = faces_[member];
            if (face.undecided) continue;
            const auto corner = static_cast<std::size_t>(face.corner_at(group.vertex));
            const auto edge_to = [&](std::size_t k) {
                return along_surface(mesh_.positions[face.corners[k % 3]] - mesh_.positions[group.vertex], normal);
            };
            const float cosine = std::clamp(glm::dot(edge_to(corner + 2), edge_to(corner + 1)), -1.0f, 1.0f);
            sum += std::acos(cosine) * along_surface(face.along_u, normal);
        }
        const glm::vec3 tangent = unit_if_any(sum);
        return glm::dot(tangent, tangent) > 0.5f ? tangent : glm::vec3(0.0f);  // neither what is none nor NaN
    }

    /// Triangles that are no more than a line have the tangents of others at their vertices.
    void copy_to_flat_faces(std::vector<glm::vec4>& made) const
    {
        std::vector<std::uint32_t> source(mesh_.positions.size(), kNone);
        for (std::size_t i = faces_.size(); i-- > 0;) {
            for (std::uint32_t k = 0; k < 3 && !faces_[i].is_flat; ++k) {
                source[faces_[i].corners[k]] = static_cast<std::uint32_t>(3 * i) + k;
            }
        }
        for (std::size_t i = 0; i < faces_.size(); ++i) {
            for (std::size_t k = 0; k < 3 && faces_[i].is_flat; ++k) {
                const std::uint32_t from = source[faces_[i].corners[k]];
                if (from != kNone) made[3 * i + k] = made[from];
            }
        }
    }

    const Mesh& mesh_;
    const std::vector<glm::vec2>& uvs_;
    std::vector<Face> faces_;
    std::uint32_t groups_ = 0;
};

}  // namespace

std::vector<glm::vec4> mikktspace(const Mesh& mesh, const std::vector<glm::vec2>& uvs)
{
    return Tangents(mesh, uvs).make();
}

}  // namespace rcs
