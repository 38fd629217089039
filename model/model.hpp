/// @file
/// The interface between vehicles and algorithms: functions of named signals. Names, units and
/// nominal sizes belong to every vector.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// The tiltrim library.
namespace tiltrim {

/// One component of a state, input, output or parameter vector. SI units, radians.
struct Signal {
  std::string name;      ///< used for every lookup
  std::string unit;      ///< as text, "m/s"; empty: dimensionless
  double nominal = 1.0;  ///< a significant change: the scale of steps, norms and rank tests; > 0
};

struct Jet;                           // a range with derivatives: model/jet.hpp
using Signals = std::vector<Signal>;  ///< the signals of one vector, in order

/// A closed range [lower, upper]; unbounded by default.
struct Range {
  double lower = -std::numeric_limits<double>::infinity();  ///< included
  double upper = std::numeric_limits<double>::infinity();   ///< included
};

/// A parameter that varies between two bounds, in SI units.
struct Uncertain {
  std::string name;                 ///< name in the model, "aircraft.mass"
  double lower = 0.0, upper = 0.0;  ///< bounds, included
};

/// One term of the objective that selects a solution if there are more unknowns than equations:
/// ((signal - reference) / scale)². The signal is a variable or an output of the model.
struct CostTerm {
  std::string signal;      ///< its name
  double scale = 1.0;      ///< in the signal's unit; not zero
  double reference = 0.0;  ///< in the signal's unit
};

/// Position of `name` in `signals`, or -1.
Eigen::Index find(const Signals& signals, std::string_view name);

/// Names, in order.
std::vector<std::string> names(const Signals& signals);

/// A point at which a model is evaluated: state x, input u, parameters p (SI, radians).
struct OperatingPoint {
  Eigen::VectorXd x, u, p;  ///< one value per state, input, parameter
};

/// A classical mode name, used if the listed states have most of the participation.
struct ModeName {
  std::string name;                  ///< "phugoid"
  std::vector<std::string> states;   ///< each must participate
  bool oscillation = false;          ///< complex pairs only
  std::vector<std::string> among{};  ///< states that the model must have as well
};
/// ẋ = f(x, u, p),  y = h(x, u, p). All analyses work on any such model.
///
/// The variables of a model are numbered through x, then u, then p: variable j is state j, input
/// j - nx, or parameter j - nx - nu. Derivatives address any of them by this number.
struct Model {
  std::string name;                             ///< used in messages
  Signals states, inputs, outputs, parameters;  ///< of the vectors x, u, y, p
  /// State rates, one per state; must depend only on its arguments.
  std::function<Eigen::VectorXd(const Eigen::VectorXd& x, const Eigen::VectorXd& u,
                                const Eigen::VectorXd& p)>
      f;
  decltype(f) h;  ///< outputs, one per output; may be empty if there are no outputs

  /// Optional exact derivatives: ∂[f; h]/∂(variables[k]) in column k, (nx + ny) rows.
  std::function<Eigen::MatrixXd(const OperatingPoint&, const std::vector<Eigen::Index>& variables)>
      derivatives;

  /// Optional enclosure: ranges that contain every value of [f; h] over a box of variables
  /// (one Range per variable, fixed ones of width zero). With it trim() can prove that no
  /// equilibrium exists.
  std::function<std::vector<Range>(const std::vector<Range>& box)> enclosure;

  /// Optional, for proofs: [f; h] on ranges with first and second derivatives.
  std::function<std::vector<Jet>(const std::vector<Jet>& x, const std::vector<Jet>& u,
                                 const std::vector<Jet>& p)>
      jets;

  /// Optional switching functions: the model has a kink or a jump where one of them is zero.
  struct Switch {
    std::string name;                                       ///< what happens at the switch
    std::function<double(const OperatingPoint&)> distance;  ///< signed, zero at the kink
  };
  std::vector<Switch> switches;  ///< empty if not known

  /// Optional structure: at equilibria that differ only in these parameters, the outputs are equal,
  /// ∂f/∂x is affine in each φ(p) with the others held constant, and a state that is an equilibrium
  /// for two values of φ is one for all between. A sweep then differentiates at only three points.
  struct Affine {
    std::string parameter;  ///< its name
    /// φ at these parameters; empty where the structure does not hold.
    std::function<std::optional<double>(const Eigen::VectorXd& p)> phi;
  };
  std::vector<Affine> affine;  ///< empty if not known

  /// For its linear models, tried in order; null: modes are named after their dominant states.
  std::shared_ptr<const std::vector<ModeName>> mode_names{};

  /// Number of points that `lanes` evaluates together.
  static constexpr std::size_t model_lanes = 8;

  /// Optional, for sweeps: [f; h] at `model_lanes` points at once in SIMD lanes, and its
  /// derivatives with respect to states or inputs. Variable j of point k is z[j * model_lanes + k];
  /// row i of point k goes to values[i * model_lanes + k] and its derivative with respect to
  /// variables[c] to slopes[(c * rows + i) * model_lanes + k], unless slopes is null. The numbers
  /// are those of f, h and derivatives to rounding; those of a point depend on that point only, not
  /// on the instruction set, and are NaN where f or h throws. Must not throw.
  std::function<void(const double* z, const std::vector<Eigen::Index>& variables, double* values,
                     double* slopes)>
      lanes{};
};

/// A matrix and an estimated error bound for each entry.
struct Estimate {
  Eigen::MatrixXd value, error;  ///< of the same size; error >= 0
};

/// The rates and outputs of a model at a point.
struct Evaluation {
  Eigen::VectorXd rates;    ///< ẋ
  Eigen::VectorXd outputs;  ///< y
};
/// Rates and outputs at a point. Throws std::invalid_argument with both sizes if a vector does not
/// fit the model or the returned vectors do not fit the model's signals.
Evaluation evaluate(const Model& model, const OperatingPoint& point);

/// The point with these values by name, in each signal's unit; all others are zero. Throws
/// std::invalid_argument with the nearest name and all valid names for an unknown name.
OperatingPoint point_of(const Model& model, const std::map<std::string, double>& values);
/// The point with these values changed. Throws as point_of(), and std::invalid_argument if the
/// point's vectors do not fit the model.
OperatingPoint changed(const Model& model, OperatingPoint point,
                       const std::map<std::string, double>& values);
/// The value of the state, input or parameter of this name. Throws as changed().
double value_of(const Model& model, const OperatingPoint& point, std::string_view name);

}  // namespace tiltrim
