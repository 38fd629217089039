#include "follow/sensitivity.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

#include "dense/dense.hpp"
#include "follow/path.hpp"
#include "linearize/linearize.hpp"
#include "model/differentiate.hpp"
#include "model/lookup.hpp"
#include "runtime/rounding.hpp"
#include "trim/problem.hpp"
#include "trim/verdict.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

std::string to_string(SensitivityStatus status) {
  switch (status) {
    case SensitivityStatus::found:
      return "found";
    case SensitivityStatus::not_trim:
      return "not_trim";
    case SensitivityStatus::not_implied:
      return "not_implied";
    case SensitivityStatus::singular:
      return "singular";
    case SensitivityStatus::no_linear:
      return "no_linear";
  }
  return "unknown";
}

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double fold_below = 1e-8;  // rcond: half of a derivative's digits are lost

std::vector<std::string> all_parameters(const Model& model, const TrimSpec& spec) {
  std::vector<std::string> left;
  for (const Signal& s : model.parameters)
    if (std::ranges::find(spec.free, s.name) == spec.free.end()) left.push_back(s.name);
  return left;
}

// Throws on those that the model does not have, that are free, and that stand there twice.
void check_names(const Model& model, const TrimSpec& spec, const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    with_parameter(model, spec, name);
    if (std::ranges::count(names, name) > 1)
      throw std::invalid_argument(fmt::format("'{}' is listed twice as a parameter", name));
  }
}

// Derivatives of all model variables with respect to the parameter, and their conditioning.
struct Shift {
  VectorXd variables;
  double rcond = 0.0;
};

double conditioning(const MatrixXd& A) {
  if (A.size() == 0) return 1.0;
  const VectorXd sigma = dense::singular_values(A);
  return sigma[sigma.size() - 1] / std::max(sigma[0], 1.0);
}

Shift shift_along(const Model& model, const TrimSpec& spec, const OperatingPoint& trimmed,
                  const std::string& parameter, const std::optional<Optimum>& optimum) {
  const Problem problem = make_problem(model, with_parameter(model, spec, parameter), trimmed);
  Path path{problem};
  path.optimal = optimum.has_value();
  if (optimum) path.held = optimum->active;
  const VectorXd y = path.start(unknowns_of(problem, trimmed));
  Shift shift{VectorXd::Zero(trimmed.x.size() + trimmed.u.size() + trimmed.p.size()), 0.0};
  VectorXd G;
  MatrixXd J;
  if (!path.curve().evaluate(y, G, J)) return shift;
  // dw/dp = -(∂G/∂w)⁻¹ ∂G/∂p, w being y without the parameter
  const Index p = path.parameter(), after = y.size() - p - 1;
  MatrixXd of_unknowns(J.rows(), J.cols() - 1);
  of_unknowns << J.leftCols(p), J.rightCols(after);
  shift.rcond = conditioning(of_unknowns);
  if (shift.rcond < fold_below) return shift;
  shift.variables[problem.unknowns.back()] = 1.0;
  if (p == 0) return shift;  // no free variables
  const VectorXd dw = -dense::solve(of_unknowns, J.col(p)) / problem.nominal[p];
  for (Index k = 0; k < p; ++k)
    shift.variables[problem.unknowns[std::size_t(k)]] = dw[k] * problem.nominal[k];
  return shift;
}

VectorXd all_nominals(const Model& model) {
  VectorXd all(std::ssize(model.states) + std::ssize(model.inputs) + std::ssize(model.parameters));
  all << nominals(model.states), nominals(model.inputs), nominals(model.parameters);
  return all;
}

OperatingPoint moved(const OperatingPoint& from, const VectorXd& by) {
  OperatingPoint to = from;
  to.x += by.head(from.x.size());
  to.u += by.segment(from.x.size(), from.u.size());
  to.p += by.tail(from.p.size());
  return to;
}

// dA along a direction of all variables: central differences of exact Jacobians, and their change
// when the step is doubled.
struct Directional {
  MatrixXd value, error;
};

