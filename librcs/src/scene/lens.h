#pragma once

#include <glm/glm.hpp>

#include "rcs/camera.h"

namespace rcs {

/// What the camera sees through one point of its lens: a pinhole there, shifted so that the plane in focus stays.
/// @param point  of the unit disc, to the right and up
Camera through_lens(Camera camera, const Lens& lens, glm::dvec2 point);

/// Where pass i of n looks through the lens, in the unit disc: the middle first, then evenly for every n.
glm::dvec2 lens_point(int pass);

/// Diameter of the disc that a point becomes [m on the plane at distance 1]. @param depth  along the axis [m]; may be
/// infinite
double circle_of_confusion(const Lens& lens, double depth);

}  // namespace rcs
