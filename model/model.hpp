/// @file
/// The seam between vehicles and algorithms: functions of named signals. Names, units and sizes
/// travel with every vector.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

/// All of the library.
namespace tiltrim {

/// One component of a state, input, output or parameter vector. SI units, radians.
struct Signal {
  std::string name;      ///< found by it everywhere
  std::string unit;      ///< in words, "m/s"; empty: none
  double nominal = 1.0;  ///< a change that matters: the scale of steps, norms and rank tests; > 0
};

using Signals = std::vector<Signal>;  ///< of one vector, in its order

/// States, inputs or outputs that a model may have: every method here works with full matrices.
inline constexpr std::size_t largest_model = 2000;

/// A closed range [lower, upper]; unbounded by default.
struct Range {
  double lower = -std::numeric_limits<double>::infinity();  ///< belongs to it
  double upper = std::numeric_limits<double>::infinity();   ///< belongs to it
};

/// A parameter that may be anywhere between two values, in SI units.
struct Uncertain {
  std::string name;                 ///< the models' signal, "aircraft.mass"
  double lower = 0.0, upper = 0.0;  ///< both may be
};

/// One term of the objective that decides where there are more unknowns than equations:
/// ((signal - reference) / scale)². The signal is a variable or an output of the model.
struct CostTerm {
  std::string signal;      ///< its name
  double scale = 1.0;      ///< in its unit; not zero
  double reference = 0.0;  ///< in its unit
};

/// Position of `name` in `signals`, or -1.
Eigen::Index find(const Signals& signals, std::string_view name);

/// Position of `name`; throws std::invalid_argument with the real names if there is none.
/// `kind` says in the message what was looked for ("state", "input", ...).
Eigen::Index index_of(const Signals& signals, std::string_view name, std::string_view kind);

/// The candidate nearest to `name` in edit distance; empty if none comes near.
std::string nearest_name(std::string_view name, const std::vector<std::string>& candidates);

/// Names and nominal sizes, in order.
std::vector<std::string> names(const Signals& signals);
Eigen::VectorXd nominals(const Signals& signals);  ///< one for each, in its unit

/// A function of state x, input u and parameters p.
using Function = std::function<Eigen::VectorXd(const Eigen::VectorXd& x, const Eigen::VectorXd& u,
                                               const Eigen::VectorXd& p)>;

/// A point at which a model is evaluated: state x, input u, parameters p (SI, radians).
struct OperatingPoint {
  Eigen::VectorXd x, u, p;  ///< one value for each state, input, parameter
};

/// A classical name for a mode, given where the states that carry it hold most of its share.
struct ModeName {
  std::string name;                 ///< "phugoid"
  std::vector<std::string> states;  ///< each must take part
  bool oscillation = false;         ///< of complex pairs alone
};
/// The names that a vehicle's modes can have, tried in order; null: modes are called by their
/// states.
using ModeNames = std::shared_ptr<const std::vector<ModeName>>;

/// ẋ = f(x, u, p),  y = h(x, u, p). Fill it in and every verb works on it.
///
/// The variables of a model are counted through x, then u, then p: variable j is state j, input
/// j - nx, or parameter j - nx - nu. Derivatives address any of them through that one number.
struct Model {
  std::string name;                             ///< in messages
  Signals states, inputs, outputs, parameters;  ///< of the vectors x, u, y, p
  Function f;  ///< state rates, one per state; must be a function of its arguments alone
  Function h;  ///< outputs, one per output; may be empty if there are none

  /// Optional exact derivatives: ∂[f; h]/∂(variables[k]) in column k, (nx + ny) rows.
  std::function<Eigen::MatrixXd(const OperatingPoint&, const std::vector<Eigen::Index>& variables)>
      derivatives;

  /// Optional enclosure: ranges that contain every value of [f; h] over a box of variables
  /// (one Range per variable, fixed ones of width zero). With it trim() can show that there is no
  /// equilibrium, instead of not having found one.
  std::function<std::vector<Range>(const std::vector<Range>& box)> enclosure;

  /// Optional switching functions: the model has a kink or a jump where one of them is zero.
  struct Switch {
    std::string name;                                       ///< what happens there
    std::function<double(const OperatingPoint&)> distance;  ///< signed, zero at the kink
  };
  std::vector<Switch> switches;  ///< empty: none is known

  /// Optional structure: at equilibria that differ in these parameters alone, the outputs stay,
  /// ∂f/∂x is affine in each φ(p) with the others held, and a state that is an equilibrium for two
  /// values of φ is one for all between. A sweep then differentiates at three points of a line.
  struct Affine {
    std::string parameter;  ///< its name
    /// φ at these parameters; nothing where the structure does not hold.
    std::function<std::optional<double>(const Eigen::VectorXd& p)> phi;
  };
  std::vector<Affine> affine;  ///< empty: none is known

  ModeNames mode_names{};  ///< of its linear models
};

/// The caller's mistake, met while a model is being called: told apart from what the model throws.
struct CallerMistake : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

/// What a model gives at a point.
struct Evaluation {
  Eigen::VectorXd rates;    ///< ẋ
  Eigen::VectorXd outputs;  ///< y
};
/// Rates and outputs at a point, sizes checked: throws CallerMistake naming both sizes if a
/// vector does not fit the model or the model's answer does not fit its own signals.
Evaluation evaluate(const Model& model, const OperatingPoint& point);

/// Throws CallerMistake, which names the model and both sizes, where f's answer does not fit.
void check_rates(const Model& model, const Eigen::VectorXd& rates);
/// The same of h.
void check_outputs(const Model& model, const Eigen::VectorXd& outputs);
/// The same of `derivatives`, along so many variables.
void check_derivatives(const Model& model, const Eigen::MatrixXd& J, std::size_t variables);

/// A variable of the model found by name among states, inputs and parameters, in that order.
/// Throws std::invalid_argument with the nearest and all real names if there is none.
Eigen::Index variable(const Model& model, std::string_view name);
/// The signal behind a variable's number.
const Signal& signal_of(const Model& model, Eigen::Index variable);
/// A variable of the point, by its number.
double value_of(const OperatingPoint& point, Eigen::Index variable);
/// Writes it.
void set_value(OperatingPoint& point, Eigen::Index variable, double value);

/// Throws std::invalid_argument if the model cannot be used: no f, a name twice, a nominal size
/// that is not positive and finite.
void check(const Model& model);
/// Throws std::invalid_argument if the point's sizes do not fit or a value is not finite.
void check(const Model& model, const OperatingPoint& point);

}  // namespace tiltrim
