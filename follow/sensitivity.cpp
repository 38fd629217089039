#include "follow/sensitivity.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <stdexcept>

#include "dense/dense.hpp"
#include "follow/linear_at.hpp"
#include "follow/path.hpp"
#include "follow/slopes_along.hpp"
#include "model/differentiate.hpp"
#include "model/lookup.hpp"
#include "runtime/rounding.hpp"
#include "trim/problem.hpp"
#include "trim/verdict.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
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
constexpr double unbounded = std::numeric_limits<double>::infinity();
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
  double error = 0.0;  // relative
};

double conditioning(const MatrixXd& A) {
  if (A.size() == 0) return 1.0;
  const VectorXd sigma = dense::singular_values(A);
  return sigma[sigma.size() - 1] / std::max(sigma[0], 1.0);
}

MatrixXd without_column(const MatrixXd& J, Index p) {
  MatrixXd left(J.rows(), J.cols() - 1);
  left << J.leftCols(p), J.rightCols(J.cols() - p - 1);
  return left;
}

// Relative error of dw/dp: that of the derivatives, and its change over the distance at which the
// true trim may lie, mostly along dw/dp if that is large. `terms`: sizes of what cancels in [f; h].
double shift_error(const Path& path, const VectorXd& y, const VectorXd& G, const MatrixXd& J,
                   const VectorXd& dw, double rcond, const VectorXd& terms) {
  constexpr double probe = 1e-6, rounding = 16 * last_digit;
  const Problem& problem = path.problem;
  const Index p = path.parameter();
  VectorXd left = G.cwiseAbs().array() + rounding * (1 + y.norm());
  left.head(problem.m()) += rounding * terms.cwiseQuotient(problem.row_nominal)(problem.equations);
  const double off = (dense::inverse(without_column(J, p)).cwiseAbs() * left).norm();
  if (dw.norm() == 0) return off;
  const double reach = std::max(off, probe);
  VectorXd beside = y, G_beside;
  const VectorXd along = reach / dw.norm() * dw;
  beside.head(p) += along.head(p);
  beside.tail(along.size() - p) += along.tail(along.size() - p);
  MatrixXd J_beside;
  if (!path.curve().evaluate(beside, G_beside, J_beside)) return unbounded;
  const VectorXd other = -dense::solve(without_column(J_beside, p), J_beside.col(p));
  return off + (other - dw).norm() / dw.norm() * off / reach + slope_error(path) / rcond;
}

Shift shift_along(const Model& model, const TrimSpec& spec, const OperatingPoint& trimmed,
                  const std::string& parameter, const std::optional<Optimum>& optimum,
                  const VectorXd& terms) {
  const Problem problem = make_problem(model, with_parameter(model, spec, parameter), trimmed);
  Path path{problem};
  path.optimal = optimum.has_value();
  if (optimum) path.held = optimum->active;
  const VectorXd y = path.start(unknowns_of(problem, trimmed));
  Shift shift{VectorXd::Zero(trimmed.x.size() + trimmed.u.size() + trimmed.p.size())};
  VectorXd G;
  MatrixXd J;
  if (!path.curve().evaluate(y, G, J)) return shift;
  // dw/dp = -(∂G/∂w)⁻¹ ∂G/∂p, w being y without the parameter
  const Index p = path.parameter();
  const MatrixXd of_unknowns = without_column(J, p);
  shift.rcond = conditioning(of_unknowns);
  if (shift.rcond < fold_below) return shift;
  shift.variables[problem.unknowns.back()] = 1.0;
  if (p == 0) return shift;  // no free variables
  const VectorXd dw = -dense::solve(of_unknowns, J.col(p));
  shift.error = shift_error(path, y, G, J, dw, shift.rcond, terms);
  for (Index k = 0; k < p; ++k)
    shift.variables[problem.unknowns[std::size_t(k)]] =
        dw[k] / problem.nominal[p] * problem.nominal[k];
  return shift;
}

// How far the eigenvectors of one mode may be off. An error E of A changes v by -S E v and wᴴ by
// -wᴴ E S, to first order; beyond it the more, the closer another eigenvalue.
struct VectorErrors {
  MatrixXcd S;           // (A - λI) S = S (A - λI) = I - v wᴴ
  VectorXd right, left;  // of A v - λ v, and of wᴴ A - λ wᴴ
  double beyond = 1.0;
};

