/// Shared by maps and their differences. Internal to report/.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "report/sweeps.hpp"

namespace tiltrim {

/// As spelt in JSON and CSV; empty for a point without an equilibrium.
std::string verdict_name(int verdict);
/// As in text: "°" for degrees.
std::string unit_of(const SweepAxis::Column& column);
/// "K_Lp from 0.05 to 5, 201 points"
std::string axis_in_words(const SweepAxis& axis);
nlohmann::ordered_json axes_json(const SweepMap& map);
nlohmann::ordered_json crossing_json(const SweepMap& map, const AxisCrossing& crossing);

}  // namespace tiltrim
