#pragma once

#include <vector>

#include "rcs/image.h"
#include "report/plot.h"

namespace rcs::service {

/// Whether raster() will find its font. @throws rcs::Error not_found that names the package to install
void check_plot_font();

/// The plot as a picture, display RGB on white, at twice its size.
Image raster(const std::vector<Shape>& shapes);

}  // namespace rcs::service
