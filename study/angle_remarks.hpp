/// @file
/// Angles of a study that appear to be in the other unit.
#pragma once

#include <string>
#include <vector>

#include "study/study.hpp"

namespace tiltrim {

/// One remark "file:line:column: ..." for each value in degrees that is a common fraction of pi to
/// four digits (1.5708), and for each value in rad of a [model] that is beyond a full turn (90).
/// Both are valid, and probably meant in the other unit.
std::vector<std::string> angle_remarks(const Study& study);

}  // namespace tiltrim
