#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "compose/contact_pixels.h"
#include "rcs/camera.h"
#include "rcs/gbuffer.h"
#include "rcs/splat.h"
#include "rcs/thread_pool.h"
#include "records/gather.h"

namespace rcs {

/// Pixels at contacts, and where they are looked for among what is known.
struct ContactPixels {
    const GBuffer& gbuffer;
    const View& view;
    std::span<const PixelAtContact> pixels;
    std::uint32_t scene = 0;  ///< number of the state of the scene: gathers that know another one are left out
};

/// Takes those out that pixels show, whatever state of the scene they know. @param known  as for gather_contacts()
std::vector<Record> take_shown(const ContactPixels& at, std::vector<Record>& known);

/// Pixels at contacts gather themselves, if none has where they are.
/// @param gatherer  as the records', without radiance by direction; of as many rays as a pixel begins with
/// @param known  gathers at contacts, found again by their places; those made here are added
/// @param report  told the fraction done, on this thread; may throw
/// @return rays, those from what they meet too
std::uint64_t gather_contacts(const RecordGatherer& gatherer, const ContactPixels& at, ThreadPool& pool,
                              std::vector<Record>& known, const std::function<void(float)>& report);

/// What contacts took.
struct ContactStats {
    std::uint64_t pixels = 0;  ///< that had a word beside the records'
    std::uint64_t rays = 0;    ///< of further gathers
};

struct ContactSettings {
    float noise = 0.07f;    ///< standard error that a pixel may keep, relative to its light; else it gathers more
    int most_rays = 192;    ///< about so many of a pixel, >= twice those that it begins with
    std::uint32_t now = 1;  ///< number of the view, > 0
};

/// What pixels at contacts found counts against the records' word by how much those around are off beyond their own
/// noise; new ones may gather more, others stay as they are, and so does what they show. Those of which nothing is
/// known, or where no record is, are left out.
/// @param gatherer  as for gather_contacts(); null: nothing gathers more
/// @param of_lamps  the sums' part that gathered lamps send, which stays; may be empty
/// @param all  of all light: corrected, and what is known of its error
ContactStats ask_contacts(const RecordGatherer* gatherer, const ContactPixels& at, const ContactSettings& settings,
                          ThreadPool& pool, std::vector<Record>& known, const SplatBuffer& of_lamps, SplatBuffer& all,
                          const std::function<void(float)>& report);

}  // namespace rcs
