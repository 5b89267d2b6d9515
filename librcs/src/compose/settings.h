#pragma once

#include "rcs/direct_light.h"
#include "rcs/records.h"
#include "rcs/render_options.h"

namespace rcs {

/// The stages' settings as far as the options say them.
RecordSettings record_settings(const RenderOptions& options);
DirectSettings direct_settings(const RenderOptions& options);

}  // namespace rcs
