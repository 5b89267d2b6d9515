#pragma once

#include <map>
#include <string>

#include "server/http.h"
#include "server/service.h"

namespace rcs::service {

/// Files of service/server/page by name.
const std::map<std::string, std::string>& status_page_sources();

/// What the status page shows, by path: "/", "/status.json" and "/status.json/BEFORE" (jobs), "/frames/JOB/FIRST",
/// "/preview/JOB/FRAME", "/thumbnail/JOB/FRAME", "/picture/JOB/FRAME/NAME", "/metrics".
HttpAnswer page_answer(const Service& service, const std::string& path);

}  // namespace rcs::service
