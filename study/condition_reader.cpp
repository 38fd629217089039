#include "study/condition_reader.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <set>
#include <span>

#include "study/model_reader.hpp"
#include "study/section.hpp"
#include "vehicles/tiltrotor/along.hpp"
#include "vehicles/tiltrotor/table_trim.hpp"

namespace tiltrim::reading {

struct Quantity {
  const char* key;
  const char* signal;
  Accepted accepted;
  Range free = {};  // the range of "free": unbounded, the vehicle's limits apply
};

constexpr Accepted tilt{-10, 100, "degrees"};
constexpr Accepted deflection{-90, 90, "degrees"};
constexpr Accepted pure{-largest, largest, ""};

constexpr std::array closed_loop_quantities{
    Quantity{"V", "V", speed},
    Quantity{"gamma_deg", "gamma", any_angle},
    Quantity{"eta_deg", "eta", tilt},
};
constexpr std::array airframe_quantities{
    Quantity{"V", "V", speed, {0, Range{}.upper}},
    Quantity{"gamma_deg", "gamma", any_angle},
    Quantity{"alpha_deg", "alpha", any_angle},
    Quantity{"theta_deg", "theta", any_angle},
    Quantity{"q", "q", {-1000, 1000, "rad/s"}},
    Quantity{"eta_deg", "eta", tilt, {in_si(tilt.lower, tilt.unit), in_si(tilt.upper, tilt.unit)}},
    Quantity{"theta0", "theta0", {-10, 10}},
    Quantity{"a1s_deg", "a1s", deflection},
    Quantity{"delta_e_deg", "delta_e", deflection},
};
constexpr std::array rate_quantities{
    Quantity{"V_dot", "V", {-largest, largest, "m/s²"}},
    Quantity{"gamma_dot", "gamma", {-1000, 1000, "rad/s"}},
    Quantity{"theta_dot", "theta", {-1000, 1000, "rad/s"}},
    Quantity{"q_dot", "q", {-largest, largest, "rad/s²"}},
};
struct Coefficient {
  const char* key;
  double TableCondition::*value;
  Accepted accepted;
};
constexpr std::array table_quantities{
    Coefficient{"gamma_deg", &TableCondition::gamma, any_angle},
    Coefficient{"alpha_deg", &TableCondition::alpha, any_angle},
    Coefficient{"eta_deg", &TableCondition::eta, tilt},
    Coefficient{"CL", &TableCondition::CL, pure},
    Coefficient{"CD", &TableCondition::CD, pure},
    Coefficient{"CM", &TableCondition::CM, pure},
    Coefficient{"k", &TableCondition::k, {0, largest}},
};

// Formulations of a tiltrotor condition; the first is the default.
const std::vector<std::string> formulations{"closed_loop", "airframe", "table"};

std::vector<Key> condition_keys() {
  std::vector<Key> keys;
  for (const auto& [key, signal, accepted, free] : airframe_quantities)
    if (std::string_view(signal) != "alpha")  // an output of both models
      keys.push_back({key, signal, std::string(accepted.unit), {accepted.lower, accepted.upper}});
  return keys;
}

static void append_keys(std::vector<std::string>& keys, const auto& quantities) {
  for (const auto& quantity : quantities) keys.emplace_back(quantity.key);
}

static std::vector<std::string> keys_of(const std::string& formulation) {
  std::vector<std::string> keys{"name", "formulation"};
  if (formulation == "closed_loop") append_keys(keys, closed_loop_quantities);
  if (formulation == "table") append_keys(keys, table_quantities);
  if (formulation == "airframe") {
    append_keys(keys, airframe_quantities);
    append_keys(keys, rate_quantities);
    keys.emplace_back("objective");
  }
  return keys;
}

// Hints for keys that belong to another formulation.
static std::map<std::string, std::string> keys_of_others() {
  std::map<std::string, std::string> others;
  for (const std::string& formulation : formulations)
    for (const std::string& key : keys_of(formulation)) {
      std::string& where = others[key];
      where += (where.empty() ? "it is a key of formulation " : " and ") + formulation;
    }
  return others;
}

static bool fixed(const Range& range) { return range.lower == range.upper; }

// The printed equations are in wind axes, which divide by V.
static void check_speed(const Section& section, const Range& V, Equations equations) {
  if (equations == Equations::printed && V.lower < body_axes_below)
    section.refuse(*section.find("V"),
                   fmt::format("extends below {} m/s, where the printed equations divide by a "
                               "vanishing V; expected V of at least {} m/s",
                               body_axes_below, body_axes_below));
}

static Command read_closed_loop(const Section& section, Equations equations) {
  Command command;
  command.V = section.number("V", speed);
  command.gamma = section.number("gamma_deg", any_angle);
  command.eta = section.number("eta_deg", tilt);
  check_speed(section, {command.V, command.V}, equations);
  return command;
}

static TableCondition read_coefficients(const Section& section) {
  TableCondition coefficients{};
  for (const auto& [key, value, accepted] : table_quantities)
    coefficients.*value = section.number(key, accepted);
  return coefficients;
}

// A number fixes, [lower, upper] bounds, "free" leaves free.
static Range read_value(const Section& section, const Entry& entry, const Quantity& quantity) {
  const Accepted& accepted = quantity.accepted;
  if (entry.kind == Entry::Kind::array) return section.range(entry, accepted);
  if (entry.kind == Entry::Kind::text && entry.text == "free") return quantity.free;
  if (entry.kind == Entry::Kind::number) {
    const double value = section.number(entry, accepted);
    return {value, value};
  }
  section.refuse(entry, fmt::format("{} is not a value; expected {}, [lower, upper] or \"free\"",
                                    describe(entry), describe(accepted)));
}

static void check_angles(const Section& section, const AirframeCondition& condition) {
  const auto held = [&](const char* signal) {
    const auto at = condition.values.find(signal);
    return at != condition.values.end() && fixed(at->second);
  };
  const bool gamma = held("gamma") || !condition.values.contains("gamma");
  if (gamma && held("alpha") && held("theta"))
    section.refuse(*section.find("theta_deg"),
                   "alpha, theta and gamma are all fixed (gamma is 0 by default), but theta = "
                   "alpha + gamma; expected one of them omitted or free");
}

// Cost term: signals of the airframe by SI name or, in degrees, by the keys of a condition.
static CostTerm read_effort(const Section& section) {
  section.allow_only({"signal", "scale", "reference"});
  std::vector<std::string> names;
  append_keys(names, airframe_quantities);
  for (const Quantity& quantity : airframe_quantities)
    if (quantity.accepted.degrees()) names.emplace_back(quantity.signal);
  names.emplace_back("thrust");
  section.require("signal", "the name of a signal in quotes");
  const std::string& name = names[section.choice("signal", names)];
  const auto quantity = std::ranges::find(airframe_quantities, name, &Quantity::key);
  const bool degrees = quantity != airframe_quantities.end() && quantity->accepted.degrees();
  const std::string_view unit = degrees ? "degrees" : "";
  CostTerm effort{degrees ? quantity->signal : name};
  effort.scale = in_si(1.0, unit);
  if (section.find("scale")) effort.scale = section.number("scale", {1e-6, largest, unit});
  if (section.find("reference"))
    effort.reference = section.number("reference", {-largest, largest, unit});
  return effort;
}

static void read_objective(const Section& section, const std::filesystem::path& file,
                           AirframeCondition& condition) {
  const Entry* objective = section.find("objective");
  if (!objective) return;
  constexpr std::string_view expected =
      "expected an array of tables like {signal = \"theta0\", scale = 1.0, reference = 0.0}";
  if (objective->kind != Entry::Kind::array || objective->entries.empty())
    section.refuse(*objective,
                   fmt::format("{} is not an objective; {}", describe(*objective), expected));
  for (const Entry& term : objective->entries) {
    if (term.kind != Entry::Kind::table)
      refuse(file, term.place,
             fmt::format("condition.objective: {} is not a table; {}", describe(term), expected));
    condition.effort.push_back(
        read_effort(Section(file, term, "in objective", "condition.objective.")));
  }
}

static AirframeCondition read_airframe(const Section& section, const std::filesystem::path& file,
                                       Equations equations) {
  AirframeCondition condition;
  for (const char* key : {"V", "eta_deg"})
    section.require(key, "a number, [lower, upper] or \"free\"");
  for (const Quantity& quantity : airframe_quantities)
    if (const Entry* entry = section.find(quantity.key))
      condition.values[quantity.signal] = read_value(section, *entry, quantity);
  for (const Quantity& quantity : rate_quantities)
    if (section.find(quantity.key))
      condition.rates[quantity.signal] = section.number(quantity.key, quantity.accepted);
  check_angles(section, condition);
  check_speed(section, condition.values.at("V"), equations);
  if (condition.values.at("V").upper < body_axes_below)
    for (const char* key : {"V_dot", "gamma_dot"})  // body axes have neither
      if (const Entry* entry = section.find(key))
        section.refuse(
            *entry, fmt::format("needs airspeed; expected V of at least {} m/s", body_axes_below));
  read_objective(section, file, condition);
  return condition;
}

static Condition read_condition(const Entry& entry, const std::filesystem::path& file,
                                Equations equations) {
  const std::string& formulation =
      formulations[Section(file, entry, "", "condition.").choice("formulation", formulations)];
  const Section section(file, entry, fmt::format("in [[condition]] of formulation {}", formulation),
                        "condition.");
  section.allow_only(keys_of(formulation), keys_of_others());
  Condition condition;
  condition.name = section.text("name");
  if (formulation == "closed_loop") condition.asked = read_closed_loop(section, equations);
  if (formulation == "table") condition.asked = read_coefficients(section);
  if (formulation == "airframe") condition.asked = read_airframe(section, file, equations);
  return condition;
}

std::vector<Condition> read_conditions(const Entry& root, const std::filesystem::path& file,
                                       Equations equations,
                                       const std::shared_ptr<const UserModel>& own) {
  constexpr std::string_view expected = "expected at least one [[condition]] table";
  const Section top(file, root, "at the top level", "");
  const Entry* list = top.find("condition");
  if (!list) top.refuse("condition", fmt::format("none is given; {}", expected));
  if (list->kind == Entry::Kind::table)
    top.refuse(*list, "is one table; expected double brackets, [[condition]]");
  if (list->kind != Entry::Kind::array)
    top.refuse(*list, fmt::format("{} is not a list of tables; {}", describe(*list), expected));
  if (list->entries.empty()) top.refuse(*list, fmt::format("the list is empty; {}", expected));

  std::vector<Condition> conditions;
  std::set<std::string> names;
  for (const Entry& entry : list->entries) {
    if (entry.kind != Entry::Kind::table)
      refuse(file, entry.place,
             fmt::format("condition: {} is not a table; {}", describe(entry), expected));
    conditions.push_back(own ? read_user_condition(entry, file, own)
                             : read_condition(entry, file, equations));
    conditions.back().place =
        fmt::format("{}:{}:{}", file.string(), entry.place.line, entry.place.column);
    const std::string& name = conditions.back().name;
    if (!names.insert(name).second) {
      const auto key = std::ranges::find(entry.entries, "name", &Entry::key);
      refuse(file, key->place,
             fmt::format("condition.name: {} is the name of an earlier condition; expected "
                         "distinct names",
                         in_quotes(name)));
    }
  }
  return conditions;
}

}  // namespace tiltrim::reading
