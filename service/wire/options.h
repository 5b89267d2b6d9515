#pragma once

#include "rcs/render_options.h"
#include "rcs/v1/options.pb.h"

/// Options of a render as messages: fields by the names of rcs/option_table.h. What follows from a job's outputs
/// (layers) does not travel.
namespace rcs::service {

/// With every field set but those of another quality.
v1::RenderOptions to_message(const RenderOptions& options);

/// A field that is absent has the library's default.
/// @throws rcs::Error bad_argument: the field, its value and its range; a field that an earlier version had
RenderOptions from_message(const v1::RenderOptions& message);

}  // namespace rcs::service
