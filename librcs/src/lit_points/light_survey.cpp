#include "lit_points/light_survey.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "gbuffer/visible_points.h"
#include "util/color.h"
#include "util/random.h"

namespace rcs {
namespace {

// Rays of visible points for a first look around, and lit points, per pixel, and at least.
constexpr double kSurveyRays = 0.125, kPilots = 0.06;
// Visible points that learn what they see of lamps.
constexpr double kPlaces = 0.03;
constexpr std::size_t kLeastPlaces = 32768;
constexpr double kLeast = 4096.0;
constexpr std::size_t kPiecesAtATime = 1024;
// Of all points, what is spread evenly over what is seen, and evenly over everything.
constexpr double kSeenPart = 0.2, kByAreaPart = 0.05;

std::size_t count_for(const GBuffer& g, double per_pixel)
{
    return static_cast<std::size_t>(std::max(kLeast, per_pixel * static_cast<double>(g.size())));
}

/// Visible points, evenly over the picture: at most so many.
std::vector<SurfaceSample> visible_points(const GBuffer& g, std::size_t count, std::uint64_t seed)
{
    std::vector<SurfaceSample> points;
    for (const std::uint32_t i : spread_pixels(g, count, seed))
        points.push_back({g.scene_position(i), g.position_error[i], g.geometric_normal[i], g.normal(i)});
    return points;
}

/// Where rays of visible points end, one after the other.
std::vector<SurfaceSample> hits_of(const RayScene& rays, const HitRadiance& radiance,
                                   const std::vector<SurfaceSample>& points, std::uint64_t seed, ThreadPool& pool)
{
    if (points.empty()) return {};
    const std::size_t groups = (points.size() + CellRays::kPackets - 1) / CellRays::kPackets;
    std::vector<std::vector<SurfaceSample>> found(groups);
    std::vector<CellRays> workers(static_cast<std::size_t>(pool.size()), CellRays(rays, radiance));
    pool.parallel_for(groups, 8, [&](std::size_t begin, std::size_t end, int thread) {
        CellRays& worker = workers[static_cast<std::size_t>(thread)];
        for (std::size_t i = begin; i < end; ++i) {
            std::array<SurfaceSample, CellRays::kPackets> places;
            for (std::size_t p = 0; p < places.size(); ++p) places[p] = points[(i * places.size() + p) % points.size()];
            worker.trace(places, stream_key(seed, Stream::lit_points, i), false);
            for (const CellHit& hit : worker.hits())
                if (hit.hit) found[i].push_back(hit.surface);
        }
    });
    std::vector<SurfaceSample> all;
    for (const auto& group : found) all.insert(all.end(), group.begin(), group.end());
    return all;
}

/// @param rays  of visible points
void note_seen(const PlaceLight& light, const GBuffer& g, std::size_t rays, std::uint64_t seed, ThreadPool& pool,
               Importance& importance)
{
    const std::vector<SurfaceSample> points = visible_points(g, rays / RayPacket::kWidth, seed);
    std::vector<SurfaceSample> seen = hits_of(light.rays, light.radiance, points, seed + 1, pool);
    const auto note = [&] {
        for (const SurfaceSample& p : seen) importance.note_seen(p.position, p.geometric_normal);
    };
    note();
    // Lamps are looked for from there as well.
    if (light.lamps) {
        std::vector<SurfaceSample> some;
        for (std::size_t i = 0; i < seen.size(); i += RayPacket::kWidth) some.push_back(seen[i]);
        seen = hits_of(light.rays, light.radiance, some, seed + 2, pool);
        note();
    }
    importance.update();
}

/// What the pilots found, the dark ones too.
void note_light(std::span<const PlaceToLight> pilots, const LitPoints& lit, Importance& importance)
{
    std::vector<float> radiosity(pilots.size(), 0.0f);
    for (std::size_t i = 0; i < lit.points.size(); ++i) {
        const std::uint32_t place = lit.lights[i].place;
        radiosity[place] = lit.points[i].power / pilots[place].area;
    }
    for (std::size_t i = 0; i < pilots.size(); ++i)
        importance.note_light(pilots[i].place.point.position, pilots[i].place.point.geometric_normal, radiosity[i]);
    importance.update();
}

/// Looks importance up at the pieces' probes, most of which lie in the cell of the one before.
void look_up_importance(LightSurvey& survey, ThreadPool& pool)
{
    survey.at_probes.resize(survey.pieces.size());
    pool.parallel_for(survey.pieces.size(), kPiecesAtATime, [&](std::size_t begin, std::size_t end, int) {
        std::uint64_t cell = 0;
        Importance::Value value;
        for (std::size_t i = begin; i < end; ++i)
            for (std::size_t p = 0; p < SurfacePiece::kProbes; ++p) {
                const std::uint64_t own = survey.importance.leaf(survey.pieces[i].probe[p], survey.pieces[i].normal);
                if (own != cell || (i == begin && p == 0)) cell = own, value = survey.importance.of(own);
                survey.at_probes[i][p] = value;
            }
    });
}

/// The largest density at each piece's probes.
std::vector<float> most_of(const LightSurvey& survey, const PointDensity& density, ThreadPool& pool)
{
    std::vector<float> result(survey.pieces.size());
    pool.parallel_for(result.size(), kPiecesAtATime, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t i = begin; i < end; ++i)
            for (const Importance::Value& value : survey.at_probes[i])
                result[i] = std::max(result[i], density.at(value));
    });
    return result;
}

