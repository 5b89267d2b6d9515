#pragma once

#include <vector>

#include "rcs/splat.h"

namespace rcs {

/// The sum of weights alone, for finding holes: one value per pixel, row by row.
std::vector<float> splat_weights(const std::vector<Record>& records, const GBuffer& gbuffer, const View& view,
                                 const SplatOptions& options, ThreadPool& pool);

/// Adds the weights of more records to such a sum.
void add_weights(const std::vector<Record>& records, const GBuffer& gbuffer, const View& view,
                 const SplatOptions& options, ThreadPool& pool, std::vector<float>& weight);

}  // namespace rcs
