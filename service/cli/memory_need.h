#pragma once

#include <string>
#include <vector>

#include "rcs/log.h"
#include "rcs/render_options.h"

namespace rcs::service {

/// About what a render of so many pixels holds at the most, beside its scene [bytes]. @param files  that are written
double memory_need(const RenderOptions& options, const std::vector<std::string>& files);

/// Says what a large picture will take, before any work. @throws rcs::Error out_of_memory: more than there is
void check_memory(const RenderOptions& options, const std::vector<std::string>& files, const LogFunction& log);

}  // namespace rcs::service
