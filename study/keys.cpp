#include "study/keys.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <stdexcept>

#include "model/lookup.hpp"
#include "study/condition_reader.hpp"
#include "study/section.hpp"
#include "vehicles/tiltrotor/numbers.hpp"
#include "vehicles/tiltrotor/vehicle.hpp"

namespace tiltrim {

double Key::in_si(double value) const { return reading::in_si(value, unit); }
double Key::in_study(double si) const { return si / reading::in_si(1.0, unit); }

std::vector<Key> number_keys(const Signals& signals) {
  std::vector<Key> keys;
  for (const Signal& signal : signals) {
    const AcceptedNumber accepted = accepted_number(signal.name);
    keys.push_back({accepted.degrees ? signal.name + "_deg" : signal.name,
                    signal.name,
                    accepted.degrees ? "degrees" : signal.unit,
                    {accepted.lower, accepted.upper}});
  }
  return keys;
}

std::vector<Key> study_keys() {
  std::vector<Key> keys = reading::condition_keys();
  for (const Signals& signals : {aircraft_signals(), gain_signals()})
    for (Key& key : number_keys(signals)) keys.push_back(std::move(key));
  return keys;
}

Key study_key(std::string_view name) { return key_among(study_keys(), name); }

// "mass" is short for "aircraft.mass", "theta" for "theta_deg"; else the nearest spelling.
static std::string suggestion(const std::string& name, const std::vector<std::string>& all) {
  for (const std::string& full : all)
    if (full.ends_with("." + name) || full == name + "_deg" || full.ends_with("." + name + "_deg"))
      return full;
  return nearest_name(name, all);
}

Key key_among(const std::vector<Key>& keys, std::string_view name) {
  const auto at = std::ranges::find(keys, name, &Key::name);
  if (at != keys.end()) return *at;
  std::vector<std::string> all;
  for (const Key& key : keys) all.push_back(key.name);
  const std::string near = suggestion(std::string(name), all);
  throw std::invalid_argument(fmt::format(
      "{} is not a number of a study; {}there are: {}", reading::in_quotes(name),
      near.empty() ? "" : fmt::format("did you mean '{}'? ", near), fmt::join(all, ", ")));
}

}  // namespace tiltrim
