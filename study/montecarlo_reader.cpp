// [montecarlo] of a study.
#include <fmt/core.h>

#include <algorithm>

#include "study/simulate_reader.hpp"
#include "study/tune_reader.hpp"

namespace tiltrim::reading {

namespace {

bool of_vehicle(const Key& key) { return key.name.find('.') != std::string::npos; }

// Variables of the initial state and the weather.
std::vector<Key> flight_keys() {
  return {study_key("theta_deg"),
          {"height", "height", "m", {height.lower, height.upper}},
          {"gust_size", "gust_size", "m/s", {wind.lower, wind.upper}}};
}

Key scattered_key(const Section& section) {
  std::vector<Key> keys = flight_keys();
  for (const Key& key : study_keys())
    if (of_vehicle(key)) keys.push_back(key);
  std::vector<std::string> names;
  for (const Key& key : keys) names.push_back(key.name);
  section.require("key", "a number in quotes, as \"aircraft.mass\" or \"theta_deg\"");
  return keys[section.choice("key", names)];
}

// Range of a parameter; of a gain over all tilts of the schedule.
Range vehicle_range(const Study& study, const std::string& name) {
  const double own = own_value(study.vehicle, name);
  Range range{own, own};
  Vehicle vehicle = study.vehicle;
  for (const Gains& gains : study.schedule.gains) {
    vehicle.gains = gains;
    range.lower = std::min(range.lower, own_value(vehicle, name));
    range.upper = std::max(range.upper, own_value(vehicle, name));
  }
  return range;
}

// Refuses a variable that the flight does not have.
void check_scattered(const Section& section, const Key& key, const Study& study) {
  const Entry& entry = *section.find("key");
  const std::vector<GustTable>& gusts = study.simulate->gusts;
  if (key.name == "height" && from_ground(*study.simulate))
    section.refuse(entry,
                   "the flight starts on the ground, at 0 m; expected [simulate] with "
                   "start = \"trim\" or a condition");
  if (key.name == "gust_size" && gusts.empty())
    section.refuse(entry, "there is no gust; expected [[simulate.gust]] tables");
  if (!of_vehicle(key)) return;
  const Range own = vehicle_range(study, key.signal);
  if (own.lower != own.upper)
    section.refuse(entry, fmt::format("{} depends on the tilt (schedule_eta_deg), from {} to {}; "
                                      "expected a number that is constant",
                                      key.name, own.lower, own.upper));
}

Uncertain read_scatter(const Section& section, const Study& study,
                       const std::vector<Uncertain>& earlier) {
  section.allow_only({"key", "percent", "from", "to"});
  Key key = scattered_key(section);
  check_scattered(section, key, study);
  if (std::ranges::find(earlier, key.signal, &Uncertain::name) != earlier.end())
    section.refuse(*section.find("key"),
                   fmt::format("{} is given twice; expected each number once", key.name));
  const Entry* percent = section.find("percent");
  if (percent && !of_vehicle(key))
    section.refuse(
        *percent,
        fmt::format("needs a number of the vehicle, which {} is not; expected from and to",
                    key.name));
  const bool turbulent = std::ranges::find(study.simulate->gusts, GustTable::Kind::dryden,
                                           &GustTable::kind) != study.simulate->gusts.end();
  if (key.name == "gust_size" && turbulent) key.accepted.lower = turbulence.lower;
  const Range ends = read_reach(
      section, key, [&](const std::string& number) { return own_value(study.vehicle, number); });
  return {key.signal, ends.lower, ends.upper};
}

}  // namespace

MonteCarloTable read_montecarlo(const Section& section, const Study& study) {
  section.allow_only(
      {"flights", "seed", "worst", "V_within", "gamma_within_deg", "theta_within_deg", "scatter"});
  MonteCarloTable montecarlo;
  read_whole(section, "flights", {1, 1e7}, montecarlo.flights);
  read_whole(section, "seed", {0, most_seeds}, montecarlo.seed);
  read_whole(section, "worst", {0, 1000}, montecarlo.worst);
  read_number(section, "V_within", speed, montecarlo.V_within);
  read_number(section, "gamma_within_deg", {0, 180, "degrees"}, montecarlo.gamma_within);
  read_number(section, "theta_within_deg", {0, 180, "degrees"}, montecarlo.theta_within);
  for (const Section& scatter : section.tables("scatter"))
    montecarlo.scatter.push_back(read_scatter(scatter, study, montecarlo.scatter));
  check_divisors(section, {"scatter"}, [&](const std::string& name) {
    const auto at = std::ranges::find(montecarlo.scatter, name, &Uncertain::name);
    return at == montecarlo.scatter.end() ? vehicle_range(study, name)
                                          : Range{at->lower, at->upper};
  });
  return montecarlo;
}

}  // namespace tiltrim::reading
