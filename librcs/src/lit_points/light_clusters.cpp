#include "lit_points/light_clusters.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <queue>

#include "util/multiversion.h"
#include "util/random.h"

namespace rcs {
namespace {

/// Points order[begin .. end), and how much there is to gain by splitting them.
struct Group {
    std::uint32_t begin, end;
    float gain;
    int axis;  // 0 to 2: of position, 3 to 5: of normal
    bool operator<(const Group& other) const
    {
        return gain < other.gain || (gain == other.gain && begin > other.begin);
    }
};

float coordinate(const LitPoint& p, int axis) { return axis < 3 ? p.position[axis] : p.normal[axis - 3]; }

/// @param scale  position's, so that it compares with normals [1/m]
Group make_group(const std::vector<LitPoint>& points, std::span<const std::uint32_t> order, std::uint32_t begin,
                 std::uint32_t end, float scale)
{
    double sum[6] = {}, square[6] = {}, power = 0.0;
    for (std::uint32_t k = begin; k < end; ++k) {
        const LitPoint& p = points[order[k]];
        power += static_cast<double>(p.power);
        for (int a = 0; a < 6; ++a) {
            const double c = static_cast<double>(coordinate(p, a) * (a < 3 ? scale : 1.0f));
            sum[a] += c;
            square[a] += c * c;
        }
    }
    const double n = end - begin;
    Group group{begin, end, 0.0f, 0};
    double most = -1.0;
    for (int a = 0; a < 6; ++a) {
        const double variance = square[a] / n - sum[a] / n * (sum[a] / n);
        if (variance > most) most = variance, group.axis = a;
    }
    if (end - begin > 1) group.gain = static_cast<float>(power * std::sqrt(std::max(0.0, most)));
    return group;
}

float scale_of(const std::vector<LitPoint>& points)
{
    glm::dvec3 sum(0.0);
    double square = 0.0;
    for (const LitPoint& p : points) {
        sum += glm::dvec3(p.position);
        square += glm::dot(glm::dvec3(p.position), glm::dvec3(p.position));
    }
    const double n = static_cast<double>(points.size());
    const double variance = square / n - glm::dot(sum / n, sum / n);
    // Normals differ by 2 at most; as much as points that lie a few deviations apart.
    return variance > 0.0 ? static_cast<float>(4.0 / std::sqrt(variance)) : 1.0f;
}

/// @param order  becomes the points' order by group
std::vector<Group> split(const std::vector<LitPoint>& points, std::vector<std::uint32_t>& order)
{
    const float scale = scale_of(points);
    std::priority_queue<Group> open;
    open.push(make_group(points, order, 0, static_cast<std::uint32_t>(order.size()), scale));
    while (open.size() < LightClusters::kMost && open.top().gain > 0.0f) {
        const Group g = open.top();
        open.pop();
        const std::uint32_t middle = (g.begin + g.end) / 2;
        std::nth_element(order.begin() + g.begin, order.begin() + middle, order.begin() + g.end,
                         [&](std::uint32_t a, std::uint32_t b) {
                             const float ca = coordinate(points[a], g.axis), cb = coordinate(points[b], g.axis);
                             return ca < cb || (ca == cb && a < b);
                         });
        open.push(make_group(points, order, g.begin, middle, scale));
        open.push(make_group(points, order, middle, g.end, scale));
    }
    std::vector<Group> groups;
    for (; !open.empty(); open.pop()) groups.push_back(open.top());
    std::sort(groups.begin(), groups.end(), [](const Group& a, const Group& b) { return a.begin < b.begin; });
    return groups;
}

template <typename T>
void reorder(std::vector<T>& items, const std::vector<std::uint32_t>& order)
{
    std::vector<T> sorted;
    sorted.reserve(items.size());
    for (const std::uint32_t i : order) sorted.push_back(items[i]);
    items = std::move(sorted);
}

}  // namespace

LightClusters::LightClusters(LitPoints& lit)
{
    if (lit.points.empty()) return;
    std::vector<std::uint32_t> order(lit.points.size());
    std::iota(order.begin(), order.end(), 0u);
    const std::vector<Group> groups = split(lit.points, order);
    for (const Group& g : groups)
        std::sort(order.begin() + g.begin, order.begin() + g.end, [](std::uint32_t a, std::uint32_t b) {
            return mix64(a) < mix64(b);  // any order that knows nothing of the points
        });
    reorder(lit.points, order);
    reorder(lit.lights, order);
    for (const Group& g : groups) {
        first_.push_back(g.begin);
        glm::dvec3 centre(0.0), normal(0.0);
        float power = 0.0f;
        for (std::uint32_t k = g.begin; k < g.end; ++k) {
            centre += glm::dvec3(lit.points[k].position);
            normal += glm::dvec3(lit.points[k].normal);
            power += lit.points[k].power;
        }
        const double n = g.end - g.begin;
        const glm::vec3 c(centre / n), mean(normal / n);
        float radius2 = 0.0f;
        for (std::uint32_t k = g.begin; k < g.end; ++k) {
            const glm::vec3 d = lit.points[k].position - c;
            radius2 = std::max(radius2, glm::dot(d, d));
        }
        x_.push_back(c.x), y_.push_back(c.y), z_.push_back(c.z);
        // A little more: rounding must not make impossible what can happen.
        radius_.push_back(1.001f * std::sqrt(radius2) + 1e-6f * glm::length(c));
        normal_x_.push_back(mean.x), normal_y_.push_back(mean.y), normal_z_.push_back(mean.z);
        const float mean2 = glm::dot(mean, mean);
        spread_.push_back(std::sqrt(mean2 < 1.0f ? 1.0f - mean2 : 0.0f));
        power_.push_back(power);
    }
    first_.push_back(static_cast<std::uint32_t>(lit.points.size()));
}

RCS_MULTIVERSION
void LightClusters::weigh(glm::vec3 p, glm::vec3 n, float* weights) const
{
    // A cluster about its own size away still has most of its points farther off than the nearest.
    constexpr float kNearest2 = 0.25f;
    // Behind its mean normal there are points that look the other way.
    constexpr float kLeastFacing = 0.02f;
    const std::size_t count = size();
    // No load may stand behind a condition, that of a vector's begin included: the loop would not become vectors.
    const float *const x = x_.data(), *const y = y_.data(), *const z = z_.data(), *const radius = radius_.data(),
                       *const nx = normal_x_.data(), *const ny = normal_y_.data(), *const nz = normal_z_.data(),
                       *const spread = spread_.data(), *const power = power_.data();
    for (std::size_t i = 0; i < count; ++i) {
        const float dx = x[i] - p.x, dy = y[i] - p.y, dz = z[i] - p.z;
        const float r = radius[i];
        const float d2 = dx * dx + dy * dy + dz * dz + 1e-30f;
        const float inverse_d = 1.0f / std::sqrt(d2);
        float seen = (dx * n.x + dy * n.y + dz * n.z + r) * inverse_d;
        seen = seen < 1.0f ? seen : 1.0f;
        float facing = (0.5f * r - dx * nx[i] - dy * ny[i] - dz * nz[i]) * inverse_d + 0.5f * spread[i];
        facing = facing < 1.0f ? facing : 1.0f;
        facing = facing > kLeastFacing ? facing : kLeastFacing;
        const float least2 = kNearest2 * r * r;
        const float g = seen * facing / (d2 > least2 ? d2 : least2);
        const float sent = weights[i] * power[i] * g;
        weights[i] = seen > 0.0f ? sent : 0.0f;
    }
}

namespace {

struct Spheres {
    const float *x, *y, *z, *radius;
    std::size_t count;
};

RCS_MULTIVERSION
void add_distribution(const Spheres& of, glm::vec3 p, glm::vec3 n, glm::vec3 o, float alpha, float strength,
                      float* weights)
{
    for (std::size_t i = 0; i < of.count; ++i) {
        const float dx = of.x[i] - p.x, dy = of.y[i] - p.y, dz = of.z[i] - p.z;
        const float d2 = dx * dx + dy * dy + dz * dz + 1e-30f;
        const float inverse_d = 1.0f / std::sqrt(d2);
        const float hx = dx * inverse_d + o.x, hy = dy * inverse_d + o.y, hz = dz * inverse_d + o.z;
        const float cosine = hx * n.x + hy * n.y + hz * n.z;
        const float h2 = hx * hx + hy * hy + hz * hz + 1e-12f;
        // A half vector turns half as far as the direction; a cluster all around is as good as no lobe.
        const float turn = 0.5f * of.radius[i] * inverse_d;
        const float wide2 = alpha * alpha + turn * turn, a2 = wide2 < 1.0f ? wide2 : 1.0f;
        const float c2 = cosine * cosine / h2, root = c2 * (a2 - 1.0f) + 1.0f;
        weights[i] += strength * a2 / (root * root);
    }
}

}  // namespace

void LightClusters::add_lobe(glm::vec3 position, glm::vec3 normal, glm::vec3 outgoing, float alpha, float strength,
                             float* weights) const
{
    add_distribution({x_.data(), y_.data(), z_.data(), radius_.data(), size()}, position, normal, outgoing, alpha,
                     strength, weights);
}

void LightClusters::set_bounds(const std::vector<LitPoint>& points)
{
    candidates_ = {};
    for (std::size_t i = 0; i < size(); ++i) {
        const std::uint32_t count = first_[i + 1] - first_[i];
        float power = 0.0f;
        for (std::uint32_t k = 0; k < count; ++k)
            if (const LitPoint& p = points[first_[i] + k]; p.bound > 0.0f) power += p.power;
        power_[i] = power;
        for (std::uint32_t k = 0; k < count + kCandidates - 1; ++k) {
            const LitPoint& p = points[first_[i] + k % count];
            candidates_.x.push_back(p.position.x);
            candidates_.y.push_back(p.position.y);
            candidates_.z.push_back(p.position.z);
            candidates_.normal_x.push_back(p.normal.x);
            candidates_.normal_y.push_back(p.normal.y);
            candidates_.normal_z.push_back(p.normal.z);
            candidates_.power.push_back(p.power);
            candidates_.bound.push_back(p.bound);
        }
    }
}

namespace {

/// What of a point's light goes over the geometry term G to a place [m^-2], without visibility; 0 where either looks
/// away.
RCS_ALWAYS_INLINE float part_of(glm::vec3 d, glm::vec3 normal, glm::vec3 point_normal, float bound)
{
    const float d2 = d.x * d.x + d.y * d.y + d.z * d.z + 1e-30f;
    const float here = normal.x * d.x + normal.y * d.y + normal.z * d.z;
    const float there = -(point_normal.x * d.x + point_normal.y * d.y + point_normal.z * d.z);
    const float g = here * there / (d2 * d2);
    return here > 0.0f && there > 0.0f && bound > 0.0f ? g * bound / (g + bound) : 0.0f;
}

}  // namespace

void LightClusters::prefetch(std::size_t cluster, float u) const
{
    const std::size_t at = run_of(cluster, u).at;
    const Candidates& c = candidates_;
    for (const std::vector<float>* values :
         {&c.x, &c.y, &c.z, &c.normal_x, &c.normal_y, &c.normal_z, &c.power, &c.bound})
        __builtin_prefetch(values->data() + at);
}

RCS_MULTIVERSION
LightClusters::Pick LightClusters::pick(std::size_t cluster, glm::vec3 position, glm::vec3 normal, glm::vec2 u) const
{
    const std::uint32_t begin = first_[cluster], count = first_[cluster + 1] - begin;
    const auto [offset, at] = run_of(cluster, u.x);
    float part[kCandidates], target[kCandidates];
    for (int c = 0; c < kCandidates; ++c) {
        const std::size_t k = at + static_cast<std::size_t>(c);
        const Candidates& p = candidates_;
        part[c] = part_of({p.x[k] - position.x, p.y[k] - position.y, p.z[k] - position.z}, normal,
                          {p.normal_x[k], p.normal_y[k], p.normal_z[k]}, p.bound[k]);
        target[c] = part[c] * p.power[k];
    }
    float sum = 0.0f;
    for (float t : target) sum += t;
    int chosen = 0;
    for (float rest = u.y * sum; chosen + 1 < kCandidates && (rest -= target[chosen]) >= 0.0f;) ++chosen;
    if (!(target[chosen] > 0.0f)) return {0, 0.0f, 0.0f};
    return {begin + (offset + static_cast<std::uint32_t>(chosen)) % count, part[chosen],
            sum * static_cast<float>(count) / (kCandidates * target[chosen])};
}

}  // namespace rcs
