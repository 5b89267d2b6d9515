#pragma once

#include <map>
#include <string>

#include "report/accuracy_report.h"
#include "report/plot.h"

namespace rcs::service {

/// page.html, page.css and page.js, by name.
const std::map<std::string, std::string>& page_sources();

/// The curve of the report: what page and picture file draw.
PlotData plot_of(const AccuracyReport& report);

/// The report as one HTML file that needs nothing beside it: pictures, style and script are inside.
std::string to_html(const AccuracyReport& report);

}  // namespace rcs::service
