/// A study: one TOML file with an aircraft, gains, limits, flight conditions and the analyses to
/// run on them.
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
#include "model/time_limit.hpp"
#include "qualities/qualities.hpp"
#include "study/keys.hpp"
#include "study/user_model.hpp"
#include "sweep/map.hpp"
#include "tune/tune.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/formulations.hpp"
#include "vehicles/tiltrotor/table_trim.hpp"
#include "vehicles/tiltrotor/vehicle.hpp"

namespace tiltrim {

/// [tune]
struct TuneTable {
  std::vector<std::string> conditions;  ///< condition names, in the study's order
  std::vector<double> heights;          ///< further points along corridor (16), m
  std::vector<FreeGain> gains;          ///< at least one
  std::vector<double> schedule;  ///< tilts [rad], rising: the gains are linear in eta between them;
                                 ///< empty: constant gains
  std::vector<Uncertain> uncertain;  ///< empty: none
  bool corners = true;               ///< all corners are operating points
  int samples = 0;                   ///< number of seeded random operating points, in addition
  std::map<std::string, double> disturbance;  ///< of V [m/s], gamma, theta [rad], q [rad/s] by name
  Requirement goal{Measure::decay};           ///< its worst value is optimized
  std::vector<Requirement> goals;             ///< several, with targets, in place of `goal`
  std::vector<Requirement> limits;            ///< constraints at all operating points
  std::string global = "multistart", local = "bfgs";  ///< as tune/tune.hpp spells them
  std::string second = "crs2";           ///< algorithm of the second search, for comparison; "none"
  std::uint64_t seed = 1;                ///< of all random numbers
  long evaluations = 100000;             ///< largest number of candidates
  double seconds = 0.0;                  ///< 0: no limit
  std::vector<double> regulator_starts;  ///< efforts of the regulators that give further starts
  std::vector<double> placed_starts;     ///< decays of the placed poles that do, 1/s
  long robustness = 10'000;              ///< random samples for the robustness test
  /// The optimal goal as a function of one limit.
  struct Front {
    Requirement limit;            ///< NaN
    double from = 0.0, to = 0.0;  ///< range of the limit, in the measure's unit
    int count = 0;                ///< number of values
  };
  std::optional<Front> front;  ///< empty: no front
};

/// The commanded flight.
struct ScheduleTable {
  /// Source of the command.
  enum class Kind {
    corridor,      ///< (16) over height
    hold,          ///< the command of the condition named by `start`, else of the first
    reconversion,  ///< (16) backwards over time on a level path, then a descent to the ground
    table,         ///< values over height or time
  } kind = Kind::corridor;      ///< which
  bool over_time = false;       ///< table: over time; else over height
  std::vector<double> at{};     ///< table: s or m, rising by at least 1e-4; at least two
  std::vector<double> V{};      ///< table: m/s; empty: the corridor's (over height only)
  std::vector<double> gamma{};  ///< table: rad; empty: likewise
  std::vector<double> eta{};    ///< table: rad; empty: likewise
};

/// [simulate]
struct SimulateTable {
  ScheduleTable schedule;  ///< the commands
  double duration = 90.0;  ///< s
  std::string start;  ///< "ground", "trim" of the schedule's first command, or a condition's name;
                      ///< empty: "ground" for a schedule over height, else "trim"
  double height = 0.0;  ///< initial height, m; reconversion: 120
  /// Other initial states by name, SI: V, gamma, theta, q, energy_integral, distribution_integral.
  std::map<std::string, double> states;
  Axes axes = Axes::body;                      ///< axes of the equations of motion
  HandOver hand_over = HandOver::as_printed;   ///< if the controls are not blended
  double anti_windup = 1.0;                    ///< s; infinite: none
  ActuatorRates rates;                         ///< rate limits
  double lag = 0.05;                           ///< s, of actuators whose rate is limited
  std::vector<DisturbanceTable> disturbances;  ///< added up
  std::vector<GustTable> gusts;                ///< added up
  double tolerance = 1e-9;                     ///< as in IntegrateOptions
  double sample = 0.1;                         ///< s
};

/// Whether the flight starts on the ground, explicitly or by default.
inline bool from_ground(const SimulateTable& simulate) {
  using Kind = ScheduleTable::Kind;
  const ScheduleTable& schedule = simulate.schedule;
  if (!simulate.start.empty()) return simulate.start == "ground";
  return schedule.kind == Kind::corridor || (schedule.kind == Kind::table && !schedule.over_time);
}

/// Invalid input: what() is "file:line:column: key: what is wrong; expected what", or "file: why"
/// for a file that cannot be read.
struct StudyError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A condition of a study with [model]: any of its variables fixed, free or bounded.
struct UserCondition {
  std::shared_ptr<const UserModel> model;  ///< the study's [model]
  std::map<std::string, Range> values;  ///< of states, inputs, parameters and outputs; zero width
                                        ///< fixes a variable, infinite ends are "free"
  std::map<std::string, double> rates;  ///< prescribed rates
  std::vector<CostTerm> effort;         ///< empty: no cost
  std::map<std::string, double> guess;  ///< starting values of the unknowns
  std::vector<std::string> moving;      ///< states whose rates are not constrained
  std::vector<std::string> implied;     ///< states whose rates vanish when the others do
};

/// A flight condition, trimmed by one of four formulations; docs/study.md lists the keys of each:
/// "closed_loop" (V, gamma, eta given; the control law determines the rest), "airframe" (any of its
/// variables fixed, free or bounded), "table" (coefficients given, the paper's Table 2), "model".
struct Condition {
  std::string name;  ///< unique in the study
  std::variant<Command, AirframeCondition, TableCondition, UserCondition> asked;  ///< by kind
  std::string place{};  ///< of its [[condition]], "file:line:column"

