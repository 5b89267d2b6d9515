#pragma once

#include <string>
#include <utility>
#include <vector>

#include "rcs/gl_context.h"
#include "rcs/log.h"
#include "rcs/thread_pool.h"

namespace rcs::service {

/// What this machine renders with, by name, in the order to be shown.
using MachineReport = std::vector<std::pair<std::string, std::string>>;
MachineReport describe_machine(GlContext& gl, ThreadPool& pool, const LogFunction& log);

}  // namespace rcs::service
