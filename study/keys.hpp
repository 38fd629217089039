/// @file
/// The numbers of a study that a verb may move: their names there and in the models.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "model/model.hpp"

namespace tiltrim {

/// A number of a study.
struct Key {
  std::string name;    ///< as in a study: "V", "gamma_deg", "aircraft.mass", "gains.K_Lp"
  std::string signal;  ///< as in the models: "V", "gamma", "aircraft.mass", "gains.K_Lp"
  std::string unit;    ///< of the study: "m/s", "degrees", ""
  Range accepted;      ///< in that unit

  double in_si(double value) const;  ///< from the study's unit: radians for degrees
  double in_study(double si) const;  ///< and back
};

/// Keys of a condition, then "aircraft." and "gains." ones.
std::vector<Key> study_keys();
/// Throws std::invalid_argument with the nearest and all real names if there is none.
Key study_key(std::string_view name);
/// The same among these keys.
Key key_among(const std::vector<Key>& keys, std::string_view name);

/// Keys for the numbers behind aircraft_signals() or gain_signals(), in their order.
std::vector<Key> number_keys(const Signals& signals);

}  // namespace tiltrim
