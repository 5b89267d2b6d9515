#include <cmath>

#include "records/gatherer.h"
#include "records/look_gradients.h"
#include "util/color.h"
#include "util/random.h"

namespace rcs {
namespace {

/// Light that arrives from a direction, and how it changes when the record turns, and moves there where it is.
/// @param of_place  by the geometry term, over the light [1/m]   @param of_view  by what is seen of its surface, along
/// x and y of the frame
void add_light(Record& record, const Basis& frame, glm::vec3 direction, glm::vec3 of_place, const ChangeAlong& of_view,
               glm::vec3 irradiance)
{
    const glm::vec3 turning = turning_of_look(record.normal, direction);
    record.irradiance += irradiance;
    for (std::size_t color = 0; color < 3; ++color) {
        const auto c = static_cast<glm::length_t>(color);
        record.rotation_gradient[color] += irradiance[c] * turning;
        record.translation_gradient[color] +=
            irradiance[c] * of_place + of_view[0][c] * frame.x + of_view[1][c] * frame.y;
    }
}

}  // namespace

void Gatherer::aim_looks(const Birth& birth, int looks, GatherWorkspace& w) const
{
    RandomStream random(mix64(birth.key + 3));
    const LookCells cells = guide_->cells(birth.position, birth.normal);
    guide_->choose({birth.position, birth.normal, cells}, looks, random, w.scratch, w.choices);
    for (const GatherGuide::Choice& c : w.choices) {
        // From one moved end to the other, as to a lamp.
        const glm::vec3 way = guide_->lit().end_of_ray(c.point, birth.position) - birth.origin;
        const float length = glm::length(way);
        w.look_rays.add({birth.origin, way / length, 0.0f, length});
    }
    w.looks_shot += w.look_rays.size();
}

/// Adds what lit points send over looks, once their rays are traced, and how it changes. What stands between moves as
/// well, which rays alone can see: of what lit points bring, that change is left out.
void Gatherer::finish_looks(const Birth& birth, GatherWorkspace& w, Record& record) const
{
    const LookCells cells = guide_->cells(birth.position, birth.normal);
    w.arrived.assign(w.choices.size(), glm::vec3(0.0f));
    double squares = 0.0, of_points = 0.0;
    for (std::size_t i = 0; i < w.choices.size(); ++i) {
        const GatherGuide::Choice& c = w.choices[i];
        const bool free = w.look_rays.is_free(i) && glm::dot(c.direction, birth.geometric_normal) > 0.0f;
        w.looks.push_back({cells, c.cluster, free});
        if (free) {
            const LitPoints& lit = guide_->lit();
            const glm::vec3 passes = w.look_rays.transmittance(i);
            const glm::vec3 one = passes * lit.radiance_area(radiance_, c.point, -c.direction);
            const glm::vec3 light = c.part * c.inverse_chance * one;
            ChangeAlong of_view = lit.moving_of_radiance_area(c.point, -c.direction, c.distance, w.frame);
            for (glm::vec3& along : of_view) along *= c.part * c.inverse_chance * passes;
            add_light(record, w.frame, c.direction,
                      moving_of_look(birth.normal, c.distance * c.direction, lit.points[c.point].normal), of_view,
                      light);
            // The variance of a sum over points that were drawn is the sum of their squares, of which this is a sample.
            of_points += static_cast<double>(luminance(light)) * static_cast<double>(c.part * luminance(one));
            w.arrived[i] = light;
        }
        const double change = i > 0 ? static_cast<double>(luminance(w.arrived[i] - w.arrived[i - 1])) : 0.0;
        squares += 0.5 * change * change;
    }
    w.error_of_looks = static_cast<float>(std::sqrt(squares));
    w.error_of_points = static_cast<float>(std::sqrt(of_points));
}

/// What arrived over looks, by direction. @param scale  to radiance of a cell
void Gatherer::add_looks(float scale, GatherWorkspace& w) const
{
    RayPacket looks;
    reset(looks);
    for (std::size_t first = 0; first < w.arrived.size(); first += RayPacket::kWidth) {
        float colors[3][RayPacket::kWidth] = {};
        for (std::size_t i = 0; i < RayPacket::kWidth; ++i) {
            const std::size_t k = std::min(first + i, w.arrived.size() - 1);
            set_lane(looks, i, {glm::vec3(0.0f), w.choices[k].direction});
            for (int color = 0; color < 3; ++color)
                colors[color][i] = first + i == k ? scale * w.arrived[k][color] : 0.0f;
        }
        w.radiance.add(looks, colors[0], colors[1], colors[2]);
    }
}

}  // namespace rcs
