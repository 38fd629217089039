/// A trim problem in scaled unknowns and residuals. Internal to trim/.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "model/in_place.hpp"
#include "trim/trim.hpp"

namespace tiltrim {

/// The states whose rates are unconstrained in the trim.
std::vector<std::string> moving_states(const Model& model, const TrimSpec& spec);

/// Throws std::invalid_argument if the trim has limits on a signal, other than an unknown, and one
/// of these values is outside.
void check_within_limits(const TrimSpec& spec, const std::string& signal,
                         std::span<const double> values);

/// A problem's functions at a point. `finite` is false if the model returns NaN or Inf, or throws.
struct Values {
  Eigen::VectorXd y;  // [f; h]; the outputs are zero if the problem does not need them
  Eigen::VectorXd residual, limited;
  double effort = 0.0;
  bool finite = false;
};

/// The Jacobians of the problem's functions.
struct Jacobians {
  Eigen::MatrixXd residual, limited;
  Eigen::VectorXd effort;
  bool finite = false;
};

/// What the solvers see: unknowns z (each variable over its nominal size), residuals (each held
/// rate or output, minus its held value, over its nominal size), limited outputs, cost.
struct Problem {
  explicit Problem(const Model& m) : model(m) {}

  const Model& model;
  OperatingPoint base;                           // the guess, with values that bounds fix
  std::vector<Eigen::Index> unknowns;            // variables of the model
  std::vector<Eigen::Index> equations;           // rows of [f; h]
  std::vector<Eigen::Index> limited;             // rows of [f; h] with bounds
  std::vector<Eigen::Index> implied;             // rows of f that must vanish as a consequence
  Eigen::VectorXd nominal;                       // of the unknowns
  Eigen::VectorXd row_nominal;                   // of [f; h]
  Eigen::VectorXd held;                          // of the equations
  Eigen::VectorXd lower, upper;                  // of z
  Eigen::VectorXd limited_lower, limited_upper;  // of the limited rows over their nominal sizes

  struct Term {
    Eigen::Index unknown;  // position in z, or -1 for a row of [f; h]
    Eigen::Index row;
    double scale, reference;
  };
  std::vector<Term> terms;

  struct FixedTerm {
    Eigen::Index variable;
    double scale, reference;
  };
  std::vector<FixedTerm> fixed_terms;
  double fixed_effort = 0.0;  // their value

  struct FixedBound {
    Eigen::Index variable;
    Range range;
  };
  std::vector<FixedBound> fixed_bounds;  // on variables that are not free
  bool needs_outputs = false;

  mutable long evaluations = 0;
  mutable std::string thrown;                 // message of the model's first exception
  std::shared_ptr<const bool> out_of_time{};  // true after the model's time limit; null: no limit
  struct Nearest {
    Eigen::VectorXd z;
    Values values;
    double residual = std::numeric_limits<double>::infinity();
  };
  mutable Nearest nearest;  // with the smallest residual

  const InPlace* in_place = nullptr;  // f and h in one call, if the model has it

  bool notes_nearest = false;

  // Memory of the evaluations and of one solver at a time: only the first of them allocates.
  struct Memory {
    OperatingPoint at;
    Values here, next;
    Jacobians slopes;
    Eigen::VectorXd z_of_here, z_of_slopes;  // where they were evaluated last
  };
  mutable Memory memory;

  bool over() const { return out_of_time && *out_of_time; }

  Eigen::Index n() const { return std::ssize(unknowns); }
  Eigen::Index m() const { return std::ssize(equations); }
  bool square() const { return n() == m(); }
};

/// Builds the problem; `timed`: notes the point with the smallest residual. Throws
/// std::invalid_argument on invalid arguments.
Problem make_problem(const Model& model, const TrimSpec& spec, const OperatingPoint& guess,
                     bool timed = false);
/// The same in two parts: without a guess, and from a guess, with nothing known of former ones.
Problem unguessed_problem(const Model& model, const TrimSpec& spec);
void set_guess(Problem& problem, const OperatingPoint& guess);

/// The search, and the verdict on what it finds.
TrimResult solution_of(const Problem& problem, const TrimOptions& options);

Values values(const Problem& problem, const Eigen::VectorXd& z);
Jacobians jacobians(const Problem& problem, const Eigen::VectorXd& z);
/// The same in memory that is used again; `at`: values at the same z, which must be finite.
void evaluate(const Problem& problem, const Eigen::VectorXd& z, Values& values);
void differentiate(const Problem& problem, const Eigen::VectorXd& z, const Values& at,
                   Jacobians& jacobians);

/// The rates among the values; empty if the model was not evaluated.
Eigen::VectorXd rates_of(const Problem& problem, const Values& values);
/// All outputs at a point; NaN if the model throws or has no h.
Eigen::VectorXd outputs(const Problem& problem, const OperatingPoint& point);

Eigen::VectorXd unknowns_of(const Problem& problem, const OperatingPoint& point);
/// Unknowns so close that they are one solution.
bool same_solution(const Eigen::VectorXd& a, const Eigen::VectorXd& b);
OperatingPoint point_of(const Problem& problem, const Eigen::VectorXd& z);

/// "1 start", "2 starts".
std::string counted(int n, const std::string& what);

/// Unit of row i of [f; h].
std::string row_unit(const Model& model, Eigen::Index row);

/// Throws std::invalid_argument unless the value is finite and more than 0.
void check_positive(const char* name, double value);

/// Deterministic starts over the bounds: the Halton sequence, index 1, 2, ...; an unbounded unknown
/// is spread over five nominal sizes around the guess.
Eigen::VectorXd start(const Problem& problem, int index);

}  // namespace tiltrim
