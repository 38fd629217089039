#include "sweep/neighbour.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <new>

#include "dense/dense.hpp"
#include "model/differentiate.hpp"
#include "model/lookup.hpp"
#include "model/time_limit.hpp"
#include "trim/verdict.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int max_steps = 40;       // of Newton: quadratic convergence except near a fold
constexpr double diverging = 1e6;   // nominal sizes: the integral of a small gain may be large
constexpr double same_trim = 1e-6;  // scaled: unknowns that differ by less are one equilibrium

// Residuals of the trim's equations, scaled; `outputs` is filled if an equation needs one.
template <class Vector = VectorXd>
Vector residuals(const Prepared& s, const VectorXd& rates, const VectorXd& outputs) {
  const Problem& p = s.problem;
  Vector r(p.m());
  for (Index i = 0; i < p.m(); ++i) {
    const Index row = p.equations[std::size_t(i)];
    const double y = row < s.states() ? rates[row] : outputs[row - s.states()];
    r[i] = (y - p.held[i]) / p.row_nominal[row];
  }
  return r;
}

// The equations' Jacobian in nominal sizes, factorized, from the derivatives along states and
// unknowns; empty if it is singular.
template <class Matrix>
std::optional<dense::LU<Matrix>> factored(const Prepared& s, const MatrixXd& slopes) {
  const Problem& p = s.problem;
  Matrix J(p.m(), p.n());
  for (Index k = 0; k < p.n(); ++k)
    for (Index i = 0; i < p.m(); ++i) {
      const Index row = p.equations[std::size_t(i)];
      J(i, k) = slopes(row, s.unknowns[std::size_t(k)]) * p.nominal[k] / p.row_nominal[row];
    }
  std::optional<dense::LU<Matrix>> lu = dense::lu(J);
  const auto pivots = lu->pivots().cwiseAbs();
  constexpr double singular = 1e-11;  // left to a full trim, which diagnoses it
  if (!(pivots.minCoeff() > singular * std::max(1.0, pivots.maxCoeff()))) return {};
  return lu;
}

// The Newton step in nominal sizes; empty if singular.
VectorXd step(const Prepared& s, const MatrixXd& slopes, const VectorXd& r) {
  if (s.problem.n() <= dense::small_size) {
    const auto lu = factored<dense::SmallMatrix>(s, slopes);
    return lu ? VectorXd(dense::solve(*lu, -dense::SmallVector(r))) : VectorXd();
  }
  const auto lu = factored<MatrixXd>(s, slopes);
  return lu ? VectorXd(dense::solve(*lu, -r)) : VectorXd();
}

template <class Vector>
void add(const Prepared& s, const Vector& dz, OperatingPoint& at) {
  for (Index k = 0; k < dz.size(); ++k) {
    const Index j = s.problem.unknowns[std::size_t(k)];
    set_value(at, j, value_of(at, j) + dz[k] * s.problem.nominal[k]);
  }
}

std::string outside_in_words(const std::string& name, const std::string& unit, double value,
                             double lower, double upper) {
  const bool above = value > upper;
  return fmt::format("{} would be {} its {} limit {:.6g}{}{}", name, above ? "above" : "below",
                     above ? "upper" : "lower", above ? upper : lower, unit.empty() ? "" : " ",
                     unit);
}

