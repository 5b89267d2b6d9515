#pragma once

#include <string>
#include <vector>

#include "rcs/api.h"
#include "rcs/camera.h"
#include "rcs/gl_context.h"
#include "rcs/render.h"
#include "rcs/scene.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// One hard case: what could go wrong, and what has to come out, by analysis ("=") or by comparison with another
/// render that must be the same. All are small scenes built in code.
struct StabilityCase {
    std::string id;  ///< "A1"; the letter is the group's
    std::string
        group;         ///< "light transport", "records", "views", "geometry", "lights and materials", "time", "machine"
    std::string name;  ///< what is rendered or done
    std::string hazard;       ///< what would break
    std::string expectation;  ///< what has to come out
    double tolerance = 0.0;   ///< the case passes where its figure is at most this, and nothing else was wrong
    std::string reason;       ///< of the tolerance
    bool quick = false;       ///< together the quick cases take less than half a minute on two cores
};

/// The whole catalogue, in order.
RCS_API const std::vector<StabilityCase>& stability_cases();

/// What a user's own scene must stand: it is changed in ways that do not change its light.
RCS_API const std::vector<StabilityCase>& metamorphic_cases();

/// How a case ended.
enum class StabilityVerdict { passed, failed, skipped };

/// What a case found.
struct StabilityOutcome {
    StabilityVerdict verdict = StabilityVerdict::failed;  ///< how it ended
    double figure = 0.0;   ///< the worst of what was measured, to be compared with the tolerance
    std::string measured;  ///< in words: the figure's unit and where it was found, or what else went wrong
    double seconds = 0.0;  ///< that it took [s]
    std::string saved;     ///< folder of the reproducer; "" if none was made
};

/// What the cases run on. GL and threads are those of the caller.
struct StabilityMachine {
    GlContext& gl;            ///< of the thread that runs them
    ThreadPool& pool;         ///< not at work otherwise
    std::string program;      ///< an rcsplat to start as a process of its own; "": cases that need one are skipped
    std::string save_folder;  ///< existing folder for reproducers of cases that fail; "": none are made
    GatherMethod gather = GatherMethod::automatic;  ///< what traces the rays of records
};

/// Runs one case. Whatever the case throws is its failure.
/// @throws Error not_found: lists the cases there are
RCS_API StabilityOutcome run_stability_case(const StabilityMachine& machine, const std::string& id);

/// Runs one of metamorphic_cases() on a view of a scene.
/// @param options  how to render; the splat method and layers are chosen by the case
RCS_API StabilityOutcome run_metamorphic_case(const StabilityMachine& machine, const std::string& id,
                                              const Scene& scene, const Camera& camera, const RenderOptions& options);

}  // namespace rcs
