#include "trim/verdict.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "dense/dense.hpp"
#include "dense/newton_step.hpp"
#include "model/lookup.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

double excess(const VectorXd& v, const VectorXd& lower, const VectorXd& upper) {
  if (v.size() == 0) return 0.0;
  return std::max(0.0, std::max((v - upper).maxCoeff(), (lower - v).maxCoeff()));
}

namespace {

constexpr double singular_below = 1e-8;  // smallest over largest singular value (or over one)
constexpr double at_bound = 1e-7;        // scaled distance within which a limit is active

// Whether the memory holds the evaluation at z, made on the way there.
bool evaluated(const VectorXd& where, const VectorXd& z) {
  return z.size() > 0 && dense::same_bits(where, z);
}

// Calls see(signal, value, lower, upper, nominal size), scaled, for each unknown and limited
// output.
template <class See>
void each_limit(const Problem& p, const VectorXd& z, const VectorXd& limited, const See& see) {
  for (Index k = 0; k < p.n(); ++k) {
    const Signal& signal = signal_of(p.model, p.unknowns[std::size_t(k)]);
    see(signal, z[k], p.lower[k], p.upper[k], p.nominal[k]);
  }
  for (Index i = 0; i < std::ssize(p.limited); ++i) {
    const Index row = p.limited[std::size_t(i)];
    see(p.model.outputs[std::size_t(row - std::ssize(p.model.states))], limited[i],
        p.limited_lower[i], p.limited_upper[i], p.row_nominal[row]);
  }
}

void note_limits(const Problem& p, const VectorXd& z, const Values& v, TrimResult& r) {
  each_limit(p, z, v.limited,
             [&](const Signal& signal, double at, double lower, double upper, double size) {
               for (const bool up : {true, false})
                 if (const double bound = up ? upper : lower; std::abs(at - bound) <= at_bound)
                   r.limits_active.push_back({signal.name, up, bound * size});
             });
}

// The Jacobian with rows longer than one scaled to unit length: a stiff equation still determines
// its own unknown and does not affect the conditioning of the others.
template <class Matrix>
Matrix without_stiffness(const Matrix& J) {
  return J.rowwise().norm().cwiseMax(1.0).cwiseInverse().asDiagonal() * J;
}

// Length of Newton's path that begins with this step.
double path_length(const Problem& p, const VectorXd& z, const VectorXd& step) {
  const Values next = values(p, z + step);
  if (!next.finite) return step.norm();
  Jacobians slopes;
  differentiate(p, z + step, next, slopes);
  if (!slopes.finite) return step.norm();
  return dense::length_of_steps(step.norm(),
                                dense::newton_step(slopes.residual, next.residual).norm());
}

// Distance to a zero, if the residual is small only because its derivatives are: it is no larger
// a good distance away. Otherwise 0.
double distance_to_zero(const Problem& p, const VectorXd& z, const Values& v, const MatrixXd& J) {
  constexpr double near = 1e-6, far = 0.1;  // nominal sizes
  const VectorXd step = dense::newton_step(J, v.residual);
  double away = step.norm();
  if (!(away > near)) return 0.0;
  if (away <= far) away = path_length(p, z, step);
  if (!(away > far)) return 0.0;
  const Values there = values(p, z + far / step.norm() * step);
  const bool flat = there.finite && there.residual.norm() <= 2 * v.residual.norm();
  return flat ? away : 0.0;
}

dense::SVD svd_of(const MatrixXd& J) { return dense::svd(J); }
dense::SmallSVD svd_of(const dense::SmallMatrix& J) { return dense::small_svd(J); }

// False where singular vectors have to say which unknowns the equations leave undetermined, or the
// step is not unique.
bool well_conditioned(const Problem& p, const dense::SmallMatrix& J, const Values& v,
                      TrimResult& r) {
  if (!p.square()) return false;
  const dense::SmallVector sigma = dense::small_singular_values(J);
  if (sigma.size() == 0) return false;
  const double rcond = sigma.minCoeff() / std::max(sigma.maxCoeff(), 1.0);
  if (!(rcond >= singular_below)) return false;
  r.rcond = rcond;
  const dense::SmallVector dz = dense::small_solve(J, dense::SmallVector(v.residual));
  r.step = dz.allFinite() ? dz.cwiseAbs().maxCoeff() : std::numeric_limits<double>::infinity();
  return true;
}

// `J`: of the equations.
template <class Matrix, class Vector>
void note_conditioning(const Problem& p, const VectorXd& z, const Values& v, const Matrix& J,
                       const Vector& residual, TrimResult& r, double& away) {
  auto svd = svd_of(J);
  r.rcond = svd.sigma[p.m() - 1] / std::max(svd.sigma[0], 1.0);
  const Vector dz = dense::solve(svd, residual);
  r.step = dz.allFinite() ? dz.cwiseAbs().maxCoeff() : std::numeric_limits<double>::infinity();
  if (r.rcond < singular_below) {
    svd = svd_of(without_stiffness(J));
    r.rcond = svd.sigma[p.m() - 1] / std::max(svd.sigma[0], 1.0);
  }
  if (r.rcond >= singular_below) return;
  away = distance_to_zero(p, z, v, J);
  Index rank = 0;
  while (rank < p.m() && svd.sigma[rank] >= singular_below * std::max(svd.sigma[0], 1.0)) ++rank;
  rank = std::min(rank, p.m() - 1);
  r.message = fmt::format(
      "the equations do not determine {}: the Jacobian is singular there, with rank {} for {} "
      "equations",
      free_directions(p, svd.V.middleCols(rank, p.m() - rank)), rank, p.m());
}

// How well the equations determine the unknowns, and the size of a further Newton step.
void note_conditioning(const Problem& p, const VectorXd& z, const Values& v, TrimResult& r,
                       double& away) {
  if (p.m() == 0) {
    r.rcond = 1.0;
    return;
  }
  Jacobians& s = p.memory.slopes;
  if (!evaluated(p.memory.z_of_slopes, z)) {
    differentiate(p, z, v, s);
    p.memory.z_of_slopes = z;
  }
  if (!s.finite) return;  // rcond stays 0: unknown
  if (p.n() <= dense::small_size) {
    const dense::SmallMatrix J = s.residual;
    if (!well_conditioned(p, J, v, r))
      note_conditioning(p, z, v, J, dense::SmallVector(v.residual), r, away);
  } else {
    note_conditioning(p, z, v, s.residual, v.residual, r, away);
  }
}

}  // namespace