// Checks limits and implied rates at a point that satisfies the equations.
bool keeps_limits(const Prepared& s, const VectorXd& rates, GridTrim& e) {
  const Problem& p = s.problem;
  for (Index k = 0; k < p.n(); ++k) {
    const Index j = p.unknowns[std::size_t(k)];
    const double z = value_of(e.at, j) / p.nominal[k];
    if (z >= p.lower[k] - bound_slack && z <= p.upper[k] + bound_slack) continue;
    const Signal& signal = signal_of(s.model(), j);
    e.message = outside_in_words(signal.name, signal.unit, z * p.nominal[k],
                                 p.lower[k] * p.nominal[k], p.upper[k] * p.nominal[k]);
    return false;
  }
  for (std::size_t i = 0; i < p.limited.size(); ++i) {
    const Index row = p.limited[i];
    const double size = p.row_nominal[row];
    const double y = (row < s.states() ? rates[row] : e.outputs[row - s.states()]) / size;
    const double lower = p.limited_lower[Index(i)], upper = p.limited_upper[Index(i)];
    if (y >= lower - bound_slack && y <= upper + bound_slack) continue;
    e.message = outside_in_words(row_name(s.model(), row), row_unit(s.model(), row), y * size,
                                 lower * size, upper * size);
    return false;
  }
  for (const Index row : p.implied)
    if (!(std::abs(rates[row]) <= s.trimming.tolerance * p.row_nominal[row])) {
      e.message = fmt::format("{} does not vanish", row_name(s.model(), row));
      return false;
    }
  return true;
}

VectorXd outputs_of(const Model& m, const OperatingPoint& at) {
  return m.h ? m.h(at.x, at.u, at.p) : VectorXd();
}

// A Jacobian is reused while steps are small and decrease by a factor of a hundred.
template <class Matrix, class Vector>
bool newton(const Prepared& s, GridTrim& e) {
  constexpr double fast = 0.01, near = 1e-3;
  const Model& m = s.model();
  double before = std::numeric_limits<double>::infinity();
  std::optional<dense::LU<Matrix>> lu;
  for (int i = 0; i < max_steps; ++i) {
    const VectorXd rates = m.f(e.at.x, e.at.u, e.at.p);
    if (s.output_equations) e.outputs = outputs_of(m, e.at);
    const Vector r = residuals<Vector>(s, rates, e.outputs);
    e.residual = r.template lpNorm<Eigen::Infinity>();
    Vector dz;
    if (lu) {
      dz = dense::solve(*lu, -r);
      if (!(dz.template lpNorm<Eigen::Infinity>() <= fast * before)) lu.reset();
    }
    const bool here = !lu;
    if (here) {
      e.slopes = jacobian(m, e.at, s.along, &e.exact);
      lu = factored<Matrix>(s, e.slopes);
      if (!lu) return false;
      dz = dense::solve(*lu, -r);
    }
    const double size = dz.template lpNorm<Eigen::Infinity>();
    const bool small = e.residual <= s.trimming.tolerance && size <= s.trimming.step_tolerance;
    if (small && (size <= step_at_rest || size >= 0.5 * before)) {
      e.status = TrimStatus::converged;
      if (!here) e.slopes = jacobian(m, e.at, s.along, &e.exact);
      e.outputs = outputs_of(m, e.at);
      return rates.allFinite() && e.outputs.allFinite() && keeps_limits(s, rates, e);
    }
    if (!(size < diverging)) return false;
    if (size > near) lu.reset();
    before = size;
    add(s, dz, e.at);
  }
  return false;
}

}  // namespace

// Message for an equilibrium without a linear model, such as rest in body axes.
static std::string missing_model(const Prepared& s, const GridTrim& e) {
  const bool finite = e.slopes.topLeftCorner(s.states(), s.states()).allFinite();
  return finite ? "" : "an equilibrium without a linear model: a derivative is not finite there";
}

bool settle(const Prepared& s, GridTrim& e) {
  e.message.clear();
  bool found = false;
  try {
    found = s.problem.square() && (s.problem.n() <= dense::small_size
                                       ? newton<dense::SmallMatrix, dense::SmallVector>(s, e)
                                       : newton<MatrixXd, VectorXd>(s, e));
  } catch (const CallerMistake&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;  // not an exception of the model
  } catch (const std::exception& thrown) {
    e.message = thrown.what();
  }
  if (found)
    e.message = missing_model(s, e);
  else if (e.message.empty())
    e.message = "Newton from the neighboring point finds no equilibrium";
  if (!found) e.status = TrimStatus::not_found;
  return found;
}

