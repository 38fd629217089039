/// Data of the figures for the script of the report's page. Internal to report/.
#pragma once

#include <string>

#include "report/figure.hpp"

namespace tiltrim {

/// JSON for a <script> element: tracks, grids, and where the axes of each figure are, in pixels.
std::string script_data(const ReportFigures& all);

}  // namespace tiltrim
