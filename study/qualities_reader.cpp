#include "study/qualities_reader.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "model/lookup.hpp"

namespace tiltrim::reading {

namespace {

struct RoleKey {
  const char* key;
  std::string Roles::*role;
  bool input = false, output_only = false;
};
constexpr std::array role_keys{
    RoleKey{"pitch", &Roles::pitch},
    RoleKey{"pitch_rate", &Roles::pitch_rate},
    RoleKey{"alpha", &Roles::alpha},
    RoleKey{"downward_speed", &Roles::downward_speed},
    RoleKey{"speed", &Roles::speed},
    RoleKey{"height", &Roles::height},
    RoleKey{"normal_acceleration", &Roles::normal_acceleration, false, true},
    RoleKey{"stick", &Roles::stick, true}};

void read_roles(const Section& section, const Model* model, Roles& roles) {
  for (const RoleKey& role : role_keys) {
    const Entry* entry = section.find(role.key);
    if (!entry) continue;
    const std::string name = section.text(role.key);
    roles.*role.role = name;
    if (!model) continue;
    std::vector<std::string> known = names(role.input ? model->inputs : model->outputs);
    if (!role.input && !role.output_only)
      for (const Signal& s : model->states) known.push_back(s.name);
    if (std::ranges::find(known, name) != known.end()) continue;
    const std::string near = nearest_name(name, known);
    section.refuse(*entry, fmt::format("no {} {}{}; there are: {}",
                                       role.input         ? "input"
                                       : role.output_only ? "output"
                                                          : "state or output",
                                       in_quotes(name),
                                       near.empty() ? "" : fmt::format(" (nearest: '{}')", near),
                                       fmt::join(known, ", ")));
  }
  if (!model) return;
  for (const char* needed : {"pitch", "pitch_rate"})
    (void)section.require(needed, "the name of a state or output in quotes");
}

// The borders of the bandwidth over the phase delay.
void read_bandwidth(const Section& section, QualitiesOptions& options) {
  constexpr Accepted above_zero{0, largest};
  const Entry* delays = section.find("bandwidth_delay");
  for (const std::size_t level : {0u, 1u}) {
    const char* const key = level == 0 ? "bandwidth_level_1" : "bandwidth_level_2";
    const Entry* least = section.find(key);
    if (!least) continue;
    if (!delays) section.refuse(*least, "expected bandwidth_delay, the phase delays [s] as a list");
    if (level == 1 && options.least_bandwidth[0].empty())
      section.refuse(*least, "expected bandwidth_level_1 too");
    const std::vector<double> at = section.rising(*delays, above_zero, "phase delays");
    const std::vector<double> values = section.numbers(*least, above_zero);
    if (values.size() != at.size())
      section.refuse(*least, fmt::format("{} bandwidths for {} phase delays; expected one for each",
                                         values.size(), at.size()));
    for (std::size_t k = 0; k < at.size(); ++k)
      options.least_bandwidth[level].push_back({at[k], values[k]});
  }
}

void read_hover(const Section& section, const std::vector<Condition>& conditions,
                QualitiesTable& table) {
  if (section.find("phase"))
    table.phase = FlightRegime(section.choice("phase", {"forward", "hover"}));
  if (section.find("hover_below"))
    table.hover_below = section.number("hover_below", {0, largest, "m/s"});
  const Entry* hover = section.find("hover");
  const Entry* both = section.find("hover_below") ? section.find("hover_below") : hover;
  if (table.phase && both)
    section.refuse(*both, "phase holds for all conditions already; expected one of the two");
  if (!hover) return;
  std::vector<std::string> known;
  for (const Condition& c : conditions) known.push_back(c.name);
  if (hover->kind != Entry::Kind::array || hover->entries.empty())
    section.refuse(*hover, "expected a list of conditions, as [\"hover\"]");
  for (Entry name : hover->entries) {
    name.key = "hover";
    if (name.kind != Entry::Kind::text || std::ranges::find(known, name.text) == known.end())
      section.refuse(name, fmt::format("{} is not a condition; there are: {}", describe(name),
                                       fmt::join(known, ", ")));
    table.hover.push_back(name.text);
  }
}

}  // namespace

QualitiesTable read_qualities(const Section& section, const Model* model,
                              const std::vector<Condition>& conditions) {
  std::vector<std::string> keys{"class",           "category",          "phase",
                                "hover",           "hover_below",       "response",
                                "airspeed",        "gravity",           "n_per_alpha",
                                "bandwidth_delay", "bandwidth_level_1", "bandwidth_level_2"};
  for (const RoleKey& role : role_keys) keys.push_back(role.key);
  section.allow_only(keys);
  constexpr Accepted some{1e-6, largest};
  QualitiesTable table;
  QualitiesOptions& options = table.options;
  constexpr std::size_t light = std::size_t(AircraftClass::II_L);
  const std::size_t chosen = section.choice("class", {"II-L", "I", "II-C", "III", "IV"});
  constexpr std::array order{light, std::size_t(AircraftClass::I), std::size_t(AircraftClass::II_C),
                             std::size_t(AircraftClass::III), std::size_t(AircraftClass::IV)};
  options.aircraft = AircraftClass(order[chosen]);
  constexpr std::array categories{FlightCategory::B, FlightCategory::A, FlightCategory::C};
  options.category = categories[section.choice("category", {"B", "A", "C"})];
  options.response = ResponseType(section.choice("response", {"rate", "attitude"}));
  read_number(section, "airspeed", some, options.airspeed);
  read_number(section, "gravity", some, options.gravity);
  read_number(section, "n_per_alpha", some, options.n_per_alpha);
  read_roles(section, model, options.roles);
  read_bandwidth(section, options);
  read_hover(section, conditions, table);
  return table;
}

}  // namespace tiltrim::reading