  /// The command of a closed-loop condition; null for other formulations, like the next three.
  const Command* command() const { return std::get_if<Command>(&asked); }
  /// The condition of the bare airframe.
  const AirframeCondition* airframe() const { return std::get_if<AirframeCondition>(&asked); }
  /// The coefficients of a table condition.
  const TableCondition* table() const { return std::get_if<TableCondition>(&asked); }
  /// The condition of the study's [model].
  const UserCondition* user() const { return std::get_if<UserCondition>(&asked); }
};

/// States of a [model] or airframe condition that are not steady: left free, or held at a rate.
std::vector<std::string> moving_states(const Condition& condition);

/// "closed_loop", "airframe", "table", "model".
std::string formulation_of(const Condition& condition);

/// "file:line:column: condition 'name': why".
[[nodiscard]] StudyError error_in(const Condition& condition, const std::string& why);

/// [follow]: a branch from each condition's own value of the parameter to `to`.
struct FollowTable {
  Key parameter;    ///< continuation parameter
  double to = 0.0;  ///< SI
};

/// [envelope]: the region with an equilibrium within limits, over V and an angle; in a study with
/// [model], over any two of its variables.
struct EnvelopeTable {
  Key over = study_key("eta_deg");  ///< or gamma_deg; the other angle is each condition's own
  Key along = study_key("V");       ///< the other axis
  Range along_range{1.0, 30.0};     ///< SI
  Range range{0.0, std::numbers::pi / 2};  ///< of `over`, SI
  int count = 100;                         ///< grid points along each axis
};

/// [[sweep.axis]]: a grid, the first axis slowest.
struct SweepTable {
  std::vector<SweepAxis> axes;  ///< at least one
  bool crossings = true;        ///< locate crossings between grid points
  bool verdicts = false;        ///< detail = "verdict": one byte a point
};

/// Most points of a grid with equilibria and eigenvalues: about 5 GB.
inline constexpr double most_points = 2e7;
/// Most points of a grid of verdicts alone.
inline constexpr double most_verdicts = 1e9;

/// [prove]: a box of parameters.
struct ProveTable {
  /// [[prove.parameter]]
  struct Parameter {
    Key key;                      ///< "h": height along corridor (16), m
    double from = 0.0, to = 0.0;  ///< SI, rising
  };
  std::vector<Parameter> parameters;  ///< at least one
  double margin = 0.0;                ///< decay rate that every eigenvalue shall exceed, 1/s
  double damping = 0.0;               ///< damping ratio that it shall exceed; 0: any
  std::size_t boxes = 20'000;         ///< examined at most
  double undecided = 0.0;             ///< share of the volume at which the search ends
};

/// [report]: what a report contains besides the conditions.
struct ReportTable {
  /// A grid: over one axis trim curves and a root locus, over two axes a stability map.
  struct Map {
    std::string condition;  ///< empty: each; for a grid over h, which sets all commands, the first
    SweepTable grid;        ///< of one axis or two
  };
  std::vector<Map> maps;         ///< empty: chosen by the report
  std::optional<bool> flight{};  ///< not given: if the study has a closed loop
  std::optional<bool> audit{};   ///< of the paper's tables; not given: for its aircraft
};

/// [qualities]: how flying qualities are judged.
struct QualitiesTable {
  QualitiesOptions options;             ///< roles: those given
  std::optional<FlightRegime> phase{};  ///< for all conditions; empty: by `hover_below`
  std::optional<double> hover_below{};  ///< airspeed below which a condition is in hover
  std::vector<std::string> hover{};     ///< conditions in hover
};

/// The default envelope over "eta_deg" or "gamma_deg".
EnvelopeTable envelope_over(std::string_view angle);

/// The checked contents of a study.
struct Study {
  std::filesystem::path file;                   ///< the study's file
  std::string text;                             ///< its contents
  std::string polar_name;                       ///< as named in the study
  std::shared_ptr<const UserModel> user_model;  ///< [model]; the study then has no vehicle
  Vehicle vehicle;                              ///< [aircraft], [gains], [limits] and polar
  GainSchedule schedule;                  ///< scheduled gains; empty: vehicle.gains at every tilt
  double time_limit = unlimited;          ///< s, for each trim and each linearization
  std::vector<Condition> conditions;      ///< at least one; names are unique
  std::optional<FollowTable> follow;      ///< [follow]
  std::optional<EnvelopeTable> envelope;  ///< [envelope]
  std::optional<SweepTable> sweep;        ///< [sweep]
  std::optional<TuneTable> tune;          ///< [tune]
  std::optional<ProveTable> prove;        ///< [prove]
  std::optional<SimulateTable> simulate;  ///< [simulate]
  std::optional<UserMotion> user_motion;  ///< [simulate] of a study with [model]
  std::optional<MonteCarloTable> montecarlo;  ///< [montecarlo]
  std::optional<ReportTable> report;          ///< [report]
  std::optional<QualitiesTable> qualities;    ///< [qualities]
};

/// Reads and checks a study; throws StudyError only. Polars are searched for in the study's folder,
/// then among the data installed with the program (data_directory()).
Study load_study(const std::filesystem::path& file);

/// The same from text; `file` names it in messages and gives the folder for polars.
Study parse_study(std::string_view text, const std::filesystem::path& file);

/// The variables that the study's analyses may vary: those of its [model], or study_keys().
std::vector<Key> keys_of(const Study& study);

/// The study's vehicle with its gains at the condition's tilt.
Vehicle vehicle_at(const Study& study, const Condition& condition);

}  // namespace tiltrim
