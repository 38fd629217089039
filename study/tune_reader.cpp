#include "study/tune_reader.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "model/lookup.hpp"
#include "study/requirement_reader.hpp"
#include "study/tune_places_reader.hpp"
#include "vehicles/tiltrotor/numbers.hpp"

namespace tiltrim::reading {

namespace {

using std::filesystem::path;

constexpr std::size_t most_with_corners = 12;  // uncertain numbers: 4096 corners

void read_name(const Section& section, const char* key, const std::vector<std::string>& names,
               std::string& value) {
  if (section.find(key)) value = names[section.choice(key, names)];
}

// ---- free and uncertain variables ----

// A parameter of the vehicle: variables of a condition differ between operating points.
Key tuned_key(const Section& section, const Tuned& tuned) {
  section.require("key", tuned.tiltrotor
                             ? "a number in quotes, as \"gains.K_Lp\" or \"aircraft.mass\""
                             : "the name of a parameter in quotes");
  const std::string name = section.text("key");
  const auto at = std::ranges::find(tuned.keys, name, &Key::name);
  if (at != tuned.keys.end()) return *at;
  try {
    (void)key_among(tuned.tiltrotor ? study_keys() : tuned.keys, name);
  } catch (const std::invalid_argument& e) {
    section.refuse(*section.find("key"), fmt::format("{}; {}", e.what(), tuned.expected));
  }
  section.refuse(*section.find("key"),
                 fmt::format("{} belongs to the conditions, and each operating point has its own; "
                             "{}",
                             name, tuned.expected));
}

// Range from `from` to `to`, in SI.
Range read_ends(const Section& section, const Key& key) {
  const Range ends{section.number("from", accepted_by(key)),
                   section.number("to", accepted_by(key))};
  if (!(ends.lower < ends.upper))
    section.refuse(*section.find("to"),
                   fmt::format("{} is not above `from`, {}; expected `from` below `to`",
                               section.find("to")->number, section.find("from")->number));
  return ends;
}

void check_new(const Section& section, const Key& key, const auto& earlier) {
  for (const auto& other : earlier)
    if (other.name == key.signal)
      section.refuse(*section.find("key"),
                     fmt::format("{} is given twice; expected each number once", key.name));
}

FreeGain read_gain(const Section& section, const Tuned& tuned,
                   const std::vector<FreeGain>& earlier) {
  section.allow_only({"key", "from", "to", "spacing"});
  const Key key = tuned_key(section, tuned);
  check_new(section, key, earlier);
  const Range ends = read_ends(section, key);
  const bool logarithmic = section.choice("spacing", {"log", "linear"}) == 0;
  if (logarithmic && !(ends.lower > 0))
    section.refuse(
        *section.find("from"),
        fmt::format("{} has no logarithm; expected a positive number, or spacing = \"linear\"",
                    section.find("from")->number));
  return {key.signal, ends.lower, ends.upper, logarithmic};
}

// Range of `percent` about the study's value, in SI.
Range read_percent(const Section& section, const Key& key,
                   const std::function<double(const std::string& name)>& own_value) {
  for (const char* other : {"from", "to"})
    if (const Entry* entry = section.find(other))
      section.refuse(*entry, "cannot be combined with percent; expected one or the other");
  const Entry& entry = *section.find("percent");
  const double percent = section.number(entry, {0, 1000, "percent"});
  const double own = own_value(key.signal), reach = std::abs(own) * percent / 100;
  if (own == 0)
    section.refuse(
        entry,
        fmt::format("{} is 0, so a percentage of it is 0 too; expected from and to", key.name));
  const Range ends{own - reach, own + reach};
  if (!(ends.lower < ends.upper))
    section.refuse(entry, fmt::format("{} changes nothing; expected a number above 0 percent",
                                      describe(entry)));
  for (const double end : {key.in_study(ends.lower), key.in_study(ends.upper)})
    if (!(end >= key.accepted.lower && end <= key.accepted.upper))
      section.refuse(entry,
                     fmt::format("{} of {} = {} reaches {}, which is out of range; expected {}",
                                 describe(entry), key.name, key.in_study(own), end,
                                 describe(accepted_by(key))));
  return ends;
}

Uncertain read_uncertain(const Section& section, const TuneTable& tune, const Tuned& tuned) {
  section.allow_only({"key", "percent", "from", "to"});
  const Key key = tuned_key(section, tuned);
  check_new(section, key, tune.uncertain);
  if (std::ranges::find(tune.gains, key.signal, &FreeGain::name) != tune.gains.end())
    section.refuse(
        *section.find("key"),
        fmt::format("{} is free in [[tune.gain]]; expected a number that is not tuned", key.name));
  const Range ends = read_reach(section, key, tuned.own);
  return {key.signal, ends.lower, ends.upper};
}

// The range over which a variable is varied.
Range reach_of(const std::string& name, const TuneTable& tune, const Tuned& tuned) {
  for (const FreeGain& gain : tune.gains)
    if (gain.name == name) return {gain.lower, gain.upper};
  for (const Uncertain& number : tune.uncertain)
    if (number.name == name) return {number.lower, number.upper};
  const double own = tuned.own(name);
  return {own, own};
}

// Refuses at the first of the names that is varied.
[[noreturn]] void refuse_divisor(const Section& section, const std::vector<std::string>& lists,
                                 const std::vector<std::string>& names, std::string_view divisor) {
  for (const std::string& list : lists)
    for (const Section& moved : section.tables(list))
      if (std::ranges::find(names, moved.text("key")) != names.end())
        moved.refuse(
            *moved.find("key"),
            fmt::format(
                "makes {} zero somewhere in its range; expected a range on one side of that",
                divisor));
  section.refuse(lists.front(), fmt::format("makes {} zero", divisor));
}

void read_numbers(const Section& section, const Tuned& tuned, TuneTable& tune) {
  section.require("gain", "at least one [[tune.gain]] table");
  for (const Section& gain : section.tables("gain"))
    tune.gains.push_back(read_gain(gain, tuned, tune.gains));
  for (const Section& number : section.tables("uncertain"))
    tune.uncertain.push_back(read_uncertain(number, tune, tuned));
  if (tuned.tiltrotor)
    check_divisors(section, {"gain", "uncertain"},
                   [&](const std::string& name) { return reach_of(name, tune, tuned); });
  tune.corners = section.choice("corners", {"all", "none"}) == 0;
  if (tune.corners && tune.uncertain.size() > most_with_corners)
    section.refuse(*section.find("uncertain"),
                   fmt::format("{} numbers have 2^{} corners; expected at most {} with {} corners, "
                               "or corners = \"none\"",
                               tune.uncertain.size(), tune.uncertain.size(), most_with_corners,
                               1 << most_with_corners));
  read_whole(section, "samples", {0, 1000}, tune.samples);
}

void read_disturbance(const Section& section, const std::vector<Key>& keys,
                      std::map<std::string, double>& disturbance) {
  std::vector<std::string> allowed;
  for (const Key& key : keys) allowed.push_back(key.name);
  section.allow_only(allowed);
  for (const Key& key : keys) {
    const Entry* const entry = section.find(key.name);
    if (!entry) continue;
    if (!disturbance.emplace(key.signal, section.number(key.name, accepted_by(key))).second)
      section.refuse(*entry, fmt::format("{} is given twice; expected each number once", key.name));
  }
}

// ---- search options ----

void read_search(const Section& section, TuneTable& tune) {
  std::vector<std::string> searches{"crs2", "isres", "esch", "direct", "mlsl", "multistart"};
  read_name(section, "global", searches, tune.global);
  read_name(section, "local", {"bfgs", "slsqp", "mma", "bobyqa", "cobyla", "sbplx"}, tune.local);
  searches.emplace_back("none");
  read_name(section, "second", searches, tune.second);
  read_whole(section, "seed", {0, most_seeds}, tune.seed);
  read_whole(section, "evaluations", {0, 1e9}, tune.evaluations);
  if (section.find("seconds")) tune.seconds = section.number("seconds", {0, 1e6, "s"});
  read_whole(section, "robustness", {0, 1e7}, tune.robustness);
  if (const Entry* efforts = section.find("regulator_starts"))
    tune.regulator_starts = section.numbers(*efforts, {1e-12, 1e12});
  if (const Entry* decays = section.find("placed_starts"))
    tune.placed_starts = section.numbers(*decays, {1e-12, 1e12, "1/s"});
}

// Free variables, disturbance, requirements and search options.
void read_rest(const Section& section, const path& file, const Tuned& tuned, TuneTable& tune) {
  read_numbers(section, tuned, tune);
  if (const auto start = section.table("disturbance"))
    read_disturbance(*start, tuned.disturbed, tune.disturbance);
  read_goals(section, file, tuned, tune);
  for (const Section& limit : section.tables("limit"))
    tune.limits.push_back(read_limit(limit, tuned, tune));
  if (const auto front = section.table("front")) tune.front = read_front(*front, tuned, tune);
  read_search(section, tune);
}

// Parameters of the aircraft and gains.
std::vector<Key> vehicle_keys() {
  std::vector<Key> keys = study_keys();
  std::erase_if(keys, [](const Key& key) { return key.name.find('.') == std::string::npos; });
  return keys;
}

// Where a disturbance can enter.
std::vector<std::string> with_parameters(const Model& model) {
  std::vector<std::string> all = names(model.inputs);
  for (const Signal& parameter : model.parameters) all.push_back(parameter.name);
  return all;
}

// The keys of the model's signals among these.
std::vector<Key> keys_in(const UserModel& own, const Signals& signals) {
  std::vector<Key> keys = own.keys;
  std::erase_if(keys, [&](const Key& key) { return find(signals, key.signal) < 0; });
  return keys;
}

}  // namespace

double own_value(Vehicle vehicle, const std::string& name) {
  const auto gain = find(gain_signals(), name);
  return gain >= 0 ? gain_value(vehicle.gains, std::size_t(gain))
                   : aircraft_value(vehicle.aircraft,
                                    std::size_t(index_of(aircraft_signals(), name, "number")));
}

Range read_reach(const Section& section, const Key& key,
                 const std::function<double(const std::string& name)>& own) {
  if (!section.find("percent") && !section.find("from") && !section.find("to"))
    section.refuse("percent", "is missing; expected percent, or from and to");
  return section.find("percent") ? read_percent(section, key, own) : read_ends(section, key);
}

// The divisors of the control law (13), as in [gains].
void check_divisors(const Section& section, const std::vector<std::string>& lists,
                    const std::function<Range(const std::string& name)>& reach) {
  const Range K_Lp = reach("gains.K_Lp"), K_Ep = reach("gains.K_Ep"),
              Ep = reach("aircraft.thrust_excess");
  if (K_Lp.lower <= -1 && K_Lp.upper >= -1)
    refuse_divisor(section, lists, {"gains.K_Lp"}, "1 + K_Lp");
  const auto [least, most] = std::minmax(
      {Ep.lower * K_Ep.lower, Ep.lower * K_Ep.upper, Ep.upper * K_Ep.lower, Ep.upper * K_Ep.upper});
  if (least <= -1 && most >= -1)
    refuse_divisor(section, lists, {"gains.K_Ep", "aircraft.thrust_excess"},
                   "1 + thrust_excess K_Ep");
}

TuneTable read_tune(const Section& section, const path& file, const Vehicle& vehicle,
                    const std::vector<Condition>& conditions) {
  section.allow_only({"conditions",
                      "corridor",
                      "schedule_eta_deg",
                      "goal",
                      "corners",
                      "samples",
                      "global",
                      "local",
                      "second",
                      "seed",
                      "evaluations",
                      "seconds",
                      "robustness",
                      "regulator_starts",
                      "placed_starts",
                      "disturbance",
                      "gain",
                      "uncertain",
                      "limit",
                      "front"});
  TuneTable tune;
  tune.conditions = read_places(section, conditions);
  tune.heights = read_heights(section, file);
  tune.schedule = read_schedule_tilts(section);
  const Range any{-largest, largest}, turn{any_angle.lower, any_angle.upper};
  const Tuned tuned{vehicle_keys(),
                    "expected an aircraft.* or gains.* number",
                    [&](const std::string& name) { return own_value(vehicle, name); },
                    {{"V", "V", "m/s", any},
                     {"gamma_deg", "gamma", "degrees", turn},
                     {"theta_deg", "theta", "degrees", turn},
                     {"q_deg", "q", "degrees/s", any}},
                    {"theta0", "a1s", "delta_e"},
                    measures_with({"flight", "tracking"}),
                    true,
                    {"V_added", "gamma_added", "theta0_added", "a1s_added", "delta_e_added"},
                    {"theta0", "a1s", "delta_e", "airspeed", "flight_path", "alpha"},
                    {"theta", "q", "energy_integral", "distribution_integral"}};
  read_rest(section, file, tuned, tune);
  return tune;
}

TuneTable read_user_tune(const Section& section, const path& file, const UserModel& own,
                         const std::vector<Condition>& conditions,
                         const std::vector<std::string>& figures) {
  section.allow_only({"conditions", "goal", "corners", "samples", "global", "local", "second",
                      "seed", "evaluations", "seconds", "robustness", "regulator_starts",
                      "placed_starts", "disturbance", "gain", "uncertain", "limit", "front"});
  TuneTable tune;
  tune.conditions = read_places(section, conditions);
  const Signals& parameters = own.model.parameters;
  Tuned tuned{keys_in(own, parameters),
              "expected a parameter of the model",
              [&](const std::string& name) {
                return own.parameters[index_of(parameters, name, "parameter")];
              },
              keys_in(own, own.model.states),
              {},
              measures_with(figures),
              false,
              with_parameters(own.model),
              names(own.model.outputs),
              names(own.model.states)};
  for (const UserModel::Loop& loop : own.loops) tuned.actuators.push_back(loop.name);
  read_rest(section, file, tuned, tune);
  return tune;
}

}  // namespace tiltrim::reading
