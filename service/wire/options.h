#pragma once

#include "output/output_files.h"
#include "rcs/render.h"
#include "rcs/tone_map.h"
#include "rcs/v1/options.pb.h"

/// The one place where the library's option structs and the wire's messages meet. What follows from other fields or is
/// the renderer's own (dry_run, layers, and what render() sets in records and direct) does not travel.
/// Messages are made with every field set; read, a field that is absent has the library's default.
namespace rcs::service {

v1::RenderOptions to_message(const RenderOptions& options);
/// @throws rcs::Error bad_argument: the field, its value and its range; not_found: an effect
RenderOptions from_message(const v1::RenderOptions& message);

/// Without `ocio_config`, which is a file.
v1::ToneMap to_message(const ToneMapOptions& options);
ToneMapOptions from_message(const v1::ToneMap& message);

/// Its path is the output's name.
v1::Output to_message(const OutputFile& file);
OutputFile from_message(const v1::Output& message);

}  // namespace rcs::service
