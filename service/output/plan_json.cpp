#include "output/plan_json.h"

#include <cmath>
#include <cstdio>

#include <nlohmann/json.hpp>

#include "output/json_number.h"

namespace rcs::service {
namespace {

using Json = nlohmann::ordered_json;

const char* name_of(PlannedEffect::Basis basis)
{
    switch (basis) {
        case PlannedEffect::Basis::exact:
            return "exact";
        case PlannedEffect::Basis::bound:
            return "bound";
        case PlannedEffect::Basis::measured:
            return "measured";
    }
    return "";
}

Json json_of(const PlannedEffect& e)
{
    Json json = {{"name", std::string(rcs::name_of(e.effect))},
                 {"needed", e.needed},
                 {"chosen_by_user", e.chosen},
                 {"scene_has_material", e.has_material},
                 {"reason", e.reason}};
    if (!e.of.empty()) {
        json["contribution"] = {{"of", e.of}, {"basis", name_of(e.basis)}, {"share", finite_or_null(e.share)}};
        if (e.basis == PlannedEffect::Basis::measured) {
            json["contribution"]["confidence_95"] = {e.low, e.high};
        }
    }
    json["loss"] = finite_or_null(e.loss);
    json["cost"] = {{"text", e.cost}, {"rays", e.rays}, {"bytes", e.bytes}};
    return json;
}

Json json_of(const PlannedLayer& l)
{
    return {{"name", std::string(l.layer->name)}, {"kept", l.kept}, {"made", l.made}, {"bytes", l.bytes}};
}

const char* word_of(const PlannedLayer& l) { return l.kept ? "kept" : l.made ? "made" : "off"; }

}  // namespace

Json to_json(const EffectPlan& plan)
{
    Json json = {{"bounces", plan.bounces},
                 {"passes", plan.passes},
                 {"pilot_rays", plan.pilot_rays},
                 {"effects", Json::array()},
                 {"layers", Json::array()}};
    for (const PlannedEffect& e : plan.effects) {
        json["effects"].push_back(json_of(e));
    }
    for (const PlannedLayer& l : plan.layers) {
        json["layers"].push_back(json_of(l));
    }
    return json;
}

Json to_json(const EffectCounts& counts)
{
    return {{"rays",
             {{"camera", counts.camera_rays},
              {"punctual", counts.punctual_rays},
              {"area", counts.area_rays},
              {"peaks", counts.peak_rays},
              {"highlights", counts.highlight_rays},
              {"hit_lamps", counts.hit_lamp_rays},
              {"hit_sky", counts.hit_sky_rays}}},
            {"alpha_tests", counts.alpha_tests},
            {"hit_textures", counts.hit_textures},
            {"normal_maps", counts.normal_maps},
            {"passes",
             {{"gbuffer", counts.gbuffers},
              {"peeled_layers", counts.peeled_layers},
              {"direct", counts.direct_passes},
              {"splat", counts.splats},
              {"splat_glossy", counts.glossy_splats},
              {"lobes", counts.lobe_passes},
              {"error", counts.error_passes}}},
            {"shared_samples", counts.shared_samples},
            {"bytes",
             {{"gl", counts.gl_bytes},
              {"shading", counts.shading_bytes},
              {"records", counts.record_bytes},
              {"radiance", counts.radiance_bytes},
              {"layers", counts.layer_bytes}}},
            {"shaders", counts.shaders}};
}

std::string to_text(const EffectPlan& plan)
{
    std::string text;
    for (const PlannedEffect& e : plan.effects) {
        char name[64];
        std::snprintf(name, sizeof name, "%-4s %-22s ", e.needed ? "on" : "off",
                      std::string(rcs::name_of(e.effect)).c_str());
        text.append(name).append(e.reason);
        if (e.loss > 0.0) {
            char loss[64];
            std::snprintf(loss, sizeof loss, "; loses at most %.2g of ", e.loss);
            text.append(loss).append(e.of.empty() ? "it" : e.of);
        }
        text.append("\n");
    }
    for (const PlannedLayer& l : plan.layers) {
        char row[128];
        std::snprintf(row, sizeof row, "%-4s layer %-16s %s", word_of(l), std::string(l.layer->name).c_str(),
                      l.kept   ? "the picture keeps it"
                      : l.made ? "no output keeps it, beauty or the error estimate takes it in"
                               : "no output keeps it");
        text.append(row);
        if (l.made) {
            std::snprintf(row, sizeof row, "; %.3g MB", 1e-6 * l.bytes);
            text.append(row);
        }
        text.append("\n");
    }
    char line[128];
    std::snprintf(line, sizeof line, "bounces %d, passes %d; planned with %llu rays\n", plan.bounces, plan.passes,
                  static_cast<unsigned long long>(plan.pilot_rays));
    return text + line;
}

}  // namespace rcs::service
