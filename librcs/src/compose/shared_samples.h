#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compose/contacts.h"
#include "direct/direct.h"
#include "gbuffer/shading.h"
#include "gbuffer/views.h"
#include "rcs/gbuffer.h"
#include "rcs/image.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// The first pass of a picture, for further ones to share: anti-aliasing is for pixels that see more than one thing.
struct SharedSamples {
    KnownSamples known;
    LayeredImage first;  ///< the sums of that pass
    std::vector<PixelAtContact> contacts{};
};

/// Finds the smooth pixels: those that are the mean of each two neighbours that face each other, but for kSmooth, in
/// the first pass, and whose direct light is not an average over lamps seen in part. (Contrast as a measure of where
/// samples are needed: Mitchell 1987; here the triangle that a further sample sees has to be the same as well, so that
/// no shape is missed.)
/// @param contacts  never smooth: each pass asks what is known there   @param sums  of the first pass alone
SharedSamples find_smooth(const GBuffer& gbuffer, const DirectLightResult& direct,
                          std::span<const PixelAtContact> contacts, const LayeredImage& sums, ThreadPool& pool);

/// Adds the first pass's light where this one met what it knew. @return at how many pixels
std::size_t add_shared(const SharedSamples& shared, LayeredImage& sums);

}  // namespace rcs
