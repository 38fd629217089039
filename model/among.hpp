/// Whether a name is in a list of names. Internal to tiltrim.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

namespace tiltrim {

inline bool among(const std::vector<std::string>& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

}  // namespace tiltrim
