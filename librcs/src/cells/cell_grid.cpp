#include "cells/cell_grid.h"

namespace rcs {

namespace {

// Least number of cells in the height of the view; at most twice as many. 24 and 48 differ by 0.1 % in sponza's MRE.
constexpr double kCellsPerView = 32.0;

}  // namespace

CellGrid make_cell_grid(const Bounds& bounds, const View& view)
{
    CellGrid grid;
    const double diagonal = glm::length(bounds.max - bounds.min);
    // 18 bits a coordinate: the scene spans at most half of them, and the rest lies around it.
    grid.finest = static_cast<float>(std::max(diagonal, 1e-30) / 131072.0);
    // An odd share, lest walls at round coordinates lie between two layers of cubes.
    grid.corner = glm::vec3(bounds.min - 0.2236 * std::max(diagonal, 1e-30));
    grid.eye = glm::vec3(camera_position(view.camera));
    if (view.camera.projection == Projection::orthographic)
        grid.edge_at_eye = static_cast<float>(2.0 * view.camera.ymag / kCellsPerView);
    else
        grid.edge_per_distance = static_cast<float>(2.0 * std::tan(0.5 * view.camera.yfov) / kCellsPerView);
    return grid;
}

}  // namespace rcs
