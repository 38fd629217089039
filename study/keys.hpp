/// The variables of a study that an analysis may vary: their names in the study and in the models.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "model/model.hpp"

namespace tiltrim {

/// A variable of a study.
struct Key {
  std::string name;    ///< as in a study: "V", "gamma_deg", "aircraft.mass", "gains.K_Lp"
  std::string signal;  ///< as in the models: "V", "gamma", "aircraft.mass", "gains.K_Lp"
  std::string unit;    ///< of the study: "m/s", "degrees", ""
  Range accepted;      ///< in that unit

  double in_si(double value) const;  ///< to SI: degrees to radians
  double in_study(double si) const;  ///< from SI
};

/// The keys of a condition, then those of the aircraft and the gains.
std::vector<Key> study_keys();
/// The key of this name. Throws std::invalid_argument with the nearest and all valid names if there
/// is none.
Key study_key(std::string_view name);
/// The same among `keys`.
Key key_among(const std::vector<Key>& keys, std::string_view name);

/// The keys of aircraft_signals() or gain_signals(), in order.
std::vector<Key> number_keys(const Signals& signals);

}  // namespace tiltrim
