/// @file
/// A study: one TOML file with an aircraft, gains, limits and flight conditions.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "study/keys.hpp"
#include "study/simulation.hpp"
#include "study/tuning.hpp"
#include "study/user_model.hpp"
#include "sweep/axis.hpp"
#include "vehicles/tiltrotor/formulations.hpp"
#include "vehicles/tiltrotor/vehicle.hpp"

namespace tiltrim {

/// Bad input: what() is "file:line:column: key: what is wrong; expected what", or "file: why" for
/// a file that cannot be read.
struct StudyError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A condition of a study with [model]: any of its variables fixed, free or bounded.
struct UserCondition {
  std::shared_ptr<const UserModel> model;  ///< the study's [model]
  std::map<std::string, Range> values;     ///< of states, inputs, parameters and outputs; zero
                                           ///< width fixes, infinite ends are "free"
  std::map<std::string, double> rates;     ///< held
  std::vector<CostTerm> effort;            ///< empty: none
  std::map<std::string, double> guess;     ///< where the unknowns start
  std::vector<std::string> moving;         ///< states whose rates are not held
  std::vector<std::string> implied;        ///< states whose rates vanish with the others
};

/// A flight condition, trimmed by one of four formulations; docs/study.md lists the keys of each:
/// "closed_loop" (V, gamma, eta given, the control law finds the rest), "airframe" (any of its
/// variables fixed, free or bounded), "table" (coefficients given, the paper's Table 2), "model".
struct Condition {
  std::string name;  ///< of its own in the study
  std::variant<Command, AirframeCondition, TableCondition, UserCondition> asked;

  /// The one that is asked, or null.
  const Command* command() const { return std::get_if<Command>(&asked); }
  const AirframeCondition* airframe() const { return std::get_if<AirframeCondition>(&asked); }
  const TableCondition* table() const { return std::get_if<TableCondition>(&asked); }
  const UserCondition* user() const { return std::get_if<UserCondition>(&asked); }
};

/// "closed_loop", "airframe", "table", "model".
std::string formulation_of(const Condition& condition);

/// [follow]: a branch from each condition's own value of the parameter towards `to`.
struct FollowTable {
  Key parameter;    ///< what goes
  double to = 0.0;  ///< SI
};

/// [envelope]: where there is an equilibrium within limits, over V and an angle; of a study with
/// [model], over any two of its numbers.
struct EnvelopeTable {
  Key over = study_key("eta_deg");         ///< or gamma_deg; the other is each condition's own
  Key along = study_key("V");              ///< the other axis
  Range along_range{1.0, 30.0};            ///< SI
  Range range{0.0, std::numbers::pi / 2};  ///< of `over`, SI
  int count = 100;                         ///< grid points along each
};

/// [[sweep.axis]]: a grid, the first axis slowest.
struct SweepTable {
  std::vector<SweepAxis> axes;  ///< at least one
  bool crossings = true;        ///< look between the grid's points
};

/// [report]: what a report shows beside the conditions themselves.
struct ReportTable {
  /// A grid: over one axis trim curves and a root locus, over two a stability map.
  struct Map {
    std::string condition;  ///< empty: each; of a grid over h, which sets all of them, the first
    SweepTable grid;        ///< of one axis or two
  };
  std::vector<Map> maps;         ///< empty: the report chooses
  std::optional<bool> flight{};  ///< not given: where there is a closed loop
  std::optional<bool> audit{};   ///< of the paper's tables; not given: of the paper's aircraft
};

/// The default envelope over "eta_deg" or "gamma_deg".
EnvelopeTable envelope_over(std::string_view angle);

/// What a study says, checked.
struct Study {
  std::filesystem::path file;                   ///< where it was read
  std::string text;                             ///< the file's
  std::string polar_name;                       ///< as asked for
  std::shared_ptr<const UserModel> user_model;  ///< [model]; then there is no vehicle
  Vehicle vehicle;                              ///< [aircraft], [gains], [limits] and the polar
  GainSchedule schedule;                        ///< of the gains; empty: vehicle.gains at any tilt
  std::vector<Condition> conditions;            ///< at least one, names distinct
  std::optional<FollowTable> follow;            ///< [follow]
  std::optional<EnvelopeTable> envelope;        ///< [envelope]
  std::optional<SweepTable> sweep;              ///< [sweep]
  std::optional<TuneTable> tune;                ///< [tune]
  std::optional<SimulateTable> simulate;        ///< [simulate]
  std::optional<UserMotion> user_motion;        ///< [simulate] of a study with [model]
  std::optional<MonteCarloTable> montecarlo;    ///< [montecarlo]
  std::optional<ReportTable> report;            ///< [report]
};

/// Reads and checks a study; throws StudyError and nothing else. Polars are looked for beside the
/// study, then among the data that came with the program (data_directory()).
Study load_study(const std::filesystem::path& file);

/// The same from text, `file` naming it in messages and giving the folder for polars.
Study parse_study(std::string_view text, const std::filesystem::path& file);

/// The numbers that the study's verbs may move: those of its [model], or study_keys().
std::vector<Key> keys_of(const Study& study);

/// The study's vehicle with the gains that it has at the condition's tilt.
Vehicle vehicle_at(const Study& study, const Condition& condition);

/// Where the shipped polars and published tables lie: the environment's TILTRIM_DATA, else data/
/// beside the Python module, else the program's ../share/tiltrim/data, else the source tree's data/
/// if it is there, else the share/tiltrim/data it was configured to be installed in.
std::filesystem::path data_directory();

/// The reference vehicle: default numbers and the default polar from data_directory(). Throws
/// std::runtime_error if the polar is not there.
Vehicle reference_vehicle();

}  // namespace tiltrim
