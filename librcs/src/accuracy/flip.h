#pragma once

#include "rcs/image.h"

namespace rcs {

/// How different two pictures look when one is flipped to the other and back, from 0 to 1: LDR-FLIP of Andersson,
/// Nilsson, Akenine-Moller, Oskarsson, Astrom, Fairchild: FLIP: A Difference Evaluator for Alternating Images. HPG
/// 2020. Colours are clipped to [0, 1]; what is not finite counts as black. The viewer sees 67.02 pixels a degree: 0.7
/// m from a 3840 pixels and 0.7 m wide display.
/// @param image,reference  linear RGB, or one grey channel, of the same size   @return mean over the pixels
double mean_flip(const Image& image, const Image& reference);

}  // namespace rcs
