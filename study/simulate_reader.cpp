#include "study/simulate_reader.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <limits>

#include "study/tune_reader.hpp"
#include "vehicles/tiltrotor/along.hpp"

namespace tiltrim::reading {

namespace {

constexpr double longest = 1e5;            // s
constexpr double shortest = 1e-4;          // s, between two changes; for a table over height, m
constexpr double most_samples = 2e6;       // about 300 MB
constexpr std::size_t most_places = 1000;  // of a schedule
constexpr Accepted moment{0, longest, "s"};

// A duration that is 0 or long enough to separate its ends.
void read_lasting(const Section& section, std::string_view key, double longest_one, double& value) {
  read_number(section, key, {0, longest_one, "s"}, value);
  if (value != 0 && value < shortest)
    section.refuse(*section.find(key),
                   fmt::format("{} is too short; expected 0, or at least {} s", value, shortest));
}

// ---- the schedule ----

std::vector<double> read_at(const Section& section, bool over_time) {
  const std::string_view things = over_time ? "times" : "heights";
  const Entry& list = section.require("at", over_time ? "[0, 10, ...], ascending times in s"
                                                      : "[0, 60, ...], ascending heights in m");
  const std::vector<double> at =
      section.rising(list, over_time ? moment : Accepted{-largest, largest, "m"}, things);
  if (at.size() > most_places)
    section.refuse(list,
                   fmt::format("has {} {}; expected at most {}", at.size(), things, most_places));
  for (std::size_t i = 1; i < at.size(); ++i)
    if (at[i] - at[i - 1] < shortest)
      section.refuse(list, fmt::format("{} after {} is too close; expected {} at least {} apart",
                                       at[i], at[i - 1], things, shortest));
  return at;
}

// One value for each place of the schedule, in SI; empty if the corridor supplies it.
std::vector<double> read_commands(const Section& section, const char* name,
                                  const ScheduleTable& schedule) {
  const char* things = schedule.over_time ? "times" : "heights";
  if (schedule.over_time)
    section.require(name, "a list with a number for each of `at`; over time it has no default");
  const Entry* list = section.find(name);
  if (!list) return {};
  const Key key = study_key(name);
  std::vector<double> values = section.numbers(*list, accepted_by(key));
  if (values.size() != schedule.at.size())
    section.refuse(*list, fmt::format("{} values for {} {}; expected one for each", values.size(),
                                      schedule.at.size(), things));
  for (double& value : values) value = key.in_si(value);
  return values;
}

ScheduleTable read_table(const Section& section) {
  section.allow_only({"over", "at", "V", "gamma_deg", "eta_deg"});
  ScheduleTable schedule{ScheduleTable::Kind::table};
  section.require("over", "\"height\" or \"time\"");
  schedule.over_time = section.choice("over", {"height", "time"}) == 1;
  schedule.at = read_at(section, schedule.over_time);
  schedule.V = read_commands(section, "V", schedule);
  schedule.gamma = read_commands(section, "gamma_deg", schedule);
  schedule.eta = read_commands(section, "eta_deg", schedule);
  if (schedule.V.empty() && schedule.gamma.empty() && schedule.eta.empty())
    section.refuse("V",
                   "is missing, and so are gamma_deg and eta_deg; expected one of them, or "
                   "schedule = \"corridor\"");
  return schedule;
}

ScheduleTable read_schedule(const Section& section) {
  const Entry* entry = section.find("schedule");
  if (!entry) return {};
  if (entry->kind == Entry::Kind::table) return read_table(*section.table("schedule"));
  if (entry->kind != Entry::Kind::text)
    section.refuse(*entry, fmt::format("{} is not a schedule; expected \"corridor\", \"hold\", "
                                       "\"reconversion\" or a table [simulate.schedule]",
                                       described(*entry)));
  const std::vector<std::string> kinds{"corridor", "hold", "reconversion"};
  return {static_cast<ScheduleTable::Kind>(section.choice("schedule", kinds))};
}

// ---- the start ----

bool holds(const SimulateTable& simulate) {
  return simulate.schedule.kind == ScheduleTable::Kind::hold;
}

// The condition whose command comes first, if there is one.
const Condition* start_of(const SimulateTable& simulate, const std::vector<Condition>& conditions) {
  const auto at = std::ranges::find(conditions, simulate.start, &Condition::name);
  if (at != conditions.end()) return &*at;
  return holds(simulate) ? &conditions.front() : nullptr;
}

void check_condition(const Section& section, const Entry& entry, const Condition& condition) {
  if (!condition.command())
    section.refuse(
        entry,
        fmt::format("the condition {} has no control law; expected one of formulation closed_loop",
                    in_quotes(condition.name)));
}

// "ground", "trim" or a condition's name; empty if not given.
std::string read_start(const Section& section, const std::vector<Condition>& conditions) {
  const Entry* entry = section.find("start");
  if (!entry) return {};
  std::vector<std::string> names{"ground", "trim"};
  for (const Condition& condition : conditions) names.push_back(condition.name);
  const std::size_t words = 2, chosen = section.choice("start", names);
  if (chosen >= words)
    check_condition(section, *entry, conditions[chosen - words]);
  else if (std::ranges::count(names, names[chosen]) > 1)
    section.refuse(
        *entry,
        fmt::format(
            "{} is also the name of a condition; expected that condition to have another name",
            in_quotes(names[chosen])));
  return names[chosen];
}

double read_height(const Section& section, const SimulateTable& simulate) {
  const bool back = simulate.schedule.kind == ScheduleTable::Kind::reconversion;
  if (back && from_ground(simulate))
    section.refuse(*section.find("start"),
                   "a reconversion starts in the air; expected \"trim\" or a condition");
  double start = back ? corridor_top : 0.0;
  read_number(section, "height", height, start);
  if (from_ground(simulate) && start != 0)
    section.refuse(*section.find("height"),
                   fmt::format("{} m is not the ground; expected 0, or start = \"trim\"", start));
  return start;
}

std::map<std::string, double> read_states(const Section& section, bool on_ground) {
  section.allow_only(
      {"V", "gamma_deg", "theta_deg", "q", "energy_integral", "distribution_integral"});
  if (on_ground)
    for (const char* key : {"V", "gamma_deg"})
      if (const Entry* entry = section.find(key))
        section.refuse(*entry,
                       "on the ground the aircraft is at rest; expected start = \"trim\" or a "
                       "condition");
  std::map<std::string, double> states;
  const auto state = [&](const char* key, const char* name, const Accepted& accepted) {
    if (section.find(key)) states[name] = section.number(key, accepted);
  };
  constexpr Accepted integral{-largest, largest, "s"};
  state("V", "V", speed);
  state("gamma_deg", "gamma", any_angle);
  state("theta_deg", "theta", any_angle);
  state("q", "q", {-1000, 1000, "rad/s"});
  state("energy_integral", "energy_integral", integral);
  state("distribution_integral", "distribution_integral", integral);
  return states;
}

// Wind axes divide by V.
void check_wind_axes(const Section& section, const SimulateTable& simulate,
                     const std::vector<Condition>& conditions) {
  if (simulate.axes != Axes::wind) return;
  const Entry& axes = *section.find("axes");
  if (from_ground(simulate))
    section.refuse(axes,
                   "wind axes divide by V, which is 0 on the ground; expected \"body\", or "
                   "start = \"trim\"");
  std::vector<double> speeds = simulate.schedule.V;
  const Condition* start = start_of(simulate, conditions);
  const auto V = simulate.states.find("V");
  const bool given = V != simulate.states.end();
  if (given) speeds.push_back(V->second);
  if (start && (!given || holds(simulate))) speeds.push_back(start->command()->V);
  for (const double slow : speeds)
    if (slow < body_axes_below)
      section.refuse(axes, fmt::format("wind axes divide by V, which decreases to {} m/s; expected "
                                       "\"body\", or V of at least {} m/s",
                                       slow, body_axes_below));
}

// ---- actuators and anti-windup ----

void read_rates(const Section& section, ActuatorRates& rates) {
  constexpr double least = 1e-6;
  constexpr Accepted turning{least, largest, "degrees/s"};
  section.allow_only({"theta0", "a1s_deg", "delta_e_deg", "eta_deg"});
  read_number(section, "theta0", {least, largest, "1/s"}, rates.theta0);
  read_number(section, "a1s_deg", turning, rates.a1s);
  read_number(section, "delta_e_deg", turning, rates.delta_e);
  read_number(section, "eta_deg", turning, rates.eta);
}

void read_law(const Section& section, SimulateTable& simulate) {
  simulate.hand_over =
      static_cast<HandOver>(section.choice("hand_over", {"as_printed", "bumpless"}));
  read_lasting(section, "anti_windup", largest, simulate.anti_windup);
  if (simulate.anti_windup == 0) simulate.anti_windup = std::numeric_limits<double>::infinity();
  if (const auto rates = section.table("rates")) read_rates(*rates, simulate.rates);
  read_number(section, "lag", {shortest, 1000, "s"}, simulate.lag);
}

// ---- disturbances ----

// A time of the motion, before its end.
void read_time(const Section& section, double duration, double& at) {
  read_number(section, "at", moment, at);
  if (section.find("at") && at >= duration)
    section.refuse(
        *section.find("at"),
        fmt::format("{} s is not before the end of the motion, {} s (duration); expected "
                    "an earlier time, or a longer duration",
                    at, duration));
}

DisturbanceTable read_disturbance(const Section& section, double end) {
  section.allow_only({"kind", "on", "at", "size", "duration"});
  struct On {
    const char* signal;
    Accepted accepted;
  };
  constexpr std::array sizes{On{"V", {-1000, 1000, "m/s"}}, On{"gamma", any_angle},
                             On{"theta0", {-10, 10}}, On{"a1s", {-90, 90, "degrees"}},
                             On{"delta_e", {-90, 90, "degrees"}}};
  DisturbanceTable disturbance;
  section.require("kind", "\"step\" or \"doublet\"");
  disturbance.kind =
      static_cast<DisturbanceTable::Kind>(section.choice("kind", {"step", "doublet"}));
  section.require("on", "the disturbed quantity in quotes, as \"V\" or \"delta_e_deg\"");
  const On& on =
      sizes[section.choice("on", {"V", "gamma_deg", "theta0", "a1s_deg", "delta_e_deg"})];
  disturbance.on = on.signal;
  disturbance.size = section.number("size", on.accepted);
  read_time(section, end, disturbance.at);
  read_lasting(section, "duration", longest, disturbance.duration);
  if (disturbance.kind == DisturbanceTable::Kind::doublet && disturbance.duration == 0)
    section.refuse("duration", "a doublet needs one; expected a number above 0 s");
  return disturbance;
}

std::vector<std::string> gust_keys(GustTable::Kind kind) {
  switch (kind) {
    case GustTable::Kind::steady:
      break;
    case GustTable::Kind::one_minus_cosine:
      return {"kind", "direction", "size", "at", "duration"};
    case GustTable::Kind::dryden:
      return {"kind", "direction", "size", "length", "speed", "seed"};
  }
  return {"kind", "direction", "size"};
}

GustTable read_gust(const Section& section, double end) {
  GustTable gust;
  section.allow_only({"kind", "direction", "size", "at", "duration", "length", "speed", "seed"});
  section.require("kind", "\"steady\", \"one_minus_cosine\" or \"dryden\"");
  gust.kind = static_cast<GustTable::Kind>(
      section.choice("kind", {"steady", "one_minus_cosine", "dryden"}));
  const std::string cosine = "it is a key of kind one_minus_cosine",
                    dryden = "it is a key of kind dryden";
  section.allow_only(gust_keys(gust.kind), {{"at", cosine},
                                            {"duration", cosine},
                                            {"length", dryden},
                                            {"speed", dryden},
                                            {"seed", dryden}});
  gust.up = section.choice("direction", {"forward", "up"}) == 1;
  gust.size = section.number("size", gust.kind == GustTable::Kind::dryden ? turbulence : wind);
  read_time(section, end, gust.at);
  read_number(section, "duration", {shortest, longest, "s"}, gust.duration);
  read_number(section, "length", {1, largest, "m"}, gust.length);
  read_number(section, "speed", {body_axes_below, 1000, "m/s"}, gust.speed);
  read_whole(section, "seed", {0, most_seeds}, gust.seed);
  return gust;
}

// ---- integration ----

template <class Table>
void read_sampling(const Section& section, Table& simulate) {
  read_number(section, "tolerance", {1e-13, 1e-3}, simulate.tolerance);
  simulate.sample = std::min(simulate.sample, simulate.duration);
  read_number(section, "sample", {shortest, simulate.duration, "s"}, simulate.sample);
  if (simulate.duration / simulate.sample > most_samples)
    section.refuse(
        *section.find("sample"),
        fmt::format("{} s of {} s are {:.3g} samples; expected at most {:.0f}", simulate.sample,
                    simulate.duration, simulate.duration / simulate.sample, most_samples));
}

// ---- user-defined model ----

std::vector<std::string> names_of(const std::vector<Key>& keys) {
  std::vector<std::string> all;
  for (const Key& key : keys) all.push_back(key.name);
  return all;
}

// Offsets of states by name, added to the trim.
std::map<std::string, double> read_offset(const Section& section, const UserModel& own) {
  std::vector<Key> keys = own.keys;
  std::erase_if(keys, [&](const Key& key) { return find(own.model.states, key.signal) < 0; });
  section.allow_only(names_of(keys));
  std::map<std::string, double> offset;
  for (const Key& key : keys)
    if (section.find(key.name)) offset[key.signal] = section.number(key.name, accepted_by(key));
  return offset;
}

UserMotion::Change read_change(const Section& section, const UserModel& own, double end) {
  section.allow_only({"kind", "on", "at", "size", "duration"});
  std::vector<Key> keys = own.keys;
  std::erase_if(keys, [&](const Key& key) { return find(own.model.states, key.signal) >= 0; });
  section.require("kind", "\"step\" or \"doublet\"");
  section.require("on", "an input or a parameter of the model in quotes");
  if (keys.empty())
    section.refuse(*section.find("on"), "the model has neither inputs nor parameters");
  UserMotion::Change change;
  change.doublet = section.choice("kind", {"step", "doublet"}) == 1;
  const Key& key = keys[section.choice("on", names_of(keys))];
  change.signal = key.signal;
  change.size = section.number("size", accepted_by(key));
  read_time(section, end, change.at);
  read_lasting(section, "duration", longest, change.duration);
  if (change.doublet && change.duration == 0)
    section.refuse("duration", "a doublet needs one; expected a number above 0 s");
  return change;
}

}  // namespace

SimulateTable read_simulate(const Section& section, const std::vector<Condition>& conditions) {
  section.allow_only({"schedule", "duration", "start", "height", "axes", "hand_over", "anti_windup",
                      "lag", "tolerance", "sample", "states", "rates", "disturbance", "gust"});
  SimulateTable simulate;
  simulate.schedule = read_schedule(section);
  read_number(section, "duration", {shortest, longest, "s"}, simulate.duration);
  simulate.start = read_start(section, conditions);
  if (holds(simulate))
    check_condition(section, *section.find("schedule"), *start_of(simulate, conditions));
  simulate.height = read_height(section, simulate);
  simulate.axes = section.choice("axes", {"body", "wind"}) == 0 ? Axes::body : Axes::wind;
  if (const auto states = section.table("states"))
    simulate.states = read_states(*states, from_ground(simulate));
  check_wind_axes(section, simulate, conditions);
  read_law(section, simulate);
  for (const Section& disturbance : section.tables("disturbance"))
    simulate.disturbances.push_back(read_disturbance(disturbance, simulate.duration));
  for (const Section& gust : section.tables("gust"))
    simulate.gusts.push_back(read_gust(gust, simulate.duration));
  read_sampling(section, simulate);
  return simulate;
}

UserMotion read_user_motion(const Section& section, const UserModel& own,
                            const std::vector<Condition>& conditions) {
  section.allow_only({"start", "duration", "tolerance", "sample", "offset", "disturbance"});
  UserMotion motion;
  std::vector<std::string> starts;
  for (const Condition& condition : conditions) starts.push_back(condition.name);
  motion.start = starts[section.choice("start", starts)];
  read_number(section, "duration", {shortest, longest, "s"}, motion.duration);
  if (const auto offset = section.table("offset")) motion.offset = read_offset(*offset, own);
  for (const Section& change : section.tables("disturbance"))
    motion.changes.push_back(read_change(change, own, motion.duration));
  read_sampling(section, motion);
  return motion;
}

}  // namespace tiltrim::reading
