#pragma once

#include "output/output_files.h"
#include "rcs/tone_map.h"
#include "rcs/v1/options.pb.h"

/// What is made of a picture: between the library's words and the wire's.
namespace rcs::service {

/// In the folder of a frame's pictures: a small one of them, for whoever looks at the queue. Nothing depends on it.
inline constexpr const char* kThumbnail = ".thumbnail.jpg";

/// Without `ocio_config`, which is a file.
v1::ToneMap to_message(const ToneMapOptions& options);
ToneMapOptions from_message(const v1::ToneMap& message);

/// Its path is the output's name.
v1::Output to_message(const OutputFile& file);
OutputFile from_message(const v1::Output& message);

}  // namespace rcs::service
