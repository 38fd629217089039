#include "model/keys.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <stdexcept>

#include "model/condition_reader.hpp"
#include "model/section.hpp"
#include "model/vehicle.hpp"

namespace tiltrim {

namespace {

using reading::Accepted;

constexpr double smallest = 1e-6, largest = 1e6;  // far beyond any aircraft, far from overflow

constexpr Accepted positive{smallest, largest}, not_negative{0, largest}, any{-largest, largest};

// Numbers that may not be just anything; those in degrees have keys ending in _deg.
struct Limited {
  std::string_view name;
  Accepted accepted;
};
constexpr auto limited_keys = std::to_array<Limited>({
    {"mass", positive},
    {"inertia_yy", positive},
    {"chord", positive},
    {"wing_area", positive},
    {"air_density", positive},
    {"gravity", positive},
    {"thrust_excess", positive},
    {"rotor_speed_rpm", positive},
    {"rotor_radius", positive},
    {"blade_count", positive},
    {"blade_chord", positive},
    {"blade_lift_slope", positive},
    {"pitch_scale", not_negative},
    {"wake_immersion", not_negative},
    {"cyclic_off", {-180, 180, "degrees"}},
    {"cyclic_blend", {0, 180, "degrees"}},
});

}  // namespace

double Key::in_si(double value) const { return reading::in_si(value, unit); }
double Key::in_study(double si) const { return si / reading::in_si(1.0, unit); }

std::vector<Key> number_keys(const Signals& signals) {
  std::vector<Key> keys;
  for (const Signal& signal : signals) {
    const std::string name = signal.name.substr(signal.name.find('.') + 1);
    const auto at = std::ranges::find(limited_keys, name, &Limited::name);
    const Accepted accepted = at == limited_keys.end() ? any : at->accepted;
    const bool degrees = accepted.degrees();
    keys.push_back({degrees ? signal.name + "_deg" : signal.name,
                    signal.name,
                    degrees ? "degrees" : signal.unit,
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

Key key_among(const std::vector<Key>& keys, std::string_view name) {
  const auto at = std::ranges::find(keys, name, &Key::name);
  if (at != keys.end()) return *at;
  std::vector<std::string> all;
  for (const Key& key : keys) all.push_back(key.name);
  const bool unit_missing = std::ranges::find(all, std::string(name) + "_deg") != all.end();
  const std::string near = unit_missing ? std::string(name) + "_deg" : nearest_name(name, all);
  throw std::invalid_argument(fmt::format(
      "{} is not a number of a study; {}there are: {}", reading::in_quotes(name),
      near.empty() ? "" : fmt::format("did you mean '{}'? ", near), fmt::join(all, ", ")));
}

}  // namespace tiltrim