std::string free_directions(const Problem& p, const MatrixXd& directions) {
  constexpr double involved = 0.1;  // of the largest share
  const VectorXd share = directions.rowwise().norm();
  std::vector<Index> order;
  for (Index k = 0; k < p.n(); ++k)
    if (share[k] >= involved * share.maxCoeff()) order.push_back(k);
  std::ranges::stable_sort(order, std::greater{}, [&](Index k) { return share[k]; });
  std::vector<std::string> names;
  for (const Index k : order) names.push_back(signal_of(p.model, p.unknowns[std::size_t(k)]).name);
  return fmt::format("{}", fmt::join(names, ", "));
}

std::string left_over(const Problem& p, const std::vector<Index>& rows, const TrimResult& r) {
  const Index nx = std::ssize(p.model.states);
  const auto value = [&](Index row) { return row < nx ? r.rates[row] : r.outputs[row - nx]; };
  const auto is_rounding = [&](Index row) {
    constexpr double rounding = 1e-12;  // relative to the nominal size
    return std::abs(value(row)) <= rounding * p.row_nominal[row];
  };
  // Compared with larger values; a rate that vanishes nowhere may be as small, and is not zero.
  const bool all_small = std::ranges::all_of(rows, is_rounding);
  std::vector<std::string> words;
  for (const Index row : rows) {
    const auto equation = std::ranges::find(p.equations, row) - p.equations.begin();
    const double wanted = equation < p.m() ? p.held[equation] : 0.0;
    const double left = is_rounding(row) && !all_small ? 0.0 : value(row);
    words.push_back(
        fmt::format("{} = {:.3g} {}", row_name(p.model, row), left, row_unit(p.model, row)));
    if (wanted != 0 || row >= nx)
      words.back() +=
          fmt::format("{}instead of {:.6g}", words.back().ends_with(' ') ? "" : " ", wanted);
  }
  return fmt::format("{}", fmt::join(words, ", "));
}

std::string not_finite_in_words(const Problem& p, const VectorXd& rates, const VectorXd& outputs) {
  VectorXd y(rates.size() + outputs.size());
  y << rates, outputs;
  std::vector<std::string> words;
  for (Index row = 0; row < y.size(); ++row)
    if (!std::isfinite(y[row]))
      words.push_back(fmt::format("{} = {}", row_name(p.model, row),
                                  std::isnan(y[row]) ? NAN : y[row]));  // without a sign
  return fmt::format("{}", fmt::join(words, ", "));
}

