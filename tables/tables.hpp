/// The paper's Tables 1-3 [1]: as published, recomputed, and audited. docs/tables.md explains every
/// number. SI units, radians.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "linearize/modes.hpp"
#include "trim/trim.hpp"
#include "vehicles/tiltrotor/vehicle.hpp"

namespace tiltrim {

// ---- What is printed ----

/// A number as printed.
struct Printed {
  std::string text;
  double value = 0.0;
  double unit = 1.0;  ///< one unit of the last printed digit; of "pi/4": pi/4
};

/// Reads "0.01707", "-2", "pi/4", "-pi". Throws std::invalid_argument that quotes the text.
Printed read_printed(std::string_view text);

/// Climb, transition, level flight.
template <class T>
using Columns = std::array<T, 3>;

struct PublishedTables {
  std::string source;
  Columns<std::string> columns;
  Columns<Printed> eta, gamma, alpha, V;  // Table 1
  Columns<Printed> CL, CD, CM;            // Table 2
  Columns<Printed> theta0, delta_e, a1s;  // Table 3
};

/// Reads paper_tables.json. Throws std::runtime_error "file: key: what is wrong".
PublishedTables load_published_tables(const std::filesystem::path& file);

// ---- Printed beside computed ----

/// How a computed number agrees with the digits printed.
enum class Agreement {
  exact,          ///< the printed value itself
  both,           ///< gives the printed digits truncated as well as rounded
  truncated,      ///< gives them only truncated
  rounded,        ///< gives them only rounded
  opposite_sign,  ///< gives them with the other sign
  different,
  not_computed,  ///< nothing determines the number
};
std::string to_string(Agreement agreement);

struct Cell {
  Printed published;
  std::optional<double> computed;
  std::optional<double> deviation;  ///< computed - published, in units of the last printed digit
  Agreement agreement = Agreement::not_computed;
  std::string remark;

  /// Every printed digit and the sign.
  bool matches() const { return agreement <= Agreement::rounded; }
};
Cell compare(const Printed& published, std::optional<double> computed, std::string remark = {});

struct Row {
  std::string name, unit;
  Columns<Cell> cells;
};
struct Table {
  std::string title;
  std::vector<Row> rows;
  std::vector<std::string> notes;
};

// ---- Two constants behind six numbers ----

/// What printing did to the digits that follow.
enum class Reading { truncated, rounded };
std::string to_string(Reading reading);

/// The rows theta0 and a1s of Table 3 with the coefficients they rest on.
struct SixNumbers {
  Columns<std::string> columns;
  Columns<double> CL, CD;
  Columns<Printed> theta0, a1s;
};
SixNumbers six_numbers(const PublishedTables& published);

struct IdentifyOptions {
  Reading reading = Reading::truncated;
  Range thrust_excess{1.0, 3.0};  ///< searched; equal ends fix it
  Range k{1e-6, 0.2};             ///< searched, likewise
  long max_evaluations = 100'000;
};

enum class IdentifyStatus {
  reproduced,        ///< all six numbers to every printed digit, the ranges verified
  not_reproduced,    ///< the best pair found misses some digit
  not_determined,    ///< reproduced, but a range ends at the bound of the search
  evaluation_limit,  ///< the evaluations ran out before an answer was verified
};
std::string to_string(IdentifyStatus status);

/// What one column alone says of the two constants.
struct ColumnConstants {
  Range thrust_excess, k;
};

struct Identification {
  IdentifyStatus status = IdentifyStatus::evaluation_limit;
  std::string message;
  Reading reading = Reading::truncated;
  double thrust_excess = 0.0;    ///< Ep
  double k = 0.0;                ///< ½ρ(V + vi)²S/(m g)
  double effective_speed = 0.0;  ///< V + vi behind k [m/s]; needs g, which the paper does not give
  double worst = 0.0;            ///< largest |miss|; up to 0.5 every printed digit is reproduced
  /// From the middle of what the digits allow, units of the last digit: theta0 of the columns, a1s.
  std::array<double, 6> misses{};
  /// Over all pairs that reproduce the digits; absent where none was found.
  std::optional<Range> thrust_excess_range, k_range;
  Columns<ColumnConstants> columns;
  long evaluations = 0;
};

/// Finds the pair (Ep, k) whose largest miss over the six magnitudes is least, by NLopt (global,
/// then local), and the ranges of all pairs that reproduce them. `aircraft` gives the speed behind
/// k. Throws std::invalid_argument if a number is not finite or a range is no range of positive
/// ones.
[[nodiscard]] Identification identify(const SixNumbers& numbers, const Aircraft& aircraft,
                                      const IdentifyOptions& options = {});

// ---- The elevator row ----

/// What Table 3 implies for the pitching moment of one column.
struct ElevatorColumn {
  double CM_thrust = 0.0;     ///< thrust's moment over ½ρ(V + vi)² S cbar
  double CM_required = 0.0;   ///< -CM_thrust: what M = 0 asks of the airframe
  double CM_published = 0.0;  ///< Table 2
  double CM_increment = 0.0;  ///< CM_required - CM_published, left to the elevator
  double slope = 0.0;         ///< CM_increment over the printed deflection [1/rad]
  double K_Lp = 0.0;  ///< that (9) and (13) need to give the printed a1s and delta_e, theta = 0
  /// Deflection that supplies the increment on the given aircraft, limits aside; none where its
  /// elevator has no moment.
  std::optional<double> delta_e;
};
struct ElevatorAudit {
  Columns<ElevatorColumn> columns;
  std::string finding;
};

// ---- Slips ----

/// A number that shows a slip.
struct Evidence {
  std::string what;
  double value = 0.0;
  std::string unit;
  bool confirms = false;  ///< the number is what the slip says it is
};
struct Slip {
  std::string where, printed, consistent, why;
  std::vector<Evidence> evidence;

