#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include "cli/arguments.h"
#include "output/moments.h"
#include "rcs/render.h"

namespace rcs::service {

/// How long a picture is exposed.
struct Shutter {
    double open = 0.0;  ///< part of the time from one frame to the next, in [0, 1]; 0: the picture is of one moment
    double fps = 24.0;  ///< frames a second

    bool blurs() const { return open > 0.0; }
    /// @param picture  its own time [s]
    Exposed exposed(double picture) const { return {open / fps, picture}; }
};

/// --shutter. The option --fps is left to the command.
/// @param help  empty: as render takes moments
void add_shutter(CLI::App& command, Shutter& shutter, const std::string& help = {});

/// What is seen while the shutter is open.
/// @param camera, session  the latter shows the scene at any time; both must outlive what is returned
/// @param time  of the picture [s]
MomentFunction moments_of(const SceneArguments& scene, const CameraSource& camera, const Session& session,
                          const Shutter& shutter, double time);

}  // namespace rcs::service
