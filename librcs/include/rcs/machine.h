#pragma once

#include <string>
#include <utility>
#include <vector>

#include "rcs/api.h"
#include "rcs/gl_context.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// A fact about the machine: its name and its value, in words.
using MachineFact = std::pair<std::string, std::string>;

/// Platform, vendor, renderer, version, the limits that librcs meets, and how exactly floats are blended, measured:
/// quads need 24 bits.
RCS_API std::vector<MachineFact> describe_gl(GlContext& gl);

/// The graphics devices there are, what `--gather auto` takes on this one, and why. May measure it, as a render would.
RCS_API std::vector<MachineFact> describe_gather(GlContext& gl, ThreadPool& pool);

/// What `--splat auto` takes, and why. May measure it, as a render would.
RCS_API std::vector<MachineFact> describe_splat(GlContext& gl, ThreadPool& pool);

/// The Embree library that is loaded: its version, the instruction sets it uses here, and what it was built with.
RCS_API std::vector<MachineFact> describe_rays();

}  // namespace rcs
