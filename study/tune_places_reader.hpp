/// Reads the operating points of [tune]. Internal to study/.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "study/section.hpp"
#include "study/study.hpp"

namespace tiltrim::reading {

/// Names of the conditions, in the study's order.
std::vector<std::string> read_places(const Section& section,
                                     const std::vector<Condition>& conditions);
/// `corridor`, m.
std::vector<double> read_heights(const Section& section, const std::filesystem::path& file);
/// `schedule_eta_deg`, rad.
std::vector<double> read_schedule_tilts(const Section& section);

}  // namespace tiltrim::reading
