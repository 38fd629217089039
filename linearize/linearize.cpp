#include "linearize/linearize.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "dense/dense.hpp"
#include "dense/newton_step.hpp"
#include "model/among.hpp"
#include "model/differentiate.hpp"
#include "model/lookup.hpp"
#include "model/time_limit.hpp"
#include "runtime/rounding.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

std::string to_string(LinearizeStatus status) {
  switch (status) {
    case LinearizeStatus::linear:
      return "linear";
    case LinearizeStatus::not_equilibrium:
      return "not_equilibrium";
    case LinearizeStatus::not_finite:
      return "not_finite";
    case LinearizeStatus::model_threw:
      return "model_threw";
    case LinearizeStatus::not_repeatable:
      return "not_repeatable";
    case LinearizeStatus::time_limit:
      return "time_limit";
  }
  return "unknown";
}

namespace {

// The variables of the model that are the states and inputs of the linear model.
struct Selection {
  std::vector<Index> variables;  // states first
  Signals inputs;
};

Selection select(const Model& model, const LinearizeOptions& options) {
  Selection s;
  for (Index i = 0; i < std::ssize(model.states); ++i) s.variables.push_back(i);
  const std::vector<std::string> wanted =
      options.inputs.empty() ? names(model.inputs) : options.inputs;
  try {
    for (const std::string& name : wanted) {
      const Index j = variable(model, name);
      if (j < std::ssize(model.states))
        throw std::invalid_argument(fmt::format("'{}' is a state, it cannot be an input", name));
      if (std::ranges::find(s.variables, j) != s.variables.end())
        throw std::invalid_argument(fmt::format("'{}' is listed twice; expected each once", name));
      s.variables.push_back(j);
      s.inputs.push_back(signal_of(model, j));
    }
  } catch (const std::invalid_argument& e) {
    throw std::invalid_argument(fmt::format("inputs: {}", e.what()));
  }
  return s;
}

std::vector<Range> ranges(const Model& model, const Selection& selection,
                          const LinearizeOptions& options) {
  for (const auto& [name, range] : options.bounds) (void)variable(model, name);
  std::vector<Range> bounds;
  for (const Index j : selection.variables) {
    const auto at = options.bounds.find(signal_of(model, j).name);
    bounds.push_back(at == options.bounds.end() ? Range{} : at->second);
  }
  return bounds;
}

// Sets the residual; returns the rates that are not zero but must be, as text.
std::string left_over(const Model& model, const LinearizeOptions& options, LinearModel& linear) {
  std::vector<std::string> moving;
  linear.residual = 0.0;
  for (Index i = 0; i < linear.rates.size(); ++i) {
    const Signal& s = model.states[std::size_t(i)];
    if (among(options.moving, s.name)) continue;
    const double scaled = std::abs(linear.rates[i]) / s.nominal;
    linear.residual = std::isfinite(scaled) ? std::max(linear.residual, scaled) : scaled;
    if (!(scaled <= options.tolerance))
      moving.push_back(fmt::format("{}' = {:.3g}", s.name, linear.rates[i]));
  }
  return moving.empty() ? "" : fmt::format("not an equilibrium: {}", fmt::join(moving, ", "));
}

// The rates and outputs that are not finite, as text; empty if all are.
std::string not_finite(const Model& model, const Evaluation& e) {
  Eigen::VectorXd y(e.rates.size() + e.outputs.size());
  y << e.rates, e.outputs;
  std::vector<std::string> words;
  for (Index row = 0; row < y.size(); ++row)
    if (!std::isfinite(y[row]))
      words.push_back(fmt::format("{} = {}", row_name(model, row), y[row]));
  return words.empty() ? "" : fmt::format("not finite: {}", fmt::join(words, ", "));
}

// Where exact and finite-difference Jacobians disagree, the error is their distance.
void compare(const Estimate& differences, const Model& model, const Selection& selection,
             Estimate& exact, std::vector<std::string>& remarks) {
  for (const Disagreement& d : disagreements(model, selection.variables, exact, differences)) {
    remarks.push_back(d.text);
    exact.error(d.row, d.column) = d.apart + differences.error(d.row, d.column);
  }
}

// Derivatives of these rows that are not finite or have no finite error bound.
std::vector<std::string> not_determined(const Estimate& e, const Model& model, const Selection& s,
                                        Index first, Index last) {
  std::vector<std::string> words;
  for (Index i = first; i < last; ++i)
    for (Index j = 0; j < e.value.cols(); ++j) {
      const std::string &row = row_name(model, i),
                        &along = signal_of(model, s.variables[std::size_t(j)]).name;
      if (!std::isfinite(e.value(i, j)))
        words.push_back(fmt::format(
            "the model has no derivative of {} with respect to {} at this point", row, along));
      else if (!std::isfinite(e.error(i, j)))
        words.push_back(
            fmt::format("the derivative of {} with respect to {} is not determined: differences "
                        "with three step sizes do not converge",
                        row, along));
    }
  return words;
}

bool same_answer(const Evaluation& a, const Evaluation& b) {
  return dense::same_bits(a.rates, b.rates) && dense::same_bits(a.outputs, b.outputs);
}

// Newton step to the nearest equilibrium in the states that must be at rest, in their units.
// Derivatives indistinguishable from zero count as zero.
VectorXd step_to_equilibrium(const LinearModel& linear, const std::vector<Index>& steady) {
  const VectorXd size = nominals(linear.states);
  MatrixXd J = linear.A(steady, Eigen::all) * size.asDiagonal();
  const MatrixXd error = linear.A_error(steady, Eigen::all) * size.asDiagonal();
  J = (J.array().abs() > error.array()).select(J, 0.0);
  return size.cwiseProduct(dense::newton_step(J, linear.rates(steady)));
}

// Length of Newton's path that begins with this step, in nominal sizes.
double path_length(const Model& model, const LinearModel& linear, const std::vector<Index>& steady,
                   const VectorXd& step) {
  const VectorXd size = nominals(linear.states);
  const double first = step.cwiseQuotient(size).norm();
  LinearModel next = linear;
  next.point.x += step;
  try {
    std::vector<Index> states(std::size_t(step.size()));
    std::iota(states.begin(), states.end(), 0);
    next.rates = evaluate(model, next.point).rates;
    next.A = jacobian(model, next.point, states, nullptr, Wanted::rates).topRows(step.size());
  } catch (const CallerMistake&) {
    throw;
  } catch (...) {  // outside of the model's domain
    return first;
  }
  if (!next.A.allFinite() || !next.rates.allFinite()) return first;
  return dense::length_of_steps(first,
                                step_to_equilibrium(next, steady).cwiseQuotient(size).norm());
}

// Rates that are small only because their derivatives are: Newton's path is long, and the rates are
// no larger a good distance away. As text; empty at an equilibrium.
std::string only_small(const Model& model, const LinearModel& linear,
                       const LinearizeOptions& options) {
  constexpr double near = 1e-6, far = 0.1;  // nominal sizes
  std::vector<Index> steady;
  for (Index i = 0; i < std::ssize(linear.states); ++i)
    if (!among(options.moving, linear.states[std::size_t(i)].name)) steady.push_back(i);
  if (steady.empty() || linear.residual == 0 || std::isinf(options.tolerance)) return {};
  const VectorXd size = nominals(linear.states);
  const VectorXd step = step_to_equilibrium(linear, steady);
  const double first = step.cwiseQuotient(size).norm();
  if (!(first > near)) return {};
  const double away = first > far ? first : path_length(model, linear, steady, step);
  if (!(away > far)) return {};
  OperatingPoint there = linear.point;
  there.x += far / first * step;
  VectorXd rates = VectorXd::Constant(std::ssize(steady), INFINITY);  // the model throws there
  try {
    rates = evaluate(model, there).rates.cwiseQuotient(size)(steady);
  } catch (const CallerMistake&) {
    throw;
  } catch (...) {
  }
  if (!(rates.lpNorm<Eigen::Infinity>() <= 2 * linear.residual)) return {};
  return fmt::format(
      "not an equilibrium: the rates are small only because the Jacobian is; the nearest "
      "equilibrium would be {:.2g} nominal sizes away",
      away);
}

void split(const Estimate& all, LinearModel& linear) {
  const Index n = std::ssize(linear.states), m = std::ssize(linear.inputs);
  const Index l = std::ssize(linear.outputs);
  linear.A = all.value.topLeftCorner(n, n);
  linear.B = all.value.topRightCorner(n, m);
  linear.C = all.value.bottomLeftCorner(l, n);
  linear.D = all.value.bottomRightCorner(l, m);
  linear.A_error = all.error.topLeftCorner(n, n);
  linear.B_error = all.error.topRightCorner(n, m);
  linear.C_error = all.error.bottomLeftCorner(l, n);
  linear.D_error = all.error.bottomRightCorner(l, m);
}

// If other rates depend on a moving state, the linear model holds only for an instant.
void note_moving(const LinearizeOptions& options, LinearModel& linear) {
  for (const std::string& name : options.moving) {
    const Index j = find(linear.states, name);
    if (linear.rates[j] == 0) continue;
    for (Index i = 0; i < linear.A.rows(); ++i)
      if (linear.A(i, j) != 0) {
        linear.remarks.push_back(fmt::format(
            "{}' = {:.3g}, and {}' depends on {}: the linear model is valid only at this instant",
            name, linear.rates[j], linear.states[std::size_t(i)].name, name));
        break;
      }
  }
}

// Where the model's own derivatives are not finite, differences stand in, with their errors: a
// quotient such as sin(x)/x at 0 may have a slope that its formula does not give.
void fill_in(const Differences& d, const Model& model, const Selection& selection, Estimate& own,
             std::vector<std::string>& remarks) {
  for (Index k = 0; k < own.value.cols(); ++k) {
    const auto given = own.value.col(k).array().isFinite().eval();
    if (given.all()) continue;
    own.value.col(k) = given.select(own.value.col(k), d.jacobian.value.col(k));
    own.error.col(k) = given.select(own.error.col(k), d.jacobian.error.col(k));
    const std::string along = signal_of(model, selection.variables[std::size_t(k)]).name + ": ";
    if (std::ranges::none_of(d.remarks, [&](const std::string& r) { return r.starts_with(along); }))
      remarks.push_back(along +
                        "central difference, where the model's own derivative is not finite");
  }
}

// The point moved along a direction in which the rates hardly change, while the other directions
// keep them as they are; all in nominal sizes.
class Drift {
 public:
  Drift(const Model& model, const LinearModel& linear, const MatrixXd& A, double singular)
      : model_(model), linear_(linear), size_(nominals(linear.states)), svd_(dense::svd(A)) {
    while (rank_ < A.rows() && svd_.sigma[rank_] >= singular * std::max(1.0, svd_.sigma[0]))
      ++rank_;
  }
  bool vanishes(Index direction) const { return direction >= rank_; }
  double slope(Index direction) const { return svd_.sigma[direction]; }