namespace {

// Moves the unknowns to restore the outputs: actuator positions depend less on a gain than the
// integrals do. Least squares in nominal sizes; false on failure.
bool keep_outputs(const Prepared& s, const VectorXd& outputs, OperatingPoint& at) {
  const Index ny = outputs.size(), nx = s.states();
  if (ny == 0) return false;
  const VectorXd size = nominals(s.model().outputs);
  const MatrixXd slopes = jacobian(s.model(), at, s.along);
  MatrixXd C(ny, s.problem.n());
  for (Index k = 0; k < C.cols(); ++k)
    C.col(k) = slopes.col(s.unknowns[std::size_t(k)]).segment(nx, ny).cwiseQuotient(size) *
               s.problem.nominal[k];
  const VectorXd miss = (outputs - outputs_of(s.model(), at)).cwiseQuotient(size);
  const VectorXd dz = dense::least_squares(C, miss);
  if (!dz.allFinite()) return false;
  add(s, dz, at);
  return true;
}

}  // namespace

std::optional<GridTrim> settle(const Prepared& s, const OperatingPoint& numbers,
                               const OperatingPoint& from) {
  GridTrim e;
  e.at = numbers;
  for (const Index j : s.problem.unknowns) set_value(e.at, j, value_of(from, j));
  const OperatingPoint here = e.at;
  if (settle(s, e)) return e;
  if (!s.problem.square()) return {};
  try {
    e.at = here;
    if (!keep_outputs(s, outputs_of(s.model(), from), e.at)) return {};
  } catch (const CallerMistake&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception&) {  // settle() has stored the message
    return {};
  }
  if (!settle(s, e)) return {};
  return e;
}

std::optional<GridTrim> settle(const Prepared& s, const GridPlace& place,
                               const OperatingPoint& from) {
  return settle(s, numbers_at(s, place), from);
}

GridTrim equilibrium_at(const Prepared& s, const OperatingPoint& at) {
  GridTrim e;
  e.at = at;
  e.status = TrimStatus::converged;
  e.outputs = outputs_of(s.model(), at);
  e.slopes = jacobian(s.model(), at, s.along, &e.exact);
  return e;
}

// Thousands of points fail for the same reason: the message without numbers, which trim() gives.
static std::string in_short(const Prepared& s, const TrimResult& found) {
  if (found.status == TrimStatus::infeasible) return "proved: no equilibrium within the limits";
  if (found.status == TrimStatus::time_limit) return out_of_time_in_words(s.trimming.time_limit);
  if (found.status != TrimStatus::not_found) return found.message;
  std::string words = "no equilibrium found from " + counted(found.starts, "start");
  if (!found.thrown.empty()) words += "; at some points the model threw: " + found.thrown;
  return words;
}

GridTrim from_nothing(const Prepared& s, const GridPlace& place) {
  return from_nothing(s, numbers_at(s, place));
}

GridTrim from_nothing(const Prepared& s, const OperatingPoint& at) {
  const TrimResult found =
      s.request.cold ? s.request.cold(at, s.trimming)
                     : trim(s.model(), free_of(s.request.spec, s.model(), s.axes), at, s.trimming);
  GridTrim e;
  e.at = found.point;
  if (is_equilibrium(found.status)) e = equilibrium_at(s, found.point);
  e.status = found.status;
  e.message = e.valid() ? missing_model(s, e) : std::string();
  if (e.message.empty()) e.message = in_short(s, found);
  e.residual = found.residual;
  return e;
}

double apart(const Prepared& s, const OperatingPoint& a, const OperatingPoint& b) {
  double most = 0.0;
  for (Index k = 0; k < s.problem.n(); ++k) {
    const Index j = s.problem.unknowns[std::size_t(k)];
    most = std::max(most, std::abs(value_of(a, j) - value_of(b, j)) / s.problem.nominal[k]);
  }
  return most;
}

double effort_at(const Prepared& s, const OperatingPoint& at) {
  Problem problem = s.problem;
  problem.base = at;
  return values(problem, unknowns_of(problem, at)).effort;
}

double input_at(const Prepared& s, const GridTrim& e, std::size_t i) {
  const Index at = s.inputs[i], nu = std::ssize(s.model().inputs);
  return at < nu ? e.at.u[at] : e.outputs[at - nu];
}