Directional jacobian_along(const Model& model, const OperatingPoint& at,
                           const VectorXd& direction) {
  // Relative to nominal size: truncation and round-off are both small. Jacobians by finite
  // differences carry noise that a short step would amplify.
  const double h = model.derivatives ? 1e-5 : 5e-4;
  std::vector<Index> states;
  for (Index i = 0; i < at.x.size(); ++i) states.push_back(i);
  VectorXd size(direction.size());
  size << at.x, at.u, at.p;
  size = size.cwiseAbs().cwiseMax(all_nominals(model));
  const double step = h / direction.cwiseQuotient(size).lpNorm<Eigen::Infinity>();
  const auto A = [&](double t) -> MatrixXd {
    return jacobian(model, moved(at, t * direction), states).topRows(at.x.size());
  };
  const auto slope = [&](double t) -> MatrixXd { return (A(t) - A(-t)) / (2 * t); };
  const MatrixXd near = slope(step);
  return {near, (near - slope(2 * step)).cwiseAbs()};
}

// dλ = wᴴ dA v, and the changes of damping -Re λ/|λ| and frequency |λ|.             [26, eq. 2.3]
ParameterSensitivity::ModeSensitivity mode_along(const Mode& mode, const Directional& dA) {
  const std::complex<double> lambda = mode.eigenvalue;
  const std::complex<double> d = mode.left.dot(dA.value * mode.right);
  const double size = std::abs(lambda);
  const double along = lambda.real() * d.real() + lambda.imag() * d.imag();
  const double error = mode.left.cwiseAbs().dot(dA.error * mode.right.cwiseAbs());
  if (size == 0) return {d, nan, nan, error};
  return {d, -d.real() / size + lambda.real() * along / (size * size * size), along / size, error};
}

// An eigenvalue close to another is not differentiable by itself.
std::vector<bool> isolated(const Modes& all) {
  constexpr double apart = 1e-6;  // relative: digits of the derivative lost to the neighbour
  std::vector<bool> simple;
  for (const Mode& m : all.modes) {
    double gap = std::numeric_limits<double>::infinity();
    for (const Mode& other : all.modes)
      if (&other != &m) gap = std::min(gap, std::abs(m.eigenvalue - other.eigenvalue));
    simple.push_back(m.determined && gap > apart * (1 + std::abs(m.eigenvalue)) + 2 * m.error);
  }
  return simple;
}

std::string repeated(const Sensitivities& s) {
  std::string names;
  for (std::size_t i = 0; i < s.simple.size(); ++i)
    if (!s.simple[i]) names += (names.empty() ? "" : ", ") + s.modes.modes[i].name;
  return names.empty() ? "" : "repeated eigenvalues have no derivatives: " + names;
}

}  // namespace

namespace {

// Why the point is not a trim of the spec, as text; otherwise empty. An optimum is returned with
// its active limits.
std::string no_trim(const Problem& p, const VectorXd& z, std::optional<Optimum>& optimum) {
  constexpr double far = 1e-6;  // scaled
  const Values v = values(p, z);
  if (!v.finite || (v.residual.size() > 0 && v.residual.lpNorm<Eigen::Infinity>() > far))
    return "the point is not a trim: the rates do not vanish there";
  if (excess(z, p.lower, p.upper) > far ||
      excess(v.limited, p.limited_lower, p.limited_upper) > far)
    return "the point is not a trim: it lies outside the limits";
  for (const Index row : p.implied)
    if (std::abs(v.y[row]) > far * p.row_nominal[row])
      return "the point is not a trim: a rate that should vanish with the equations does not";
  if (p.square()) return {};
  optimum = polish_optimum(p, z, {});
  if (!optimum->verified || (optimum->z - z).lpNorm<Eigen::Infinity>() > far)
    return "the point is not proved to be the trim of least effort";
  return {};
}

// A limit that is touched with a zero multiplier: active on one side, inactive on the other, so
// that the trim has a kink.
bool has_kink(const Problem& p, const VectorXd& z, const std::optional<Optimum>& optimum) {
  constexpr double touched = 1e-9;
  if (!optimum) return false;
  const Values v = values(p, z);
  const auto lies_on = [&](const VectorXd& at, const VectorXd& lower, const VectorXd& upper) {
    return ((at - lower).array().abs() <= touched || (upper - at).array().abs() <= touched).count();
  };
  const Index on =
      lies_on(z, p.lower, p.upper) + lies_on(v.limited, p.limited_lower, p.limited_upper);
  const Index held = std::ssize(optimum->active.unknowns) + std::ssize(optimum->active.limited);
  const auto multipliers = optimum->lambda.tail(held).cwiseAbs().array();
  return on != held || (multipliers <= touched).any();
}

// An implied rate must also stay zero along the shift.
std::string not_implied(const Problem& p, const MatrixXd& J, const VectorXd& shift,
                        const std::string& parameter) {
  constexpr double vanishes = 1e-6;
  for (const Index row : p.implied)
    if (std::abs(J.row(row).dot(shift)) >
        vanishes * J.row(row).cwiseAbs().dot(shift.cwiseAbs()) + vanishes * p.row_nominal[row])
      return fmt::format(
          "no trim with a changed {}: {} would not vanish (a variable that {} should move is at "
          "its limit)",
          parameter, row_name(p.model, row), parameter);
  return {};
}

}  // namespace

