#include "study/prove_reader.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "study/axes.hpp"
#include "vehicles/tiltrotor/numbers.hpp"

namespace tiltrim::reading {

namespace {

constexpr double most_parameters = 6, most_damping = 0.99;

Key parameter_key(const Section& section) {
  const std::string name = section.text("key");
  if (name == "h") return height_key();
  try {
    return study_key(name);
  } catch (const std::invalid_argument& e) {
    section.refuse(*section.find("key"),
                   fmt::format("{}; or h, the height along corridor (16)", e.what()));
  }
}

// The vehicle's own number.
double own_number(const Section& section, const Vehicle& vehicle, const Key& key) {
  const Eigen::Index aircraft = find(aircraft_signals(), key.signal);
  const Eigen::Index gain = find(gain_signals(), key.signal);
  Vehicle copy = vehicle;
  if (aircraft >= 0) return aircraft_value(copy.aircraft, std::size_t(aircraft));
  if (gain >= 0) return gain_value(copy.gains, std::size_t(gain));
  section.refuse(
      *section.find("percent"),
      fmt::format("applies only to aircraft parameters and gains; expected from and to for {}",
                  key.name));
}

// A share of the study's own value, or from and to.
template <class Own>
ProveTable::Parameter read_range(const Section& section, const Key& key, const Own& own_value) {
  if (const Entry* percent = section.find("percent")) {
    for (const char* other : {"from", "to"})
      if (const Entry* entry = section.find(other))
        section.refuse(*entry, "cannot be combined with percent; expected one or the other");
    const double share = section.number(*percent, {1e-6, 99}) / 100;
    const double own = own_value();
    if (own == 0) section.refuse(*percent, "is a percentage of zero; expected from and to");
    return {key, std::min(own * (1 - share), own * (1 + share)),
            std::max(own * (1 - share), own * (1 + share))};
  }
  const Accepted accepted{key.accepted.lower, key.accepted.upper, key.unit};
  const double from = section.number("from", accepted), to = section.number("to", accepted);
  if (!(from < to))
    section.refuse(*section.find("to"), "is not above from; expected a rising range");
  return {key, from, to};
}

ProveTable::Parameter read_parameter(const Section& section, const Vehicle& vehicle) {
  section.allow_only({"key", "from", "to", "percent"});
  const Key key = parameter_key(section);
  return read_range(section, key, [&] { return own_number(section, vehicle, key); });
}

// A parameter of the model, or what some condition fixes.
ProveTable::Parameter read_user_parameter(const Section& section, const UserModel& own,
                                          const std::vector<Condition>& conditions) {
  section.allow_only({"key", "from", "to", "percent"});
  const auto fixed = [&](const Condition& condition, const std::string& name) {
    const auto value = condition.user()->values.find(name);
    return value != condition.user()->values.end() && value->second.lower == value->second.upper;
  };
  std::vector<Key> keys;
  for (const Key& key : own.keys)
    if (find(own.model.parameters, key.signal) >= 0 ||
        std::ranges::any_of(conditions, [&](const auto& c) { return fixed(c, key.signal); }))
      keys.push_back(key);
  if (keys.empty())
    section.refuse("key", "the model has no parameters, and no condition fixes a variable");
  std::vector<std::string> names;
  for (const Key& key : keys) names.push_back(key.name);
  section.require("key", "a parameter of the model or a variable that a condition fixes");
  const Key key = keys[section.choice("key", names)];
  return read_range(section, key, [&] {
    const Eigen::Index at = find(own.model.parameters, key.signal);
    if (at < 0)
      section.refuse(
          *section.find("percent"),
          fmt::format("applies only to parameters of the model; expected from and to for {}",
                      key.name));
    return own.parameters[at];
  });
}

// [prove], with a reader of one [[prove.parameter]].
template <class Read>
ProveTable read_table(const Section& section, const Read& read_one) {
  section.allow_only({"parameter", "margin", "damping", "boxes", "undecided"});
  ProveTable table;
  read_number(section, "margin", {0, 1e3, "1/s"}, table.margin);
  read_number(section, "damping", {0, most_damping}, table.damping);
  read_whole(section, "boxes", {1, 1e8}, table.boxes);
  read_number(section, "undecided", {0, 1}, table.undecided);
  for (const Section& parameter : section.tables("parameter")) {
    table.parameters.push_back(read_one(parameter));
    const auto same = [&](const ProveTable::Parameter& other) {
      const Key &one = table.parameters.back().key, &two = other.key;
      const bool same_signal = !one.signal.empty() && one.signal == two.signal;
      return &other != &table.parameters.back() && (one.name == two.name || same_signal);
    };
    if (std::ranges::any_of(table.parameters, same))
      parameter.refuse(*parameter.find("key"), "occurs twice");
    if (double(table.parameters.size()) > most_parameters)
      parameter.refuse(*parameter.find("key"), "is the seventh parameter; expected at most 6");
  }
  if (table.parameters.empty())
    section.refuse("parameter", "is missing; expected [[prove.parameter]] with key, from and to");
  return table;
}

}  // namespace

ProveTable read_prove(const Section& section, const Vehicle& vehicle) {
  return read_table(section, [&](const Section& s) { return read_parameter(s, vehicle); });
}

ProveTable read_user_prove(const Section& section, const UserModel& own,
                           const std::vector<Condition>& conditions) {
  return read_table(section,
                    [&](const Section& s) { return read_user_parameter(s, own, conditions); });
}

}  // namespace tiltrim::reading
