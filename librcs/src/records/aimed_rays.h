#pragma once

#include <glm/glm.hpp>

#include "records/gatherer.h"

namespace rcs {

// Some rays of a gather go where light arrived before, the others all over the hemisphere. A direction's light is
// shared between the two by how many of each are likely to go there (the balance heuristic: Veach and Guibas 1995,
// section 3.3), so that the sum is right whatever the map knows. R_k is that of the hemisphere's rays alone; gradients
// take the mean radiance of its cells, as all rays that went there tell it.

/// Which bins of a map the hemisphere's cells lie in. @param w  holds their directions
void note_bins(const GatherSize& size, GatherWorkspace& w);

/// Directions of the aimed cells, one of each stratum of the map's chances, and what each cell's ray counts for.
/// @param w  holds the directions and bins of the hemisphere's cells
void aim_by_map(const ArrivalMap& map, const Birth& birth, const GatherSize& size, GatherWorkspace& w);

/// What both bring, once the cells' light is known.
HemisphereIntegrals integrate_mixed(const GatherSize& size, GatherWorkspace& w);

/// What all rays of the gather brought, for those to come.
void note_arrivals(const ArrivalMap& map, const Birth& birth, GatherWorkspace& w);

}  // namespace rcs
