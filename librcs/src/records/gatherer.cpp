#include "records/gatherer.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "facts/scene_effects.h"
#include "records/aimed_rays.h"
#include "records/gather.h"
#include "records/known_record.h"
#include "util/color.h"

namespace rcs {
namespace {

/// What the rays went through on their way.
void tint(int cells, GatherWorkspace& w)
{
    for (std::size_t cell = 0; cell < static_cast<std::size_t>(cells); ++cell) {
        const glm::vec3 weight = w.weight_of(cell);
        w.samples.red[cell] *= weight.r;
        w.samples.green[cell] *= weight.g;
        w.samples.blue[cell] *= weight.b;
    }
    for (LampHit& hit : w.lamp_hits) hit.radiance *= w.weight_of(hit.cell);
}

glm::vec3 to_scene(const Basis& frame, glm::vec3 local)
{
    return local.x * frame.x + local.y * frame.y + local.z * frame.z;
}

HemisphereIntegrals integrals_of(const GatherSize& size, GatherWorkspace& w)
{
    HemisphereIntegrals integrals = w.aimed.scale.empty() ? integrate(size.grid, w.samples) : integrate_mixed(size, w);
    const float weight = std::numbers::pi_v<float> / static_cast<float>(size.grid.cells);
    for (int c = 0; c < 3; ++c)
        integrals.translation_gradient[c] += weight * glm::vec3(w.moving[0][c], w.moving[1][c], 0.0f);
    return integrals;
}

}  // namespace

Gatherer::Gatherer(const LitScene& scene, const RecordSettings& options)
    : rays_(scene.rays),
      radiance_(scene.rays, scene.cache, effects_or_scene(options.effects, scene.rays), scene.gathered),
      guide_(scene.guide && scene.guide->has_light() ? scene.guide : nullptr),
      gathered_(scene.gathered && scene.gathered->any() ? scene.gathered : nullptr),
      map_(scene.arrivals),
      direct_(scene.direct),
      has_bounce_(options.bounces > 0),
      keeps_radiance_(options.radiance)
{
}

/// Beside the light of all other surfaces, which the integrals have, that of gathered lamps.
void Gatherer::add_lamps(const GatherSize& size, HemisphereIntegrals& integrals, GatherWorkspace& w,
                         Record& record) const
{
    record.gathered_lamps = gathered_ ? gathered_->id : 0;
    if (w.lamp_hits.empty()) return;
    const glm::vec3 of_others = integrals.irradiance;
    for (const LampHit& hit : w.lamp_hits) w.samples.add(hit.cell, hit.radiance);
    integrals = integrals_of(size, w);
    record.of_lamps = glm::max(integrals.irradiance - of_others, 0.0f);
}

Record Gatherer::gather(const Birth& birth, const GatherSize& size, GatherWorkspace& w) const
{
    aim(birth, size, w);
    trace_cells(w);
    shade(birth, w);
    w.shadow.trace(rays_);
    w.look_rays.trace(rays_);
    return finish(birth, size, w);
}

Record Gatherer::finish(const Birth& birth, const GatherSize& size, GatherWorkspace& w) const
{
    add_shadowed(w);
    if (rays_.has_transparency()) tint(size.cells(), w);
    HemisphereIntegrals integrals = integrals_of(size, w);
    Record record;
    record.position = birth.position;
    record.normal = birth.normal;
    w.error_of_looks = w.error_of_points = 0.0f;
    w.arrived.clear();
    if (guide_) finish_looks(birth, w, record);
    if (keeps_radiance_) record.radiance = radiance(size, w);  // before that of lamps, which it leaves out
    if (keeps_radiance_ && gathered_) record.radiance_of_lamps = radiance_of_lamps(size, w);
    add_lamps(size, integrals, w, record);
    if (map_) note_arrivals(*map_, birth, w);
    record.irradiance += integrals.irradiance;
    for (std::size_t i = 0; i < 3; ++i) {
        record.rotation_gradient[i] += to_scene(w.frame, integrals.rotation_gradient[i]);
        record.translation_gradient[i] += to_scene(w.frame, integrals.translation_gradient[i]);
    }
    w.error_of_rays = integrals.standard_error;
    const float error = std::hypot(w.error_of_rays, w.error_of_looks);
    record.harmonic_mean_distance = integrals.harmonic_mean_distance;
    record.minimum_distance = integrals.minimum_distance;
    record.gradient_reach = gradient_reach(record);
    record.footprint = birth.footprint;
    record.watch.origin = birth.origin;
    record.watch.geometric_normal = birth.geometric_normal;
    record.watch.instance = birth.instance;
    record.rays = size.rays();
    const float e = luminance(record.irradiance);
    record.noise = e > 0.0f ? std::min(1.0f, error / e) : 0.0f;
    return record;
}

Record Gatherer::difference(const Birth& birth, const HemisphereGrid& grid, std::span<glm::vec3> seen,
                            GatherWorkspace& w) const
{
    aim_cells(birth, grid, w);
    trace_cells(w);
    shade(birth, w);
    w.shadow.trace(rays_);
    add_shadowed(w);
    if (rays_.has_transparency()) tint(grid.cells, w);
    HemisphereSamples& s = w.samples;
    bool any = false;
    for (std::size_t c = 0; c < seen.size(); ++c) {
        if ((w.wanted >> c & 1u) == 0u) continue;  // nothing
        const glm::vec3 now(s.red[c], s.green[c], s.blue[c]), change = now - seen[c];
        seen[c] = now;
        any |= change != glm::vec3(0.0f);
        s.red[c] = change.r, s.green[c] = change.g, s.blue[c] = change.b;
    }
    Record change;
    if (!any) return change;
    const HemisphereIntegrals integrals = integrate(grid, s);
    change.irradiance = integrals.irradiance;
    for (std::size_t i = 0; i < 3; ++i) {
        change.rotation_gradient[i] = to_scene(w.frame, integrals.rotation_gradient[i]);
        change.translation_gradient[i] = to_scene(w.frame, integrals.translation_gradient[i]);
    }
    w.arrived.clear();
    if (keeps_radiance_) change.radiance = radiance({grid}, w);
    change.noise = integrals.standard_error;
    return change;
}

}  // namespace rcs
