/// Shared by maps and their differences. Internal to report/.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "report/map_sheets.hpp"

namespace tiltrim {

/// As spelt in JSON and CSV; empty for a point without an equilibrium.
std::string verdict_name(int verdict);
std::string status_name(int status);  ///< of a trim; "not_reached" for none
/// As in text: "°" for degrees.
std::string unit_of(const SweepAxis::Column& column);
/// "K_Lp from 0.05 to 5, 201 points"
std::string axis_in_words(const SweepAxis& axis);
/// The points from `first` to before `last` at which the model threw, and its first exception.
struct Threw {
  std::size_t points = 0;
  std::string first;
  bool alike = true;
};
Threw threw(const SweepMap& map, std::size_t first, std::size_t last);

nlohmann::ordered_json axes_json(const SweepMap& map);
nlohmann::ordered_json crossing_json(const SweepMap& map, const AxisCrossing& crossing);

}  // namespace tiltrim
