#pragma once

#include <string>

#include "rcs/camera.h"
#include "rcs/image.h"
#include "rcs/log.h"
#include "rcs/ray_scene.h"
#include "rcs/reference.h"
#include "rcs/thread_pool.h"

namespace rcs::service {

/// A reference, and how wrong it still is.
struct ConvergedReference {
    LayeredImage image;
    int paths = 0;         ///< a pixel
    double seconds = 0.0;  ///< that tracing it took, in all runs together
    double error = 0.0;    ///< mean relative error of its indirect layer: what an image without error would measure
};

/// Where the halves of a reference are kept from round to round, and from run to run.
struct KeptHalves {
    std::string folder, key;  ///< those of another key are not taken up
};

/// Traces until the reference's own error is small enough. Two halves of different seeds are traced, the reference is
/// their mean: so half their difference is noise of the same size as the mean's, and is measured, not estimated.
/// @param kept  after every round; taken up if they are there
/// @param options  samples: the most to take, of both halves together; the second half takes the next seed
/// @param wanted_error  mean relative error of the indirect layer, > 0; missing it is a warning
ConvergedReference converge(const RayScene& rays, const View& view, const ReferenceOptions& options,
                            const KeptHalves& kept, double wanted_error, ThreadPool& pool, const LogFunction& log,
                            const ProgressFunction& progress);

}  // namespace rcs::service