VectorErrors vector_errors(const LinearModel& linear, const Modes& all, const Mode& m) {
  const Index n = linear.A.rows();
  const MatrixXcd shifted = linear.A - m.eigenvalue * MatrixXcd::Identity(n, n);
  MatrixXcd bordered(n + 1, n + 1);
  bordered << shifted, m.right, m.left.adjoint(), 0.0;
  const MatrixXd E = linear.A_error + 2 * double(n + 2) * last_digit * linear.A.cwiseAbs();
  VectorErrors e{dense::inverse(bordered).topLeftCorner(n, n),
                 (shifted * m.right).cwiseAbs() + E * m.right.cwiseAbs(),
                 (shifted.adjoint() * m.left).cwiseAbs() + E.transpose() * m.left.cwiseAbs()};
  for (const Mode& other : all.modes) {
    if (&other == &m) continue;
    const double gap = std::abs(m.eigenvalue - other.eigenvalue);
    const double left = gap - m.error - other.error;
    e.beyond = std::max(e.beyond, left > 0 ? gap / left : unbounded);
  }
  return e;
}

// dλ = wᴴ dA v, and the changes of damping -Re λ/|λ| and frequency |λ|.             [26, eq. 2.3]
ParameterSensitivity::ModeSensitivity mode_along(const Mode& mode, const VectorErrors& vectors,
                                                 const Estimate& dA) {
  const std::complex<double> lambda = mode.eigenvalue;
  const VectorXcd along_v = dA.value * mode.right, along_w = dA.value.transpose() * mode.left;
  const std::complex<double> d = mode.left.dot(along_v);
  const double size = std::abs(lambda);
  const double along = lambda.real() * d.real() + lambda.imag() * d.imag();
  const double rounding = 2 * double(mode.right.size() + 2) * last_digit;
  const double of_vectors = (vectors.S.adjoint() * along_w).cwiseAbs().dot(vectors.right) +
                            (vectors.S * along_v).cwiseAbs().dot(vectors.left);
  const double error = mode.left.cwiseAbs().dot((dA.error + rounding * dA.value.cwiseAbs()) *
                                                mode.right.cwiseAbs()) +
                       vectors.beyond * vectors.beyond * of_vectors;
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
  for (std::size_t i = 0; i < s.simple.size(); ++i) {
    if (s.simple[i]) continue;
    const Mode& m = s.modes.modes[i];
    names += (names.empty() ? "" : ", ") +
             (m.name.empty() ? fmt::format("{:.4g}", m.eigenvalue.real()) : m.name);
  }
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

using ModeSensitivity = ParameterSensitivity::ModeSensitivity;
const ModeSensitivity no_derivative{{nan, nan}, nan, nan, nan};

// Of a repeated eigenvalue, and at a kink of A, there is no derivative.
std::vector<ModeSensitivity> modes_along(const Model& model, const Sensitivities& of,
                                         const std::vector<VectorErrors>& errors,
                                         const Shift& shift) {
  SlopesAlong A = jacobians_along(model, of.point, shift.variables);
  std::vector<ModeSensitivity> all;
  for (std::size_t k = 0; k < of.modes.modes.size(); ++k) {
    const Mode& m = of.modes.modes[k];
    const auto judge = [&](int i) -> Judged {
      const SlopesAlong::Level& l = A.level(i);
      const auto seen = [&m](const MatrixXd& dA) { return m.left.dot(dA * m.right); };
      const Slopes<MatrixXd>& s = l.slopes;
      const double noise = m.left.cwiseAbs().dot(l.noise * m.right.cwiseAbs());
      return {doubt({seen(s.near), seen(s.far), seen(s.bend), seen(s.far_bend)}, noise),
              std::abs(seen(s.near))};
    };
    const auto at = of.simple[k] ? settled(judge) : std::nullopt;
    all.push_back(no_derivative);
    if (!at) continue;
    Estimate dA = jacobian_slope(model, A.level(at->level), at->level);
    dA.error += shift.error * dA.value.cwiseAbs();
    all.back() = mode_along(m, errors[k], dA);
    all.back().error += at->doubt;
  }
  return all;
}

// What has no derivative along a parameter although neither a fold nor a repeated eigenvalue is the
// reason, as text; otherwise empty.
std::string missing(const Sensitivities& of, const ParameterSensitivity& along,
                    const Signals& outputs) {
  std::string names;
  const auto add = [&](const std::string& name) { names += (names.empty() ? "" : ", ") + name; };
  for (std::size_t i = 0; i < outputs.size(); ++i)
    if (!std::isfinite(along.outputs[Index(i)])) add(outputs[i].name);
  for (std::size_t k = 0; k < along.modes.size(); ++k) {
    const Mode& m = of.modes.modes[k];
    if (of.simple[k] && m.eigenvalue.imag() >= 0 && std::isnan(along.modes[k].eigenvalue.real()))
      add(m.name.empty() ? fmt::format("{:.4g}", m.eigenvalue.real()) : m.name);
  }
  return names.empty() ? names : fmt::format("{} along {}", names, along.parameter.name);
}

const char* const at_kinks = "no derivatives at a kink of the model, or at an end of its domain: ";

// What is common to all parameters.
struct Trimmed {
  const Model& model;
  const Problem& problem;
  const LinearModel& linear;
  const MatrixXd& J;      // of [f; h]
  const VectorXd& terms;  // sizes of what cancels in [f; h]
  std::vector<VectorErrors> errors;
};

ParameterSensitivity along_parameter(const Trimmed& t, const Sensitivities& of, Index j,
                                     const Shift& shift) {
  const Index nx = of.point.x.size(), ny = std::ssize(t.model.outputs);
  ParameterSensitivity one{signal_of(t.model, j), value_of(of.point, j), {}, {}, {}, {}};
  VectorXd variables = shift.variables, rates = t.J * variables;
  SlopesAlong y = rates_along(t.model, of.point, shift.variables, t.terms);
  const VectorXd sizes = t.J.cwiseAbs() * variables.cwiseAbs();
  const bool exists = std::ranges::all_of(
      t.problem.equations, [&](Index row) { return row_settles(y, row, sizes[row], true); });
  for (Index row = nx; row < nx + ny; ++row)
    if (!exists || !row_settles(y, row, sizes[row], false)) rates[row] = nan;
  if (!exists) variables.setConstant(nan);
  one.x = variables.head(nx);
  one.u = variables.segment(nx, of.point.u.size());
  one.outputs = rates.tail(ny);
  if (t.linear && exists) one.modes = modes_along(t.model, of, t.errors, shift);
  if (t.linear && !exists) one.modes.assign(of.modes.modes.size(), no_derivative);
  return one;
}

std::vector<Index> every_variable(const OperatingPoint& at) {
  std::vector<Index> all(std::size_t(at.x.size() + at.u.size() + at.p.size()));
  std::iota(all.begin(), all.end(), 0);
  return all;
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

  const LinearModel linear = linear_at(model, spec, trimmed);
  if (linear) result.modes = modes(linear);
  result.simple = isolated(result.modes);
  const MatrixXd J = jacobian(model, trimmed, every_variable(trimmed));
  const VectorXd terms = J.cwiseAbs() * sizes_at(model, trimmed);
  Trimmed of{model, problem, linear, J, terms, {}};
  for (const Mode& m : result.modes.modes)
    of.errors.push_back(vector_errors(linear, result.modes, m));
  std::string kinks;
  bool any = names.empty();
  for (const std::string& name : names) {
    const Shift shift = shift_along(model, spec, trimmed, name, optimum, terms);
    result.rcond = shift.rcond;
    if (shift.rcond < fold_below)
      return refused(SensitivityStatus::singular,
                     fmt::format("the trim is at a fold, or the equations leave a direction free "
                                 "(rcond {:.1e}): it has no derivative with respect to {}",
                                 shift.rcond, name));
    ParameterSensitivity one = along_parameter(of, result, variable(model, name), shift);
    const bool exists = one.x.allFinite() && one.u.allFinite();
    if (exists)
      if (std::string why = not_implied(problem, J, shift.variables, name); !why.empty())
        return refused(SensitivityStatus::not_implied, why);
    const std::string none =
        exists ? missing(result, one, model.outputs) : "the trim along " + name;
    if (!none.empty()) kinks += (kinks.empty() ? "" : "; ") + none;
    any = any || exists;
    result.parameters.push_back(std::move(one));
  }
  if (!any) return refused(SensitivityStatus::singular, at_kinks + kinks);
  result.status = linear ? SensitivityStatus::found : SensitivityStatus::no_linear;
  result.message = linear ? repeated(result) : "no linear model: " + linear.message;
  if (!kinks.empty()) result.message += (result.message.empty() ? "" : "; ") + (at_kinks + kinks);
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