  OperatingPoint point(Index direction, double by) const {
    OperatingPoint at = linear_.point;
    at.x += by * svd_.V.col(direction).cwiseProduct(size_);
    for (int k = 0; k < 2; ++k) {
      VectorXd z =
          (svd_.U.leftCols(rank_).transpose() * change(at)).cwiseQuotient(svd_.sigma.head(rank_));
      if (direction < rank_) z[direction] = 0;
      at.x -= (svd_.V.leftCols(rank_) * z).cwiseProduct(size_);
    }
    return at;
  }

  // How far it may go while the rates change by no more than this: infinite along a family of
  // equilibria, where every point is as good as another; NaN if the model ends there.
  double within(Index direction, double rates) const {
    constexpr double farthest = 1e-2, nearest = 1e-12;  // nominal sizes
    const auto at_rest = [&](double by) {
      try {
        return change(point(direction, by)).lpNorm<Eigen::Infinity>() <= rates;
      } catch (...) {  // outside of the model's domain
        return false;
      }
    };
    // Both sides at rest, it is no farther than the slope alone would allow.
    for (double by = std::min(farthest, rates / slope(direction)); by > nearest; by /= 2)
      if (at_rest(by) && at_rest(-by))
        return by < farthest ? by : std::numeric_limits<double>::infinity();
    return std::numeric_limits<double>::quiet_NaN();
  }

