#pragma once

#include <vector>

#include "rcs/splat.h"

namespace rcs {

/// Sets what each record says beyond its own irradiance in such a splat, Record::correction. A weighted mean of
/// tangents lies above light that bulges and below light that sags between them. By how much, the records know: at each
/// of them the splat of all is off from what it holds. That, as the splat smooths it, is added once more (Tukey's
/// twicing: Exploratory Data Analysis 1977, section 16), the less the more of it is noise.
/// @param options  of the splat; its overlap counts
void set_corrections(std::vector<Record>& records, const SplatSettings& options, ThreadPool& pool);

}  // namespace rcs
