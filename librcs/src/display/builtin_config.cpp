#include "display/builtin_config.h"

#include <initializer_list>

namespace rcs {
namespace {

namespace ocio = OCIO_NAMESPACE;

struct Step {
    const char* style;
    ocio::TransformDirection direction = ocio::TRANSFORM_DIR_FORWARD;
};

ocio::GroupTransformRcPtr chain(std::initializer_list<Step> steps)
{
    const ocio::GroupTransformRcPtr group = ocio::GroupTransform::Create();
    for (const Step& step : steps) {
        const ocio::BuiltinTransformRcPtr transform = ocio::BuiltinTransform::Create();
        transform->setStyle(step.style);
        transform->setDirection(step.direction);
        group->appendTransform(transform);
    }
    return group;
}

void add_scene_space(ocio::Config& config, const char* name, const char* encoding,
                     const ocio::ConstTransformRcPtr& to_reference)
{
    const ocio::ColorSpaceRcPtr space = ocio::ColorSpace::Create(ocio::REFERENCE_SPACE_SCENE);
    space->setName(name);
    space->setEncoding(encoding);
    space->setBitDepth(ocio::BIT_DEPTH_F32);
    if (to_reference) {
        space->setTransform(to_reference, ocio::COLORSPACE_DIR_TO_REFERENCE);
    }
    config.addColorSpace(space);
}

void add_display_space(ocio::Config& config, const char* name, const ocio::ConstTransformRcPtr& from_reference)
{
    const ocio::ColorSpaceRcPtr space = ocio::ColorSpace::Create(ocio::REFERENCE_SPACE_DISPLAY);
    space->setName(name);
    space->setEncoding("sdr-video");
    space->setBitDepth(ocio::BIT_DEPTH_F32);
    if (from_reference) {
        space->setTransform(from_reference, ocio::COLORSPACE_DIR_FROM_REFERENCE);
    }
    config.addColorSpace(space);
}

void add_view_transform(ocio::Config& config, const char* name, const ocio::ConstTransformRcPtr& from_scene)
{
    const ocio::ViewTransformRcPtr view = ocio::ViewTransform::Create(ocio::REFERENCE_SPACE_SCENE);
    view->setName(name);
    view->setTransform(from_scene, ocio::VIEWTRANSFORM_DIR_FROM_REFERENCE);
    config.addViewTransform(view);
}

}  // namespace

ocio::ConstConfigRcPtr builtin_config()
{
    const ocio::ConfigRcPtr config = ocio::Config::Create();
    config->setVersion(2, 0);  // all that is used here; newer libraries read it unchanged

    // The scene reference is ACES2065-1, the display reference CIE XYZ (D65), as in the ACES configurations.
    add_scene_space(*config, "ACES2065-1", "scene-linear", {});
    add_scene_space(
        *config, kLinearRec709, "scene-linear",
        chain({{"UTILITY - ACES-AP1_to_LINEAR-REC709_BFD", ocio::TRANSFORM_DIR_INVERSE}, {"ACEScg_to_ACES2065-1"}}));
    add_display_space(*config, "CIE-XYZ-D65", {});
    add_display_space(*config, "sRGB", chain({{"DISPLAY - CIE-XYZ-D65_to_sRGB"}}));
    add_display_space(*config, "Rec.1886", chain({{"DISPLAY - CIE-XYZ-D65_to_REC.1886-REC.709"}}));

    add_view_transform(*config, "ACES 1.0 SDR", chain({{"ACES-OUTPUT - ACES2065-1_to_CIE-XYZ-D65 - SDR-VIDEO_1.0"}}));
    add_view_transform(*config, "Un-tone-mapped", chain({{"UTILITY - ACES-AP0_to_CIE-XYZ-D65_BFD"}}));
    config->setDefaultViewTransformName("Un-tone-mapped");

    for (const char* display : {"sRGB", "Rec.1886"}) {
        for (const char* view : {"ACES 1.0 SDR", "Un-tone-mapped"}) {
            config->addDisplayView(display, view, view, display, "", "", "");
        }
    }
    config->setRole("scene_linear", kLinearRec709);
    config->setRole("default", kLinearRec709);
    config->setRole("aces_interchange", "ACES2065-1");
    config->setRole("cie_xyz_d65_interchange", "CIE-XYZ-D65");
    config->validate();
    return config;
}

}  // namespace rcs