  // Rounding of the rates: what they change by, other than the slopes say, from one number to the
  // next ones, and that of a sum of terms of the nominal size.
  double rounding(const MatrixXd& A) const {
    constexpr double epsilon = std::numeric_limits<double>::epsilon();
    constexpr double rare = 4;  // of the largest of so few
    double most = 4 * epsilon;
    for (const int ulps : {-4, -3, -2, 2, 3, 4}) {
      OperatingPoint at = linear_.point;
      at.x *= 1 + ulps * epsilon;
      const VectorXd by = (at.x - linear_.point.x).cwiseQuotient(size_);
      try {
        most = std::max(most, (change(at) - A * by).lpNorm<Eigen::Infinity>());
      } catch (...) {  // outside of the model's domain
      }
    }
    return rare * most;
  }

 private:
  VectorXd change(const OperatingPoint& at) const {
    return (evaluate(model_, at).rates - linear_.rates).cwiseQuotient(size_);
  }

  const Model& model_;
  const LinearModel& linear_;
  VectorXd size_;
  dense::SVD svd_;
  Index rank_ = 0;
};

// Where the matrix is nearly singular, as at a fold, the tolerance of a trim, or rounding of the
// rates alone, leaves the point open along a direction: the errors are at least as large as what
// the slopes change by along it, if that may decide about a sign.
void widen_where_singular(const Model& model, const Selection& selection, const LinearModel& linear,
                          Estimate& all) {
  constexpr double singular = 1e-8, slow = 1e-2;
  constexpr double trimmed = 1e-10;  // 1/s
  constexpr double decides = 0.1;    // of the smallest slope
  const VectorXd size = nominals(linear.states);
  const Index n = size.size();
  const MatrixXd A =
      size.cwiseInverse().asDiagonal() * all.value.topLeftCorner(n, n) * size.asDiagonal();
  if (n == 0 || !A.allFinite()) return;
  const VectorXd pivots = dense::lu(A).pivots().cwiseAbs();
  if (!(pivots.minCoeff() < std::max(slow, singular * pivots.maxCoeff()))) return;
  const Drift drift(model, linear, A, singular);
  const double rounding = drift.rounding(A);
  for (Index k = 0; k < n; ++k) {
    const bool vanishes = drift.vanishes(k);
    if (!vanishes && drift.slope(k) >= slow) continue;
    const double by = drift.within(k, vanishes ? trimmed : rounding);
    if (!std::isfinite(by)) continue;
    for (const double side : {-by, by}) {
      const OperatingPoint at = drift.point(k, side);
      const MatrixXd J = linear.method == Method::exact
                             ? exact(model, at, selection.variables).value
                             : difference(model, at, selection.variables).jacobian.value;
      const MatrixXd change = (J - all.value).cwiseAbs();
      const MatrixXd scaled =
          size.cwiseInverse().asDiagonal() * change.topLeftCorner(n, n) * size.asDiagonal();
      if (!vanishes && scaled.norm() < decides * drift.slope(k)) continue;
      const MatrixXd wider = all.error.cwiseMax(change);
      all.error = J.array().isFinite().select(wider, all.error);
    }
  }
}

// Computes A, B, C, D if the point is at rest; calls the model and so may throw its exceptions.
void fill(const Model& model, const Selection& selection, const std::vector<Range>& bounds,
          const LinearizeOptions& options, LinearModel& linear) {
  const auto refused = [&linear](LinearizeStatus status, const std::string& why) {
    linear.status = status;
    linear.message = why;
    return !why.empty();
  };
  const Evaluation e = evaluate(model, linear.point);
  linear.rates = e.rates;
  const std::string moving = left_over(model, options, linear);
  if (refused(LinearizeStatus::not_finite, not_finite(model, e))) return;
  if (refused(LinearizeStatus::not_equilibrium, moving)) return;

  const std::string unsteady =
      "the model returns two different values at one point: it keeps internal state or draws "
      "random numbers";
  if (!same_answer(e, evaluate(model, linear.point)) &&
      refused(LinearizeStatus::not_repeatable, unsteady))
    return;
  const Differences d = difference(model, linear.point, selection.variables, bounds);
  const bool use_exact = options.method == Method::exact && model.derivatives;
  Estimate all = use_exact ? exact_bounded(model, linear.point, selection.variables) : d.jacobian;
  linear.method = use_exact ? Method::exact : Method::differences;
  linear.remarks = d.remarks;
  if (use_exact) {
    fill_in(d, model, selection, all, linear.remarks);
    compare(d.jacobian, model, selection, all, linear.remarks);
  }
  if (options.moving.empty()) widen_where_singular(model, selection, linear, all);
  if (!same_answer(e, evaluate(model, linear.point)) &&
      refused(LinearizeStatus::not_repeatable, unsteady))
    return;
  const Index n = std::ssize(linear.states);
  const std::vector<std::string> undetermined = not_determined(all, model, selection, 0, n);
  if (!undetermined.empty() && refused(LinearizeStatus::not_finite, undetermined.front())) return;
  for (const std::string& words : not_determined(all, model, selection, n, all.value.rows()))
    linear.remarks.push_back(words);
  all.value = all.error.array().isFinite().select(all.value, NAN);
  split(all, linear);
  note_moving(options, linear);
  if (refused(LinearizeStatus::not_equilibrium, only_small(model, linear, options))) return;
  linear.status = LinearizeStatus::linear;
  if (use_exact)
    linear.A_differences = {d.jacobian.value.topLeftCorner(n, n),
                            d.jacobian.error.topLeftCorner(n, n)};
}

}  // namespace