double integral(const LightSurvey& survey, const PointDensity& density, ThreadPool& pool)
{
    const std::vector<float> most = most_of(survey, density, pool);
    double sum = 0.0;
    for (std::size_t i = 0; i < most.size(); ++i)
        sum += static_cast<double>(most[i]) * static_cast<double>(survey.pieces[i].area);
    return sum;
}

/// About so many points in all. @param of_seen  part of them that is spread over what is seen, bright or not
PointDensity mix(const LightSurvey& survey, double of_seen, double points)
{
    const auto part = [&](double share, double of) {
        return of > 0.0 ? static_cast<float>(share * points / of) : 0.0f;
    };
    return {part(1.0 - of_seen - kByAreaPart, survey.bright), part(of_seen, survey.seen),
            part(kByAreaPart, survey.area)};
}

}  // namespace

std::vector<SurfaceSample> places_in_view(const RayScene& rays, const HitRadiance& radiance, const GBuffer& gbuffer,
                                          std::uint64_t seed, ThreadPool& pool)
{
    const std::vector<SurfaceSample> points =
        visible_points(gbuffer, std::max(kLeastPlaces, count_for(gbuffer, kSurveyRays)) / RayPacket::kWidth, seed);
    std::vector<SurfaceSample> places = hits_of(rays, radiance, points, seed + 1, pool);
    const std::vector<SurfaceSample> visible = visible_points(gbuffer, count_for(gbuffer, kPlaces), seed + 2);
    places.insert(places.end(), visible.begin(), visible.end());
    return places;
}

PointDensity density_of_points(const LightSurvey& survey, double points) { return mix(survey, kSeenPart, points); }

/// Points with this density, per area, wherever they lie: candidates are spread over the pieces in proportion to the
/// largest density found on each, and one stands for as many points as the density at its own place asks for.
std::vector<PlaceToLight> draw_places(const LightSurvey& survey, const PointDensity& density, std::uint64_t seed,
                                      ThreadPool& pool)
{
    const std::span<const SurfacePiece> pieces = survey.pieces;
    const std::vector<float> most = most_of(survey, density, pool);
    std::vector<std::uint32_t> candidates;  // pieces
    double next = static_cast<double>(RandomStream(seed).next()), sum = 0.0;
    for (std::size_t i = 0; i < pieces.size(); ++i) {
        sum += static_cast<double>(most[i]) * static_cast<double>(pieces[i].area);
        for (; next < sum; next += 1.0) candidates.push_back(static_cast<std::uint32_t>(i));
    }
    std::vector<std::vector<PlaceToLight>> parts((candidates.size() + kPiecesAtATime - 1) / kPiecesAtATime);
    pool.parallel_for(parts.size(), 1, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t k = begin * kPiecesAtATime; k < std::min(candidates.size(), end * kPiecesAtATime); ++k) {
            RandomStream random(stream_key(seed, Stream::lit_points, k));
            const float u = random.next(), v = random.next();
            const PointOnPiece place = point_on(survey.light.rays, pieces[candidates[k]], {u, v});
            const float wanted = density.at(survey.importance, place.point.position, place.point.geometric_normal);
            const int copies = static_cast<int>(wanted / most[candidates[k]] + random.next());
            for (int c = 0; c < copies; ++c) parts[k / kPiecesAtATime].push_back({place, 1.0f / wanted});
        }
    });
    std::vector<PlaceToLight> places;
    for (const auto& part : parts) places.insert(places.end(), part.begin(), part.end());
    return places;
}

LightSurvey survey_light(const PlaceLight& light, const GBuffer& gbuffer, const View& view, std::uint64_t seed,
                         ThreadPool& pool, double part)
{
    LightSurvey s{light,
                  stream_key(seed, Stream::lit_points, 0),
                  Importance(make_cell_grid(bounds_of(light.rays.scene()), view)),
                  {},
                  {}};
    note_seen(light, gbuffer, count_for(gbuffer, part * kSurveyRays), s.seed, pool, s.importance);
    s.pieces = surface_pieces({light.rays, light.lamps, s.importance, part}, s.seed + 2, pool);
    for (const SurfacePiece& piece : s.pieces) s.area += static_cast<double>(piece.area);
    look_up_importance(s, pool);
    s.seen = integral(s, {0.0f, 1.0f, 0.0f}, pool);
    if (!(s.seen > 0.0)) return s;
    const std::vector<PlaceToLight> pilots = draw_places(
        s, mix(s, 1.0 - kByAreaPart, static_cast<double>(count_for(gbuffer, part * kPilots))), s.seed + 3, pool);
    note_light(pilots, light_places(light, pilots, s.seed + 5, pool), s.importance);
    look_up_importance(s, pool);
    s.bright = integral(s, {1.0f, 0.0f, 0.0f}, pool);
    return s;
}

}  // namespace rcs