  bool confirmed() const;
};

// ---- The equilibria the named conditions really have ----

struct CorrectedColumn {
  std::string name;
  Command condition;
  TrimResult trim;
  std::optional<double> theta, theta0, a1s, delta_e;  ///< of a verified equilibrium
  std::vector<std::string> stopped_by;  ///< equations and limits, each of which alone stops it
  std::optional<Verdict> verdict;  ///< of the linearized closed loop; absent where not linearized
  std::optional<double> spectral_abscissa;  ///< 1/s
  std::string finding;
};
struct CorrectedTable {
  std::string title;
  Columns<CorrectedColumn> columns;
};

// ---- All of it ----

struct PaperTables {
  PublishedTables published;
  Table table1, table2, table3;
  Columns<Coefficients> section;  ///< the NACA 8-H-12 polar at Table 1's angles, lift positive up
  Identification identified;      ///< digits read as truncated: the constants of Table 3 recomputed
  Identification at_excess_1_4;   ///< the same with Ep = 1.4
  Identification as_rounded;      ///< digits read as rounded
  Identification as_rounded_at_excess_1_4;
  ElevatorAudit elevator;
  std::vector<Slip> slips;
  CorrectedTable level_body;  ///< theta = 0, as Table 1 has it
  CorrectedTable free_pitch;  ///< the closed loop's own theta
  CorrectedColumn
      wake_as_printed;  ///< the climb with (3) as printed: pitch_scale 1, wake_immersion 1
  std::vector<std::string> findings;  ///< the outcome, a sentence each
};

/// Recomputes and audits the tables with the polars and printed numbers in `data`; the aircraft,
/// gains and limits of `vehicle` are those of the corrected tables.
[[nodiscard]] PaperTables paper_tables(const std::filesystem::path& data, const Vehicle& vehicle);

/// The parts, each on its own.
Table recompute_table1(const PublishedTables& published);
Table recompute_table2(const PublishedTables& published, const Polar& anchored);
Table recompute_table3(const PublishedTables& published, const Identification& identified,
                       const ElevatorAudit& elevator);
ElevatorAudit audit_elevator(const PublishedTables& published, const Identification& identified,
                             const Vehicle& vehicle);
std::vector<Slip> find_slips(const PublishedTables& published, const Identification& identified,
                             const Polar& section, const Vehicle& vehicle,
                             const CorrectedTable& free_pitch);
CorrectedTable trim_level_body(const Vehicle& vehicle);
CorrectedTable trim_free_pitch(const Vehicle& vehicle);
CorrectedColumn climb_with_printed_wake(const Vehicle& vehicle);

/// (15) as printed, first two rows: theta0 and a1s, |a1s| < pi/2, with coefficients given.
struct ForceBalance {
  double theta0, a1s;
};
ForceBalance solve_forces(double thrust_excess, double k, double CL, double CD, double gamma,
                          double alpha, double eta);

}  // namespace tiltrim
