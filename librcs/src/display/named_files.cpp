#include "display/named_files.h"

namespace rcs {

namespace ocio = OCIO_NAMESPACE;

namespace {

std::optional<std::string> file_of(const ocio::ConstTransformRcPtr& transform)
{
    if (const auto file = ocio::DynamicPtrCast<const ocio::FileTransform>(transform)) return file->getSrc();
    const auto group = ocio::DynamicPtrCast<const ocio::GroupTransform>(transform);
    for (int i = 0; group && i < group->getNumTransforms(); ++i) {
        if (auto found = file_of(group->getTransform(i))) return found;
    }
    return std::nullopt;
}

std::optional<std::string> file_of(const ocio::ConstTransformRcPtr& one, const ocio::ConstTransformRcPtr& other)
{
    auto found = file_of(one);
    return found ? found : file_of(other);
}

}  // namespace

std::optional<std::string> named_file(const ocio::ConstConfigRcPtr& config)
{
    for (int i = 0; i < config->getNumColorSpaces(ocio::SEARCH_REFERENCE_SPACE_ALL, ocio::COLORSPACE_ALL); ++i) {
        const char* name = config->getColorSpaceNameByIndex(ocio::SEARCH_REFERENCE_SPACE_ALL, ocio::COLORSPACE_ALL, i);
        const auto space = config->getColorSpace(name);
        if (!space) continue;
        if (auto found = file_of(space->getTransform(ocio::COLORSPACE_DIR_TO_REFERENCE),
                                 space->getTransform(ocio::COLORSPACE_DIR_FROM_REFERENCE)))
            return found;
    }
    for (int i = 0; i < config->getNumLooks(); ++i) {
        const auto look = config->getLook(config->getLookNameByIndex(i));
        if (auto found = file_of(look->getTransform(), look->getInverseTransform())) return found;
    }
    for (int i = 0; i < config->getNumViewTransforms(); ++i) {
        const auto view = config->getViewTransform(config->getViewTransformNameByIndex(i));
        if (auto found = file_of(view->getTransform(ocio::VIEWTRANSFORM_DIR_TO_REFERENCE),
                                 view->getTransform(ocio::VIEWTRANSFORM_DIR_FROM_REFERENCE)))
            return found;
    }
    for (int i = 0; i < config->getNumNamedTransforms(ocio::NAMEDTRANSFORM_ALL); ++i) {
        const auto named = config->getNamedTransform(config->getNamedTransformNameByIndex(ocio::NAMEDTRANSFORM_ALL, i));
        if (auto found = file_of(named->getTransform(ocio::TRANSFORM_DIR_FORWARD),
                                 named->getTransform(ocio::TRANSFORM_DIR_INVERSE)))
            return found;
    }
    return std::nullopt;
}

}  // namespace rcs
