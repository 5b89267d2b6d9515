#include "corpus/corpus.h"

// Materials: their factors, and the extensions' own.

namespace rcs::test {
namespace {

Corpus::Change member(const char* key, const Json& value)
{
    return [=](Draft& d) { d.material[key] = value; };
}
Corpus::Change pbr(const char* key, const Json& value)
{
    return [=](Draft& d) { d.pbr()[key] = value; };
}
Corpus::Change extension(const char* name, const Json& value)
{
    return [=](Draft& d) { d.extension(name) = value; };
}

}  // namespace

void add_material_files(Corpus& c)
{
    c.renders("material_empty", [](Draft& d) { d.material = Json::object(); });
    c.renders("metal_smooth", [](Draft& d) { d.pbr() = {{"metallicFactor", 1}, {"roughnessFactor", 0}}; });
    c.renders("dielectric_smooth", pbr("roughnessFactor", 0));
    c.renders("double_sided", member("doubleSided", true));
    c.renders("alpha_opaque", member("alphaMode", "OPAQUE"));
    c.renders("alpha_mask", member("alphaMode", "MASK"));
    c.renders("alpha_mask_cutoff", [](Draft& d) { d.material.update({{"alphaMode", "MASK"}, {"alphaCutoff", 0.2}}); });
    c.renders("alpha_blend", [](Draft& d) {
        d.material["alphaMode"] = "BLEND";
        d.pbr()["baseColorFactor"] = {1, 1, 1, 0.5};
    });
    c.renders("emission", member("emissiveFactor", {1, 1, 0}));
    c.renders("emission_strong", [](Draft& d) {
        d.material["emissiveFactor"] = {1, 1, 1};
        d.extension("KHR_materials_emissive_strength") = {{"emissiveStrength", 7}};
    });
    c.renders("unlit", extension("KHR_materials_unlit", Json::object()));
    c.renders("ior_water", extension("KHR_materials_ior", {{"ior", 1.33}}));
    c.renders("ior_zero", extension("KHR_materials_ior", {{"ior", 0}}));
    c.renders("specular",
              extension("KHR_materials_specular", {{"specularFactor", 0.5}, {"specularColorFactor", {2, 0.5, 0}}}));
    c.renders("transmission", extension("KHR_materials_transmission", {{"transmissionFactor", 0.5}}));
    c.renders("clearcoat",
              extension("KHR_materials_clearcoat", {{"clearcoatFactor", 1}, {"clearcoatRoughnessFactor", 0.2}}));
    c.renders("specular_glossiness",
              extension("KHR_materials_pbrSpecularGlossiness", {{"diffuseFactor", {0.5, 0.4, 0.3, 1}},
                                                                {"specularFactor", {0.1, 0.2, 0.3}},
                                                                {"glossinessFactor", 0.5}}));
    c.renders("sheen", [](Draft& d) {
        d.extension("KHR_materials_sheen") = {{"sheenColorFactor", {1, 0.5, 0.2}}, {"sheenRoughnessFactor", 0.3}};
        d.root()["extensionsUsed"] = {"KHR_materials_sheen"};
        d.root()["extensionsRequired"] = {"KHR_materials_sheen"};
    });
    c.renders("anisotropy", [](Draft& d) {
        d.pbr() = {{"metallicFactor", 1}, {"roughnessFactor", 0.4}};
        d.extension("KHR_materials_anisotropy") = {{"anisotropyStrength", 0.8}, {"anisotropyRotation", 1}};
    });
    c.notes("anisotropy_above_1", "anisotropyStrength is 2, expected a value in [0, 1]",
            extension("KHR_materials_anisotropy", {{"anisotropyStrength", 2}}));
    c.renders("diffuse_transmission",
              extension("KHR_materials_diffuse_transmission",
                        {{"diffuseTransmissionFactor", 0.5}, {"diffuseTransmissionColorFactor", {0.9, 0.8, 0.1}}}));
    c.notes("diffuse_transmission_above_1", "diffuseTransmissionFactor is 2, expected a value in [0, 1]",
            extension("KHR_materials_diffuse_transmission", {{"diffuseTransmissionFactor", 2}}));
    c.notes("sheen_color_above_1", "sheenColorFactor is 3, expected a value in [0, 1]",
            extension("KHR_materials_sheen", {{"sheenColorFactor", {1, 3, 1}}}));
    c.notes("sheen_roughness_negative", "sheenRoughnessFactor is -1, expected a value in [0, 1]",
            extension("KHR_materials_sheen", {{"sheenRoughnessFactor", -1}}));
    c.notes("glossiness_above_1", "glossinessFactor is 2, expected a value in [0, 1]",
            extension("KHR_materials_pbrSpecularGlossiness", {{"glossinessFactor", 2}}));
    c.notes("base_color_too_bright", "base colour outside", pbr("baseColorFactor", {2, 1, 1, 1}));
    c.notes("roughness_negative", "values outside their range", pbr("roughnessFactor", -1));
    c.notes("metallic_above_1", "values outside their range", pbr("metallicFactor", 3));
    c.notes("ior_below_1", "values outside their range", extension("KHR_materials_ior", {{"ior", 0.5}}));
    c.notes("transmission_above_1", "values outside their range",
            extension("KHR_materials_transmission", {{"transmissionFactor", 2}}));
    c.notes("alpha_mode_unknown", "alpha mode", member("alphaMode", "SOMETIMES"));
    c.notes("extension_of_material_unknown", "KHR_materials_iridescence", [](Draft& d) {
        d.extension("KHR_materials_iridescence") = {{"iridescenceFactor", 1}};
        d.root()["extensionsUsed"] = {"KHR_materials_iridescence"};
    });

    c.fails("emission_negative", "emits", member("emissiveFactor", {-1, 0, 0}));
    c.fails("emission_strength_negative", "emits", [](Draft& d) {
        d.material["emissiveFactor"] = {1, 1, 1};
        d.extension("KHR_materials_emissive_strength") = {{"emissiveStrength", -7}};
    });
    c.fails("emission_of_two", "'emissiveFactor'", member("emissiveFactor", {1, 0}));
    c.fails("base_color_of_three", "'baseColorFactor'", pbr("baseColorFactor", {1, 0, 0}));
    c.fails("base_color_is_text", "'baseColorFactor'", pbr("baseColorFactor", "red"));
    c.fails("metallic_is_text", "'metallicFactor'", pbr("metallicFactor", "1"));
    c.fails("roughness_is_array", "'roughnessFactor'", pbr("roughnessFactor", {1}));
    c.fails("alpha_mode_is_number", "'alphaMode'", member("alphaMode", 3));
    c.fails("alpha_cutoff_is_text", "'alphaCutoff'", member("alphaCutoff", "half"));
    c.fails("double_sided_is_number", "'doubleSided'", member("doubleSided", 1));
    c.fails("pbr_is_array", "'pbrMetallicRoughness'", member("pbrMetallicRoughness", Json::array()));
    c.fails("ior_is_text", "'ior'", extension("KHR_materials_ior", {{"ior", "glass"}}));
    c.fails("specular_color_of_two", "'specularColorFactor'",
            extension("KHR_materials_specular", {{"specularColorFactor", {1, 1}}}));
    c.fails("clearcoat_is_number", "KHR_materials_clearcoat", extension("KHR_materials_clearcoat", 1));
    c.fails("diffuse_of_three", "'diffuseFactor'",
            extension("KHR_materials_pbrSpecularGlossiness", {{"diffuseFactor", {1, 1, 1}}}));
    c.fails("specular_glossiness_is_number", "KHR_materials_pbrSpecularGlossiness",
            extension("KHR_materials_pbrSpecularGlossiness", 1));
    c.fails("anisotropy_is_text", "'anisotropyStrength'",
            extension("KHR_materials_anisotropy", {{"anisotropyStrength", "much"}}));
    c.fails("diffuse_transmission_is_array", "'diffuseTransmissionFactor'",
            extension("KHR_materials_diffuse_transmission", {{"diffuseTransmissionFactor", {1}}}));
    c.fails("sheen_color_is_number", "'sheenColorFactor'", extension("KHR_materials_sheen", {{"sheenColorFactor", 1}}));
    c.fails("extensions_is_array", "'extensions'", member("extensions", Json::array()));
}

}  // namespace rcs::test