Sensitivities sensitivities(const Model& model, const TrimSpec& spec, const OperatingPoint& trimmed,
                            const std::vector<std::string>& parameters) {
  const RoundToNearest environment;
  const std::vector<std::string> names =
      parameters.empty() ? all_parameters(model, spec) : parameters;
  check_names(model, spec, names);
  Sensitivities result;
  result.point = trimmed;
  const auto refused = [&](SensitivityStatus status, std::string why) {
    result.status = status;
    result.message = std::move(why);
    result.parameters.clear();
    return result;
  };
  const Problem problem = make_problem(model, spec, trimmed);
  const VectorXd z = unknowns_of(problem, trimmed);
  std::optional<Optimum> optimum;
  if (std::string why = no_trim(problem, z, optimum); !why.empty())
    return refused(SensitivityStatus::not_trim, why);
  if (has_kink(problem, z, optimum))
    return refused(SensitivityStatus::singular,
                   "the trim lies exactly where a limit becomes active: it has a kink there and no "
                   "derivative");

  std::vector<Index> variables;
  for (Index j = 0; j < trimmed.x.size() + trimmed.u.size() + trimmed.p.size(); ++j)
    variables.push_back(j);
  const LinearModel linear = linearize(model, trimmed, {.moving = moving_states(model, spec)});
  if (linear) result.modes = modes(linear);
  result.simple = isolated(result.modes);
  const MatrixXd J = jacobian(model, trimmed, variables);
  for (const std::string& name : names) {
    const Shift shift = shift_along(model, spec, trimmed, name, optimum);
    result.rcond = shift.rcond;
    if (shift.rcond < fold_below)
      return refused(SensitivityStatus::singular,
                     fmt::format("the trim is at a fold, or the equations leave a direction free "
                                 "(rcond {:.1e}): it has no derivative with respect to {}",
                                 shift.rcond, name));
    if (std::string why = not_implied(problem, J, shift.variables, name); !why.empty())
      return refused(SensitivityStatus::not_implied, why);
    const Index j = variable(model, name);
    ParameterSensitivity one{signal_of(model, j), value_of(trimmed, j), {}, {}, {}, {}};
    one.x = shift.variables.head(trimmed.x.size());
    one.u = shift.variables.segment(trimmed.x.size(), trimmed.u.size());
    one.outputs = (J * shift.variables).tail(std::ssize(model.outputs));
    if (linear) {
      const Directional dA = jacobian_along(model, trimmed, shift.variables);
      for (std::size_t i = 0; i < result.modes.modes.size(); ++i)
        one.modes.push_back(result.simple[i]
                                ? mode_along(result.modes.modes[i], dA)
                                : ParameterSensitivity::ModeSensitivity{{nan, nan}, nan, nan, nan});
    }
    result.parameters.push_back(std::move(one));
  }
  result.status = linear ? SensitivityStatus::found : SensitivityStatus::no_linear;
  result.message = linear ? repeated(result) : "no linear model: " + linear.message;
  return result;
}

std::vector<std::size_t> Sensitivities::ranked(std::size_t mode) const {
  const bool oscillates = modes.modes.at(mode).eigenvalue.imag() != 0;
  std::vector<std::size_t> order(parameters.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  const auto effect = [&](std::size_t i) {
    const ParameterSensitivity& p = parameters[i];
    const double change = p.value != 0 ? p.value : p.parameter.nominal;
    const ParameterSensitivity::ModeSensitivity& m = p.modes.at(mode);
    const double moved = change * (oscillates ? m.damping : m.eigenvalue.real());
    return std::isfinite(moved) ? -std::abs(moved) : 0.0;
  };
  std::ranges::stable_sort(order, {}, effect);
  return order;
}

}  // namespace tiltrim
