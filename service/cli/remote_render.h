#pragma once

#include "cli/render_arguments.h"
#include "cli/server_arguments.h"
#include "cli/shutter.h"

namespace rcs::service {

/// Does what render does, on a server; the pictures are the same bit for bit. A signal cancels the job.
void render_on_server(const RenderArguments& arguments, const Shutter& shutter, const ServerArguments& server);

}  // namespace rcs::service
