#pragma once

#include "rcs/scene.h"

namespace rcs {

// What the atrium is built of, many times over [m].

constexpr float kBay = 3.0f;  ///< from column to column

struct Storey {
    float floor, spring, top;  ///< heights of floor, arch springing, upper edge of the arched wall
    float column_radius;
};

/// A column from y = 0: square plinth, torus, shaft that narrows upwards, capital, square abacus.
Mesh column_mesh(float radius, float height);

/// The wall of one bay above the springing: an arch cut out of a rectangle, along X, centred on z = 0.
Mesh arch_mesh(const Storey& storey);

/// The railing of one bay, along X, from y = 0 up.
Mesh balustrade_mesh();

/// Cloth that hangs from y = 0 down, in folds, facing +Z.
Mesh banner_mesh();

void scale_uvs(Mesh& mesh, float repeats_per_metre);

}  // namespace rcs
