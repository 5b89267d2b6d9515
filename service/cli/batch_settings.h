#pragma once

#include <string>
#include <vector>

#include "batch/frame_record.h"
#include "cli/batch_run.h"
#include "output/output_files.h"
#include "rcs/render_options.h"

namespace rcs::service {

/// Whether frames begin with the records of others. @param is_animated  the scene moves
bool keeps_records(const BatchArguments& arguments, bool is_animated);

/// What an output keeps of the picture, as text.
std::string kept_by(const OutputFile& file);

/// What all frames of a batch depend on. @param mapper  of the files; null only where all are EXR
Dependencies settings_of_frames(const BatchArguments& arguments, bool is_animated, const RenderOptions& options,
                                const std::vector<OutputFile>& files, const ToneMapper* mapper);

}  // namespace rcs::service
