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

// ---- Printed numbers ----

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

// ---- Printed and computed ----

/// How a computed number agrees with the printed digits.
enum class Agreement {
  exact,          ///< the printed value itself
  both,           ///< matches the printed digits both truncated and rounded
  truncated,      ///< matches only truncated
  rounded,        ///< matches only rounded
  opposite_sign,  ///< matches with the opposite sign
  different,
  not_computed,  ///< not determined by the paper
};
std::string to_string(Agreement agreement);

struct Cell {
  Printed published;
  std::optional<double> computed;
  std::optional<double> deviation;  ///< computed - published, in units of the last printed digit
  Agreement agreement = Agreement::not_computed;
  std::string remark;

  /// True if every printed digit and the sign match.
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

// ---- Two constants for six numbers ----

/// How the printed digits were obtained.
enum class Reading { truncated, rounded };
std::string to_string(Reading reading);

/// The rows theta0 and a1s of Table 3 with the coefficients they depend on.
struct SixNumbers {
  Columns<std::string> columns;
  Columns<double> CL, CD;
  Columns<Printed> theta0, a1s;
};
SixNumbers six_numbers(const PublishedTables& published);

struct IdentifyOptions {
  Reading reading = Reading::truncated;
  Range thrust_excess{1.0, 3.0};  ///< search range; equal ends fix it
  Range k{1e-6, 0.2};             ///< search range, likewise
  long max_evaluations = 100'000;
};

enum class IdentifyStatus {
  reproduced,        ///< all six numbers to every printed digit, ranges verified
  not_reproduced,    ///< the best pair found misses a digit
  not_determined,    ///< reproduced, but a range ends at the bound of the search
  evaluation_limit,  ///< evaluations used up before a result was verified
};
std::string to_string(IdentifyStatus status);

/// The two constants from one column alone.
struct ColumnConstants {
  Range thrust_excess, k;
};

struct Identification {
  IdentifyStatus status = IdentifyStatus::evaluation_limit;
  std::string message;
  Reading reading = Reading::truncated;
  double thrust_excess = 0.0;    ///< Ep
  double k = 0.0;                ///< ½ρ(V + vi)²S/(m g)
  double effective_speed = 0.0;  ///< V + vi implied by k [m/s]; the paper omits the g it needs
  double worst = 0.0;            ///< largest |miss|; at most 0.5: every printed digit is reproduced
  /// Deviation from the centre of the digits' interval, in units of the last digit: theta0 of the
  /// columns, then a1s.
  std::array<double, 6> misses{};
  /// Over all pairs that reproduce the digits; empty if none was found.
  std::optional<Range> thrust_excess_range, k_range;
  Columns<ColumnConstants> columns;
  long evaluations = 0;
};

/// Finds the pair (Ep, k) that minimizes the largest deviation over the six magnitudes, by NLopt
/// (global, then local), and the ranges of all pairs that reproduce them. `aircraft` gives the
/// speed implied by k. Throws std::invalid_argument if a number is not finite or a range is not
/// positive and ordered.
[[nodiscard]] Identification identify(const SixNumbers& numbers, const Aircraft& aircraft,
                                      const IdentifyOptions& options = {});

// ---- The elevator row ----

/// Pitching moment implied by one column of Table 3.
struct ElevatorColumn {
  double CM_thrust = 0.0;     ///< moment of the thrust over ½ρ(V + vi)² S cbar
  double CM_required = 0.0;   ///< -CM_thrust: required by M = 0
  double CM_published = 0.0;  ///< Table 2
  double CM_increment = 0.0;  ///< CM_required - CM_published, required of the elevator
  double slope = 0.0;         ///< CM_increment over the printed deflection [1/rad]
  double K_Lp = 0.0;  ///< required by (9) and (13) for the printed a1s and delta_e, theta = 0
  /// Deflection of the given aircraft that supplies the increment, ignoring limits; empty if its
  /// elevator produces no moment.
  std::optional<double> delta_e;
};
struct ElevatorAudit {
  Columns<ElevatorColumn> columns;
  std::string finding;
};

// ---- Slips ----

/// A number that proves a slip.
struct Evidence {
  std::string what;
  double value = 0.0;
  std::string unit;
  bool confirms = false;  ///< the number agrees with the statement of the slip
};
struct Slip {
  std::string where, printed, consistent, why;
  std::vector<Evidence> evidence;

  bool confirmed() const;
};

// ---- True equilibria of the named conditions ----

struct CorrectedColumn {
  std::string name;
  Command condition;
  TrimResult trim;
  std::optional<double> theta, theta0, a1s, delta_e;  ///< of a verified equilibrium
  std::vector<std::string> stopped_by;  ///< equations and limits, each sufficient to prevent it
  std::optional<Verdict> verdict;       ///< of the linearized closed loop; empty if not linearized
  std::optional<double> spectral_abscissa;  ///< 1/s
  std::string finding;
};
struct CorrectedTable {
  std::string title;
  Columns<CorrectedColumn> columns;
};

// ---- Everything ----

struct PaperTables {
  PublishedTables published;
  Table table1, table2, table3;
  Columns<Coefficients> section;  ///< the NACA 8-H-12 polar at Table 1's angles, positive lift up
  Identification identified;      ///< digits taken as truncated: the constants of Table 3
  Identification at_excess_1_4;   ///< likewise with Ep = 1.4
  Identification as_rounded;      ///< digits taken as rounded
  Identification as_rounded_at_excess_1_4;
  ElevatorAudit elevator;
  std::vector<Slip> slips;
  CorrectedTable level_body;  ///< theta = 0, as in Table 1
  CorrectedTable free_pitch;  ///< theta of the closed loop's trim
  CorrectedColumn
      wake_as_printed;  ///< the climb with (3) as printed: pitch_scale 1, wake_immersion 1
  std::vector<std::string> findings;  ///< the results, one sentence each
};

/// Recomputes and audits the tables with the polars and printed numbers in `data`; the corrected
/// tables use the aircraft, gains and limits of `vehicle`.
[[nodiscard]] PaperTables paper_tables(const std::filesystem::path& data, const Vehicle& vehicle);

/// The individual parts.
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

/// (15) as printed, rows 1 and 2: theta0 and a1s, |a1s| < pi/2, for given coefficients.
struct ForceBalance {
  double theta0, a1s;
};
ForceBalance solve_forces(double thrust_excess, double k, double CL, double CD, double gamma,
                          double alpha, double eta);

}  // namespace tiltrim
