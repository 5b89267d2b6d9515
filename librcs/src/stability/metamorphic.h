#pragma once

#include "rcs/scene.h"
#include "stability/case_run.h"

namespace rcs::stability {

/// The scene under an affine map of the world that keeps angles: instances, cameras, and lights with it, whose
/// intensities grow with the square of the scale so that the picture stays the same. A mirrored camera's picture is
/// turned round left to right. Skies and environment images stay.
Scene transformed(Scene scene, const glm::dmat4& world);

Scene scaled(const Scene& scene, double factor);
/// Moved away, and its origin brought after it as the loader does.
Scene translated(const Scene& scene, glm::dvec3 by);
/// All light times a factor.
Scene relit(Scene scene, float factor);
/// The same things in another order: instances, triangles, lamps.
Scene reordered(Scene scene);
/// Left and right exchanged in all layers.
LayeredImage mirrored(LayeredImage image);
/// Direct and indirect light times a factor, so that it may be compared.
LayeredImage dimmed(LayeredImage image, float factor);

/// Notes how far two renders of the same picture with other random numbers are apart: the worst of the means of direct
/// and indirect light, and that pixels do not differ by more than their noise.
void compare_pictures(CaseRun& run, const RenderResult& got, const RenderResult& expected, const std::string& words);

/// The scene of a metamorphic case, and how to render it.
struct Subject {
    Scene scene;
    Camera camera;
    RenderOptions options;
};
/// @param subject  null if the rows are only to be listed
std::vector<SuiteCase> metamorphic_rows(const Subject* subject);

}  // namespace rcs::stability
