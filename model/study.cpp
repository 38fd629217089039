#include "model/study.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <utility>

#include "model/condition_reader.hpp"
#include "model/section.hpp"
#include "model/toml_reader.hpp"

namespace tiltrim {

using namespace reading;
namespace fs = std::filesystem;

constexpr std::size_t largest_study = 1'000'000;  // bytes
constexpr std::string_view default_polar = "naca8h12_re150k.csv";

constexpr double smallest = 1e-6, largest = 1e6;  // far beyond any aircraft, far from overflow

constexpr Accepted positive{smallest, largest}, not_negative{0, largest}, any{-largest, largest};

// Numbers that may not be just anything; those in degrees have keys ending in _deg.
struct Limited {
  std::string_view name;
  Accepted accepted;
};
constexpr auto limited = std::to_array<Limited>({
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

struct NumberKey {
  std::string key;
  Accepted accepted;
};

// The keys of the aircraft's or the control law's numbers, in their order; `signals` must outlive
// them.
static std::vector<NumberKey> keys_of(const Signals& signals) {
  std::vector<NumberKey> keys;
  for (const Signal& signal : signals) {
    const std::string name = signal.name.substr(signal.name.find('.') + 1);
    const auto at = std::ranges::find(limited, name, &Limited::name);
    Accepted accepted = at == limited.end() ? any : at->accepted;
    if (!accepted.degrees()) accepted.unit = signal.unit;
    keys.push_back({accepted.degrees() ? name + "_deg" : name, accepted});
  }
  return keys;
}

// Reads those of the numbers that the section has; `others` are allowed beside them.
static void read_numbers(const Section& section, const Signals& signals,
                         std::vector<std::string> others, const auto& value) {
  const std::vector<NumberKey> keys = keys_of(signals);
  for (const NumberKey& number : keys) others.push_back(number.key);
  section.allow_only(others);
  for (std::size_t i = 0; i < keys.size(); ++i)
    if (const Entry* entry = section.find(keys[i].key))
      value(i) = section.number(*entry, keys[i].accepted);
}

// Calls read(section) on the table [name] if there is one.
static void with_table(const Entry& root, const char* name, const fs::path& file,
                       const auto& read) {
  const Section top(file, root, "at the top level", "");
  const Entry* table = top.find(name);
  if (!table) return;
  if (table->kind != Entry::Kind::table)
    top.refuse(*table,
               fmt::format("{} is not a table; expected a table [{}]", describe(*table), name));
  read(Section(file, *table, fmt::format("in [{}]", name), fmt::format("{}.", name)));
}

static void read_aircraft(const Section& section, Aircraft& aircraft, std::string& polar_name) {
  read_numbers(section, aircraft_signals(), {"polar"},
               [&](std::size_t i) -> double& { return aircraft_value(aircraft, i); });
  if (section.find("polar")) polar_name = section.text("polar");
}

static void read_gains(const Section& section, const Aircraft& aircraft, Gains& gains) {
  read_numbers(section, gain_signals(), {},
               [&](std::size_t i) -> double& { return gain_value(gains, i); });
  // Divisors of the control law (13); the defaults keep both above zero.
  if (1 + gains.K_Lp == 0)
    section.refuse(*section.find("K_Lp"), "makes 1 + K_Lp zero; expected any other number");
  if (1 + aircraft.thrust_excess * gains.K_Ep == 0)
    section.refuse(*section.find("K_Ep"),
                   "makes 1 + thrust_excess K_Ep zero; expected any other number");
}

static void read_limits(const Section& section, Limits& limits) {
  constexpr Accepted deflection{-90, 90, "degrees"};
  const auto read = [&](const char* key, const Accepted& accepted, Range& range) {
    if (const Entry* entry = section.find(key)) range = section.range(*entry, accepted);
  };
  section.allow_only({"theta0", "a1s_deg", "delta_e_deg", "theta_deg"});
  read("theta0", {-10, 10}, limits.theta0);
  read("a1s_deg", deflection, limits.a1s);
  read("delta_e_deg", deflection, limits.delta_e);
  read("theta_deg", {-180, 180, "degrees"}, limits.theta);
}

// Throws std::runtime_error in the polar's own words.
static std::shared_ptr<const Polar> find_polar(const std::string& name, const fs::path& folder) {
  const fs::path shipped = data_directory();
  std::error_code ignored;
  for (const fs::path& place : {folder / name, shipped / name})
    if (fs::exists(place, ignored)) return std::make_shared<const Polar>(load_polar(place));
  throw std::runtime_error(
      fmt::format("{} is neither in {} nor in {}; expected a polar beside the study or among the "
                  "program's data",
                  in_quotes(name), folder.empty() ? "." : folder.string(), shipped.string()));
}

static void read_polar(const Entry& root, Study& study) {
  try {
    study.vehicle.polar = find_polar(study.polar_name, study.file.parent_path());
  } catch (const std::runtime_error& e) {
    with_table(root, "aircraft", study.file, [&](const Section& aircraft) {
      if (const Entry* polar = aircraft.find("polar")) aircraft.refuse(*polar, e.what());
    });
    refuse(study.file, {}, fmt::format("aircraft.polar (by default): {}", e.what()));
  }
}

Study parse_study(std::string_view text, const fs::path& file) {
  if (text.size() > largest_study)
    refuse(file, {},
           fmt::format("the file has more than {} bytes; expected a study, which has a "
                       "few thousand",
                       largest_study));
  const Entry root = parse_toml(text, file);
  const Section top(file, root, "at the top level", "");
  top.allow_only({"equations", "aircraft", "gains", "limits", "condition"});
  Study study;
  study.file = file;
  study.polar_name = default_polar;
  Vehicle& vehicle = study.vehicle;
  vehicle.equations = static_cast<Equations>(top.choice("equations", {"consistent", "printed"}));
  with_table(root, "aircraft", file,
             [&](const Section& s) { read_aircraft(s, vehicle.aircraft, study.polar_name); });
  with_table(root, "gains", file,
             [&](const Section& s) { read_gains(s, vehicle.aircraft, vehicle.gains); });
  with_table(root, "limits", file, [&](const Section& s) { read_limits(s, vehicle.limits); });
  study.conditions = read_conditions(root, file, vehicle.equations);
  read_polar(root, study);
  return study;
}

Study load_study(const fs::path& file) { return parse_study(read_text(file, largest_study), file); }

#ifndef TILTRIM_SOURCE_DATA
#define TILTRIM_SOURCE_DATA ""
#endif
#ifndef TILTRIM_INSTALL_DATA
#define TILTRIM_INSTALL_DATA ""
#endif

fs::path data_directory() {
  if (const char* chosen = std::getenv("TILTRIM_DATA"); chosen && *chosen) return chosen;
  std::error_code ignored;
  const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
  const fs::path beside = program.parent_path().parent_path() / "share/tiltrim/data";
  for (const fs::path& place : {beside, fs::path(TILTRIM_SOURCE_DATA)})
    if (fs::is_directory(place, ignored)) return place;
  return TILTRIM_INSTALL_DATA;
}

Vehicle reference_vehicle() {
  Vehicle vehicle;
  vehicle.polar = find_polar(std::string(default_polar), data_directory());
  return vehicle;
}

}  // namespace tiltrim