std::string limits_in_words(const Problem& p, const TrimResult& r) {
  const Index nx = std::ssize(p.model.states);
  VectorXd limited(std::ssize(p.limited));
  for (Index i = 0; i < limited.size(); ++i) {
    const Index row = p.limited[std::size_t(i)];
    limited[i] = r.outputs[row - nx] / p.row_nominal[row];
  }
  std::vector<std::string> beyond, at_limits;
  each_limit(p, unknowns_of(p, r.point), limited,
             [&](const Signal& s, double at, double lower, double upper, double size) {
               const auto number = [&](double scaled) {
                 return fmt::format("{:.4g}{}{}", scaled * size, s.unit.empty() ? "" : " ", s.unit);
               };
               for (const bool up : {true, false}) {
                 const double bound = up ? upper : lower, over = up ? at - bound : bound - at;
                 const std::string limit = (up ? "upper limit " : "lower limit ") + number(bound);
                 if (over > at_bound)
                   beyond.push_back(fmt::format("{} {} {} its {}", s.name, number(over),
                                                up ? "above" : "below", limit));
                 else if (over >= -at_bound)
                   at_limits.push_back(fmt::format("{} at its {}", s.name, limit));
               }
             });
  if (beyond.empty() && at_limits.empty()) return "with no limit reached";
  beyond.insert(beyond.end(), at_limits.begin(), at_limits.end());
  return fmt::format("with {}", fmt::join(beyond, ", "));
}

// Status of a point that meets the equations and the bounds.
static void classify(const Problem& p, bool optimal, const TrimOptions& options, TrimResult& r) {
  const auto moves = [&](Index row) {
    return std::abs(r.rates[row]) > options.tolerance * p.row_nominal[row];
  };
  std::vector<Index> moving;
  std::ranges::copy_if(p.implied, std::back_inserter(moving), moves);
  if (!moving.empty()) {
    r.status = TrimStatus::not_implied;
    r.message = "the equations hold, but a rate that should vanish with them does not: " +
                left_over(p, moving, r);
  } else if (r.rcond < singular_below || r.step > options.step_tolerance) {
    r.status = TrimStatus::singular;
    if (r.message.empty())
      r.message = fmt::format(
          "Newton's next step would be {:.2g} nominal sizes: the equations are nearly singular or "
          "noisy",
          r.step);
  } else if (!optimal) {
    r.status = TrimStatus::not_optimal;
    r.message = "an equilibrium, but not proved to be the one of least effort";
  } else {
    r.status = TrimStatus::converged;
  }
}

static TrimResult judged(const Problem& p, const VectorXd& z, bool optimal,
                         const TrimOptions& options) {
  TrimResult r;
  r.point = point_of(p, z);
  r.residual = std::numeric_limits<double>::infinity();
  Values &v = p.memory.here, &again = p.memory.next;
  // Two evaluations in a row tell what alternates: functions that are not tiltrim's own may.
  if (!p.in_place || !evaluated(p.memory.z_of_here, z)) {
    evaluate(p, z, v);
    p.memory.z_of_here = z;
  }
  evaluate(p, z, again);
  if (!v.finite) {
    r.status = TrimStatus::not_finite;
    return r;
  }
  r.residual = p.m() > 0 ? v.residual.lpNorm<Eigen::Infinity>() : 0.0;
  r.effort = v.effort;
  r.rates = rates_of(p, v);
  if (p.needs_outputs)
    r.outputs = v.y.tail(std::ssize(p.model.outputs));
  else
    r.outputs = outputs(p, r.point);
  note_limits(p, z, v, r);
  if (!dense::same_bits(v.residual, again.residual)) {
    r.status = TrimStatus::not_repeatable;
    r.message =
        "the model returns two different values at one point: it keeps internal state or draws "
        "random numbers";
    return r;
  }
  const double outside =
      std::max(excess(z, p.lower, p.upper), excess(v.limited, p.limited_lower, p.limited_upper));
  if (r.residual > options.tolerance || outside > bound_slack) return r;  // not_found
  if (p.model.h && !r.outputs.allFinite()) {
    r.status = TrimStatus::not_finite;
    r.message = "an equilibrium, but not every output is finite there: " +
                not_finite_in_words(p, r.rates, r.outputs);
    return r;
  }
  double away = 0.0;
  note_conditioning(p, z, v, r, away);
  if (away > 0) {
    r.message = fmt::format(
        "the residual is only {:.1g} because the Jacobian vanishes too: the nearest equilibrium "
        "would be {:.2g} nominal sizes away",
        r.residual, away);
    return r;  // not_found
  }
  classify(p, optimal, options, r);
  return r;
}

TrimResult verify(const Problem& p, const VectorXd& z, bool optimal, const TrimOptions& options) {
  TrimResult r = judged(p, z, optimal, options);
  if (p.over()) r.status = TrimStatus::time_limit;  // not every value was evaluated
  return r;
}

}  // namespace tiltrim