// Longest Newton step, in nominal sizes, for residuals of size one.
static double inverse_size(const Prepared& s, const MatrixXd& A) {
  const Index m = s.problem.m();
  VectorXd sum = VectorXd::Zero(s.problem.n());
  for (Index i = 0; i < m; ++i) {
    const VectorXd column = step(s, A, VectorXd::Unit(m, i));
    if (column.size() != sum.size()) return std::numeric_limits<double>::infinity();
    sum += column.cwiseAbs();
  }
  return sum.size() > 0 ? sum.maxCoeff() : 0.0;
}

namespace {

double outputs_apart(const Prepared& s, const GridTrim& a, const GridTrim& b) {
  const VectorXd size = nominals(s.model().outputs);
  return size.size() ? (a.outputs - b.outputs).cwiseQuotient(size).lpNorm<Eigen::Infinity>() : 0.0;
}

// True if A at a point agrees with the line's prediction, to the round-off of the trims.
bool predicted(const Prepared& s, const AffineLine& line, const GridTrim& e) {
  constexpr double same_matrix = 1e-9;
  const MatrixXd A = e.A(s);
  const auto share = line.share(e.at.p);
  if (!share) return false;
  const MatrixXd miss = A - (line.first + *share * line.slope);
  return miss.norm() <= same_matrix * A.norm();
}

}  // namespace

std::optional<AffineLine> affine_line(const Prepared& s, const GridPlace& place, std::size_t axis,
                                      const GridTrim& start) {
  const Model::Affine* structure = s.affine[axis];
  if (!structure) return {};
  const auto settled_at = [&](double position) {
    GridPlace at = place;
    at[axis] = position;
    return settle(s, at, start.at);
  };
  const double last = double(s.axes[axis].size() - 1);
  const auto phi = structure->phi(start.at.p);
  const auto middle = settled_at(0.5 * last), end = settled_at(last);
  if (!phi || !middle || !end) return {};
  const auto phi_end = structure->phi(end->at.p), phi_middle = structure->phi(middle->at.p);
  if (!phi_end || *phi_end == *phi || !phi_middle) return {};
  if (!(outputs_apart(s, *end, start) <= same_trim &&
        outputs_apart(s, *middle, start) <= same_trim))
    return {};
  const MatrixXd A = start.A(s), A_end = end->A(s);
  constexpr double margin = 10;  // for points between the ends
  AffineLine line{structure, *phi, A, (A_end - A) / (*phi_end - *phi)};
  line.inverse = margin * std::max(inverse_size(s, A), inverse_size(s, A_end));
  line.residual = std::max({start.residual, middle->residual, end->residual});
  line.steady = line.residual * line.inverse <= s.trimming.step_tolerance &&
                apart(s, start.at, middle->at) <= step_at_rest &&
                apart(s, start.at, end->at) <= step_at_rest;
  if (!predicted(s, line, *middle)) return {};
  return line;
}

bool settle(const Prepared& s, const AffineLine& line, GridTrim& e) {
  constexpr int few = 4;  // the integrals are (almost) linear in the law's gains
  const auto share = line.share(e.at.p);
  if (!share) return false;
  for (int i = 0; i < few; ++i) {
    const VectorXd rates = s.model().f(e.at.x, e.at.u, e.at.p);
    const VectorXd r = residuals(s, rates, e.outputs);
    e.residual = r.lpNorm<Eigen::Infinity>();
    if (e.residual <= s.trimming.tolerance &&
        e.residual * line.inverse <= s.trimming.step_tolerance)
      return keeps_limits(s, rates, e);
    const VectorXd dz = step(s, line.first + *share * line.slope, r);
    if (dz.size() != s.problem.n()) return false;
    const double size = dz.lpNorm<Eigen::Infinity>();
    if (e.residual <= s.trimming.tolerance && size <= s.trimming.step_tolerance)
      return keeps_limits(s, rates, e);
    if (!(size < diverging)) return false;
    add(s, dz, e.at);
  }
  return false;
}

}  // namespace tiltrim
