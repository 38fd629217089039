/// @file
/// A study: one TOML file with an aircraft, gains, limits, flight conditions and what is asked of
/// them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "flight/flight.hpp"
#include "flight/monte_carlo.hpp"
#include "model/model.hpp"
#include "study/keys.hpp"
#include "study/user_model.hpp"
#include "sweep/map.hpp"
#include "tune/tune.hpp"
#include "vehicles/tiltrotor/formulations.hpp"
#include "vehicles/tiltrotor/vehicle.hpp"

namespace tiltrim {

/// [tune]
struct TuneTable {
  std::vector<std::string> conditions;  ///< names of the study's, in its order
  std::vector<double> heights;          ///< points along corridor (16) beside them, m
  std::vector<FreeGain> gains;          ///< at least one
  std::vector<double> schedule;  ///< tilts [rad], rising: the gains are linear in eta between them;
                                 ///< empty: constant
  std::vector<Uncertain> uncertain;           ///< empty: none
  bool corners = true;                        ///< all of them are operating points
  int samples = 0;                            ///< seeded ones beside them
  std::map<std::string, double> disturbance;  ///< of V [m/s], gamma, theta [rad], q [rad/s] by name
  Requirement goal{Measure::decay};           ///< whose worst value is to be best
  std::vector<Requirement> limits;            ///< that hold at all points
  std::string global = "multistart", local = "slsqp";  ///< as tune/tune.hpp spells them
  std::string second = "crs2";                         ///< whose answer stands beside; "none"
  std::uint64_t seed = 1;                              ///< of all that is random
  long evaluations = 4000;                             ///< candidates tried
  double seconds = 0.0;                                ///< 0: no limit
  long robustness = 10'000;  ///< random samples that the answer is tried on
  /// The goal over a limit that moves.
  struct Front {
    Requirement limit;            ///< NaN
    double from = 0.0, to = 0.0;  ///< of its value, in the measure's unit
    int count = 0;                ///< of values
  };
  std::optional<Front> front;  ///< not given: none
};

/// Which commands are flown.
struct ScheduleTable {
  /// Where they come from.
  enum class Kind {
    corridor,      ///< (16) over height
    hold,          ///< the command of the condition that `start` names, else of the first one
    reconversion,  ///< (16) backwards over time on a level path, then down to the ground
    table,         ///< numbers over height or time
  } kind = Kind::corridor;      ///< which
  bool over_time = false;       ///< table: else over height
  std::vector<double> at{};     ///< table: s or m, rising by 1e-4 or more; two at least
  std::vector<double> V{};      ///< table: m/s; empty: the corridor's (over height alone)
  std::vector<double> gamma{};  ///< table: rad; empty: the same
  std::vector<double> eta{};    ///< table: rad; empty: the same
};

/// [simulate]
struct SimulateTable {
  ScheduleTable schedule;  ///< the commands
  double duration = 90.0;  ///< s
  std::string start;       ///< "ground", "trim" of the schedule's first command, or a condition's
                           ///< name; empty: "ground" for a schedule over height, else "trim"
  double height = 0.0;     ///< m at the start; reconversion: 120
  /// Other states at the start, by name, SI: V, gamma, theta, q, energy_integral,
  /// distribution_integral.
  std::map<std::string, double> states;
  Axes axes = Axes::body;                      ///< in which it is integrated
  HandOver hand_over = HandOver::as_printed;   ///< where there is no blend
  double anti_windup = 1.0;                    ///< s; infinite: none
  ActuatorRates rates;                         ///< largest ones
  double lag = 0.05;                           ///< s, of actuators whose rate is limited
  std::vector<DisturbanceTable> disturbances;  ///< all together
  std::vector<GustTable> gusts;                ///< all together
  double tolerance = 1e-9;                     ///< as in IntegrateOptions
  double sample = 0.1;                         ///< s
};

/// Whether the flight begins on the ground, said or by default.
inline bool from_ground(const SimulateTable& simulate) {
  using Kind = ScheduleTable::Kind;
  const ScheduleTable& schedule = simulate.schedule;
  if (!simulate.start.empty()) return simulate.start == "ground";
  return schedule.kind == Kind::corridor || (schedule.kind == Kind::table && !schedule.over_time);
}

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
  std::variant<Command, AirframeCondition, TableCondition, UserCondition> asked;  ///< of one kind

  /// What is asked of the closed loop; null for the other kinds, as the next three are.
  const Command* command() const { return std::get_if<Command>(&asked); }
  /// Of the airframe alone.
  const AirframeCondition* airframe() const { return std::get_if<AirframeCondition>(&asked); }
  /// Of coefficients.
  const TableCondition* table() const { return std::get_if<TableCondition>(&asked); }
  /// Of the study's [model].
  const UserCondition* user() const { return std::get_if<UserCondition>(&asked); }
};

/// States that are not to be at rest, of a study with [model]: left free, or held at a rate.
std::vector<std::string> moving_states(const Condition& condition);

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
  double time_limit = unlimited;                ///< s, of each trim and each linearization
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
