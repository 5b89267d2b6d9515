#include "rcs/layers.h"

#include "rcs/error.h"

namespace rcs {
namespace {

constexpr const char* kRadiance = "W m^-2 sr^-1";
constexpr const char* kIrradiance = "W m^-2";

// A layer that render() makes has, beside its row here, one in compose/layer_sums.cpp: how passes add up to it.
constexpr LayerKind kLayers[] = {
    {.name = "beauty",
     .channels = "RGBA",
     .unit = kRadiance,
     .what = "all light: emission + direct + indirect; A says how much of the pixel is covered",
     .of_reference = true},
    {.name = "emission",
     .channels = "RGB",
     .unit = kRadiance,
     .what = "light emitted towards the camera, the sky behind included",
     .made_by = {Effect::emission},
     .in_sum = true,
     .of_reference = true},
    {.name = "direct",
     .channels = "RGB",
     .unit = kRadiance,
     .what = "reflected light of lamps",
     .made_by = {Effect::punctual_light, Effect::area_light, Effect::environment_peaks},
     .in_sum = true,
     .of_reference = true},
    {.name = "direct_error",
     .channels = "Y",
     .unit = kRadiance,
     .what = "standard error of direct's luminance, estimated",
     .made_by = {Effect::error_estimate},
     .in_sum = true},
    {.name = "indirect",
     .channels = "RGB",
     .unit = kRadiance,
     .what = "reflected light of other surfaces and the sky",
     .made_by = {Effect::indirect_diffuse, Effect::traced_lobes},
     .in_sum = true,
     .of_reference = true},
    {.name = "indirect_error",
     .channels = "Y",
     .unit = kRadiance,
     .what = "standard error of indirect's luminance, estimated",
     .made_by = {Effect::error_estimate},
     .in_sum = true},
    {.name = "irradiance",
     .channels = "RGB",
     .unit = kIrradiance,
     .what = "indirect irradiance",
     .made_by = {Effect::indirect_diffuse}},
    {.name = "albedo", .channels = "RGB", .what = "diffuse reflectance", .of_reference = true},
    {.name = "normal", .channels = "RGB", .what = "shading normal, world space", .of_reference = true},
    {.name = "depth",
     .channels = "Z",
     .unit = "m",
     .what = "distance from the camera; +inf where nothing is seen",
     .needs_float = true,
     .of_reference = true},
    {.name = "records",
     .channels = "Y",
     .what = "records whose influence covers the pixel",
     .made_by = {Effect::indirect_diffuse}},
    {.name = "position",
     .channels = "XYZ",
     .unit = "m",
     .what = "place of the nearest surface in the file's world; 0 where nothing is seen",
     .needs_float = true,
     .by_default = false},
    {.name = "motion",
     .channels = "XY",
     .unit = "px",
     .what = "how the nearest surface moved to where it is, from another time or camera; X to the right, Y up",
     .needs_float = true,
     .by_default = false},
    {.name = "CryptoObject",
     .channels = "RGBA",
     .what = "Cryptomatte: the nodes that a pixel sees, and the part that each covers",
     .needs_float = true,
     .by_default = false,
     .parts = 3},
    {.name = "CryptoMaterial",
     .channels = "RGBA",
     .what = "Cryptomatte: the materials that a pixel sees, and the part that each covers",
     .needs_float = true,
     .by_default = false,
     .parts = 3},
    {.name = "standard_error",
     .channels = "RGB",
     .unit = kRadiance,
     .what = "standard error of beauty",
     .of_render = false,
     .of_reference = true},
    {.name = "indirect_standard_error",
     .channels = "RGB",
     .unit = kRadiance,
     .what = "standard error of indirect",
     .of_render = false,
     .of_reference = true},
};

}  // namespace

std::span<const LayerKind> all_layers() { return kLayers; }

std::string part_name(const LayerKind& layer, int part)
{
    const std::string name(layer.name);
    return layer.parts == 1 ? name : name + (part < 10 ? "0" : "") + std::to_string(part);
}

const LayerKind* look_up_layer(std::string_view name)
{
    for (const LayerKind& layer : kLayers)
        if (layer.name == name) return &layer;
    return nullptr;
}

namespace {

bool made_by(const LayerKind& layer, Renderer renderer)
{
    return renderer == Renderer::records ? layer.of_render : layer.of_reference;
}

}  // namespace

std::vector<std::string> layer_names(Renderer renderer)
{
    std::vector<std::string> names;
    for (const LayerKind& layer : kLayers)
        if (made_by(layer, renderer)) names.emplace_back(layer.name);
    return names;
}

std::vector<std::string> default_layer_names(Renderer renderer)
{
    std::vector<std::string> names;
    for (const LayerKind& layer : kLayers)
        if (made_by(layer, renderer) && layer.by_default) names.emplace_back(layer.name);
    return names;
}

const LayerKind& find_layer(std::string_view name)
{
    if (const LayerKind* const layer = look_up_layer(name); layer && layer->of_render) return *layer;
    std::string names;
    for (const std::string& there : layer_names(Renderer::records))
        names.append(names.empty() ? "" : ", ").append(there);
    throw Error(ErrorCode::not_found, std::string(name) + " is not a layer; there are " + names);
}

}  // namespace rcs