LinearModel linearize(const Model& model, const OperatingPoint& point,
                      const LinearizeOptions& options) {
  const RoundToNearest environment;
  if (!model.f && model.states.empty()) {  // y = h(u, p): only D
    Model stateless = model;
    stateless.f = [](const VectorXd&, const VectorXd&, const VectorXd&) { return VectorXd(); };
    return linearize(stateless, point, options);
  }
  check(model);
  check(model, point);
  for (const std::string& name : options.moving) (void)index_of(model.states, name, "state");
  const Selection selection = select(model, options);
  const std::vector<Range> bounds = ranges(model, selection, options);
  LinearModel linear;
  linear.mode_names = model.mode_names;
  linear.states = model.states;
  linear.inputs = selection.inputs;
  linear.outputs = model.outputs;
  linear.point = point;
  const auto threw = [&linear](const char* words) {
    linear.status = LinearizeStatus::model_threw;
    linear.message = fmt::format("the model threw: {}", words);
  };
  std::optional<TimedModel> limited;
  if (options.time_limit != unlimited) limited = timed(model, options.time_limit);
  try {
    fill(limited ? limited->model : model, selection, bounds, options, linear);
  } catch (const CallerMistake&) {
    throw;
  } catch (const std::exception& e) {
    threw(e.what());
  } catch (...) {
    threw("an exception that is not a std::exception");
  }
  if (limited && *limited->over) {
    linear.status = LinearizeStatus::time_limit;
    linear.message = out_of_time_in_words(options.time_limit);
  }
  return linear;
}

}  // namespace tiltrim
