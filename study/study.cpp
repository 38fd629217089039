#include "study/study.hpp"

#include <dlfcn.h>
#include <fmt/core.h>
#include <link.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "runtime/rounding.hpp"
#include "study/condition_reader.hpp"
#include "study/model_reader.hpp"
#include "study/prove_reader.hpp"
#include "study/qualities_reader.hpp"
#include "study/qualities_study.hpp"
#include "study/reference_vehicle.hpp"
#include "study/section.hpp"
#include "study/simulate_reader.hpp"
#include "study/sweep_reader.hpp"
#include "study/toml_reader.hpp"
#include "study/tune_reader.hpp"
#include "vehicles/tiltrotor/along.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/numbers.hpp"

namespace tiltrim {

using namespace reading;
namespace fs = std::filesystem;

constexpr std::size_t largest_study = 1'000'000;  // bytes
constexpr std::string_view default_polar = "naca8h12_re150k.csv";

// Reads the numbers that the section contains; `others` are allowed too, and of the numbers those
// in `lists` are left to other readers.
static void read_numbers(const Section& section, const Signals& signals,
                         std::vector<std::string> others, const auto& value, bool lists = false) {
  const std::vector<Key> keys = number_keys(signals);
  const auto name = [](const Key& key) { return key.name.substr(key.name.find('.') + 1); };
  for (const Key& key : keys) others.push_back(name(key));
  section.allow_only(others);
  for (std::size_t i = 0; i < keys.size(); ++i)
    if (const Entry* entry = section.find(name(keys[i]));
        entry && !(lists && entry->kind == Entry::Kind::array))
      value(i) = section.number(*entry, accepted_by(keys[i]));
}

// Calls read(section) on the table [name], if present.
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

// Tilts in schedule_eta_deg, and for each gain one value or one per tilt.
static GainSchedule read_schedule(const Section& section, const Gains& gains) {
  GainSchedule schedule;
  const Entry* tilts = section.find("schedule_eta_deg");
  if (!tilts) return schedule;
  const auto listed = [&](const Entry& list, const Key& key) {
    std::vector<double> values = section.numbers(list, accepted_by(key));
    for (double& value : values) value = key.in_si(value);
    return values;
  };
  if (tilts->kind == Entry::Kind::array) schedule.eta = listed(*tilts, study_key("eta_deg"));
  if (schedule.eta.size() < 2 ||
      std::ranges::adjacent_find(schedule.eta, std::greater_equal<>()) != schedule.eta.end())
    section.refuse(*tilts, "expected at least two tilts in ascending order, as [0, 45, 90]");
  schedule.gains.assign(schedule.eta.size(), gains);
  const std::vector<Key> keys = number_keys(gain_signals());
  for (std::size_t j = 0; j < keys.size(); ++j) {
    const Entry* list = section.find(keys[j].name.substr(keys[j].name.find('.') + 1));
    if (!list || list->kind != Entry::Kind::array) continue;
    const std::vector<double> values = listed(*list, keys[j]);
    if (values.size() != schedule.eta.size())
      section.refuse(*list, fmt::format("{} values for {} tilts; expected one for each",
                                        values.size(), schedule.eta.size()));
    for (std::size_t k = 0; k < values.size(); ++k) gain_value(schedule.gains[k], j) = values[k];
  }
  return schedule;
}

static void read_gains(const Section& section, const Aircraft& aircraft, Gains& gains,
                       GainSchedule& schedule) {
  const bool scheduled = section.find("schedule_eta_deg");
  read_numbers(
      section, gain_signals(), {"schedule_eta_deg"},
      [&](std::size_t i) -> double& { return gain_value(gains, i); }, scheduled);
  schedule = read_schedule(section, gains);
  for (const Gains& g : schedule.gains)
    if (!(1 + g.K_Lp > 0) || !(1 + aircraft.thrust_excess * g.K_Ep > 0))
      section.refuse(*section.find("schedule_eta_deg"),
                     "1 + K_Lp or 1 + thrust_excess K_Ep is not positive at one of the tilts");
  if (!schedule.eta.empty()) gains = schedule.gains.front();
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

static Key read_key(const Section& section, const char* name, const std::vector<Key>& keys) {
  const std::string key = section.text(name);
  try {
    return key_among(keys, key);
  } catch (const std::invalid_argument& e) {
    section.refuse(*section.find(name), e.what());
  }
}

static FollowTable read_follow(const Section& section, const std::vector<Key>& keys) {
  section.allow_only({"parameter", "to"});
  FollowTable follow{read_key(section, "parameter", keys), 0.0};
  follow.to = section.number("to", accepted_by(follow.parameter));
  return follow;
}

EnvelopeTable envelope_over(std::string_view angle) {
  EnvelopeTable envelope;
  envelope.over = study_key(angle);
  if (angle == "gamma_deg") envelope.range = {in_si(-30, "degrees"), in_si(30, "degrees")};
  return envelope;
}

// Of a study with [model]: two of its variables, and the range of each under its name.
static EnvelopeTable read_user_envelope(const Section& section, const std::vector<Key>& keys) {
  section.require("along", "a number of the model in quotes");
  section.require("over", "another number of the model in quotes");
  EnvelopeTable envelope;
  envelope.along = read_key(section, "along", keys);
  envelope.over = read_key(section, "over", keys);
  if (envelope.along.signal == envelope.over.signal)
    section.refuse(*section.find("over"), "is `along` again; expected another number");
  section.allow_only({"along", "over", envelope.along.name, envelope.over.name, "count"});
  const auto range_of = [&](const Key& key) {
    return section.range(section.require(key.name, "[lower, upper], the axis's ends"),
                         accepted_by(key));
  };
  envelope.along_range = range_of(envelope.along);
  envelope.range = range_of(envelope.over);
  read_whole(section, "count", {5, 1000}, envelope.count);
  return envelope;
}

static EnvelopeTable read_envelope(const Section& section) {
  section.allow_only({"over", "V", "gamma_deg", "eta_deg", "count"});
  const std::vector<std::string> angles{"eta_deg", "gamma_deg"};
  const std::size_t chosen = section.choice("over", angles);
  const std::string& other = angles[1 - chosen];
  EnvelopeTable envelope = envelope_over(angles[chosen]);
  if (const Entry* entry = section.find(other))
    section.refuse(*entry, fmt::format("is set by each condition; expected over = \"{}\", or no {}",
                                       other, other));
  if (const Entry* entry = section.find("V"))
    envelope.along_range = section.range(*entry, {body_axes_below, 1000, "m/s"});
  if (const Entry* entry = section.find(envelope.over.name))
    envelope.range = section.range(*entry, accepted_by(envelope.over));
  read_whole(section, "count", {5, 1000}, envelope.count);
  return envelope;
}

// Throws std::runtime_error with the polar's own message.
static std::shared_ptr<const Polar> find_polar(const std::string& name, const fs::path& folder) {
  const fs::path shipped = data_directory();
  std::error_code ignored;
  for (const fs::path& place : {folder / name, shipped / name})
    if (fs::exists(place, ignored)) return std::make_shared<const Polar>(load_polar(place));
  throw std::runtime_error(fmt::format(
      "{} is neither in {} nor in {}; expected a polar next to the study or in the program's data",
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

static void check_equations(const Section& top, Equations equations) {
  for (const char* flown : {"simulate", "montecarlo"})
    if (const Entry* entry = top.find(flown); entry && equations == Equations::printed)
      top.refuse(*entry,
                 "the printed equations cannot be simulated; expected equations = \"consistent\"");
}

static void read_vehicle(const Section& top, const Entry& root, Study& study) {
  const fs::path& file = study.file;
  Vehicle& vehicle = study.vehicle;
  vehicle.equations = static_cast<Equations>(top.choice("equations", {"consistent", "printed"}));
  with_table(root, "aircraft", file,
             [&](const Section& s) { read_aircraft(s, vehicle.aircraft, study.polar_name); });
  with_table(root, "gains", file, [&](const Section& s) {
    read_gains(s, vehicle.aircraft, vehicle.gains, study.schedule);
  });
  with_table(root, "limits", file, [&](const Section& s) { read_limits(s, vehicle.limits); });
}

// Reads the other tables of a study with [model] or a published vehicle.
static void read_user_study(const Section& top, const Entry& root, Study& study) {
  const bool published = top.find("vehicle");
  const std::string others = published
                                 ? "it belongs to vehicle = \"tiltrotor\""
                                 : "it belongs to the built-in tiltrotor, and a study with [model] "
                                   "defines its own numbers";
  const std::vector<std::string> own =
      published ? std::vector<std::string>{"vehicle", "variant", "control"}
                : std::vector<std::string>{"model"};
  std::vector<std::string> allowed{"time_limit", "condition", "follow", "envelope", "sweep",
                                   "tune",       "simulate",  "report", "qualities"};
  allowed.insert(allowed.begin(), own.begin(), own.end());
  allowed.push_back(published ? "gains" : "prove");
  top.allow_only(allowed, {{"equations", others},
                           {"aircraft", others},
                           {"gains", others},
                           {"limits", others},
                           {"prove",
                            "proofs need equations as formulas, as in [model], or the "
                            "built-in tiltrotor"},
                           {"montecarlo", others}});
  const fs::path& file = study.file;
  if (published)
    study.user_model = std::make_shared<const UserModel>(read_published(top, data_directory()));
  with_table(root, "model", file, [&](const Section& s) {
    study.user_model = std::make_shared<const UserModel>(read_model(s));
  });
  study.conditions = read_conditions(root, file, Equations::consistent, study.user_model);
  const std::vector<Key>& keys = study.user_model->keys;
  with_table(root, "follow", file, [&](const Section& s) { study.follow = read_follow(s, keys); });
  with_table(root, "envelope", file,
             [&](const Section& s) { study.envelope = read_user_envelope(s, keys); });
  with_table(root, "sweep", file,
             [&](const Section& s) { study.sweep = read_sweep(s, file, study.user_model); });
  with_table(root, "prove", file, [&](const Section& s) {
    study.prove = read_user_prove(s, *study.user_model, study.conditions);
  });
  with_table(root, "qualities", file, [&](const Section& s) {
    study.qualities = read_qualities(s, &study.user_model->model, study.conditions);
  });
  with_table(root, "tune", file, [&](const Section& s) {
    const auto figures = study.qualities ? quality_figure_names() : std::vector<std::string>{};
    study.tune = read_user_tune(s, file, *study.user_model, study.conditions, figures);
  });
  with_table(root, "simulate", file, [&](const Section& s) {
    study.user_motion = read_user_motion(s, *study.user_model, study.conditions);
  });
  with_table(root, "report", file, [&](const Section& s) {
    study.report = read_report(s, file, study.user_model, study.conditions);
  });
}

Study parse_study(std::string_view text, const fs::path& file) {
  const RoundToNearest environment;
  const Entry root = parse_toml(text, file);
  const Section top(file, root, "at the top level", "");
  Study study;
  study.file = file;
  study.text = text;
  read_number(top, "time_limit", {1e-6, largest, "s"}, study.time_limit);
  constexpr std::size_t tiltrotor = 0;
  if (top.find("model") || top.choice("vehicle", {"tiltrotor", "xv15"}) != tiltrotor) {
    read_user_study(top, root, study);
    return study;
  }
  top.allow_only({"model", "vehicle", "equations", "time_limit", "aircraft", "gains", "limits",
                  "condition", "follow", "envelope", "sweep", "prove", "tune", "simulate",
                  "montecarlo", "report", "qualities"});
  study.polar_name = default_polar;
  read_vehicle(top, root, study);
  const Vehicle& vehicle = study.vehicle;
  study.conditions = read_conditions(root, file, vehicle.equations, nullptr);
  with_table(root, "follow", file,
             [&](const Section& s) { study.follow = read_follow(s, study_keys()); });
  with_table(root, "envelope", file, [&](const Section& s) { study.envelope = read_envelope(s); });
  with_table(root, "sweep", file,
             [&](const Section& s) { study.sweep = read_sweep(s, file, study.schedule); });
  with_table(root, "prove", file, [&](const Section& s) { study.prove = read_prove(s, vehicle); });
  with_table(root, "tune", file,
             [&](const Section& s) { study.tune = read_tune(s, file, vehicle, study.conditions); });
  check_equations(top, vehicle.equations);
  with_table(root, "simulate", file,
             [&](const Section& s) { study.simulate = read_simulate(s, study.conditions); });
  with_table(root, "montecarlo", file, [&](const Section& s) {
    if (!study.simulate) study.simulate.emplace();
    study.montecarlo = read_montecarlo(s, study);
  });
  with_table(root, "report", file, [&](const Section& s) {
    study.report = read_report(s, file, study.schedule, study.conditions);
  });
  with_table(root, "qualities", file, [&](const Section& s) {
    study.qualities = read_qualities(s, nullptr, study.conditions);
  });
  read_polar(root, study);
  return study;
}

std::vector<Key> keys_of(const Study& study) {
  return study.user_model ? study.user_model->keys : study_keys();
}

std::string formulation_of(const Condition& condition) {
  constexpr std::array names{"closed_loop", "airframe", "table", "model"};
  return names[condition.asked.index()];
}

StudyError error_in(const Condition& condition, const std::string& why) {
  return StudyError(fmt::format("{}: condition '{}': {}", condition.place, condition.name, why));
}

std::vector<std::string> moving_states(const Condition& condition) {
  std::vector<std::string> moving;
  const auto add = [&](const std::map<std::string, double>& rates) {
    for (const auto& [state, rate] : rates)
      if (rate != 0) moving.push_back(state);
  };
  if (const UserCondition* user = condition.user()) {
    moving = user->moving;
    add(user->rates);
  } else if (const AirframeCondition* airframe = condition.airframe()) {
    add(airframe->rates);
    const auto q = airframe->values.find("q");  // theta' = q
    const bool turns =
        q != airframe->values.end() && q->second.lower == q->second.upper && q->second.lower != 0;
    if (turns && !airframe->rates.contains("theta")) moving.push_back("theta");
  }
  return moving;
}

Vehicle vehicle_at(const Study& study, const Condition& condition) {
  Vehicle vehicle = study.vehicle;
  if (const Command* command = condition.command(); command && !study.schedule.eta.empty())
    vehicle.gains = gains_at(study.schedule, command->eta);
  return vehicle;
}

Study load_study(const fs::path& file) {
  const std::string text = read_text(file, largest_study);
  if (text.size() > largest_study)
    refuse(file, {},
           fmt::format("the file has more than {} bytes; expected a study, which has a "
                       "few thousand",
                       largest_study));
  return parse_study(text, file);
}

#ifndef TILTRIM_SOURCE_DATA
#define TILTRIM_SOURCE_DATA ""
#endif
#ifndef TILTRIM_INSTALL_DATA
#define TILTRIM_INSTALL_DATA ""
#endif

// data/ in the folder of the shared object that contains this code, for the Python module; empty
// for a program, whose data are elsewhere.
static fs::path data_beside_object() {
  Dl_info object{};
  void* map = nullptr;
  const auto* here = reinterpret_cast<const void*>(&data_directory);
  if (dladdr1(here, &object, &map, RTLD_DL_LINKMAP) == 0 || !map) return {};
  const char* file = static_cast<const link_map*>(map)->l_name;
  return *file ? fs::path(file).parent_path() / "data" : fs::path();
}

fs::path data_directory() {
  if (const char* chosen = std::getenv("TILTRIM_DATA"); chosen && *chosen) return chosen;
  std::error_code ignored;
  if (const fs::path beside = data_beside_object(); fs::is_directory(beside, ignored))
    return beside;
  const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
  const fs::path beside = program.parent_path().parent_path() / "share/tiltrim/data";
  for (const fs::path& place : {beside, fs::path(TILTRIM_SOURCE_DATA)})
    if (fs::is_directory(place, ignored)) return place;
  return TILTRIM_INSTALL_DATA;
}

Vehicle reference_vehicle() {
  const RoundToNearest environment;
  Vehicle vehicle;
  vehicle.polar = find_polar(std::string(default_polar), data_directory());
  return vehicle;
}

}  // namespace tiltrim
