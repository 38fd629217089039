#include "follow/slopes_along.hpp"

#include <algorithm>

#include "model/lookup.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

OperatingPoint moved(const OperatingPoint& from, const VectorXd& by) {
  OperatingPoint to = from;
  to.x += by.head(from.x.size());
  to.u += by.segment(from.x.size(), from.u.size());
  to.p += by.tail(from.p.size());
  return to;
}

Estimate state_matrix(const Model& model, const OperatingPoint& at) {
  const Index n = at.x.size();
  std::vector<Index> states;
  for (Index i = 0; i < n; ++i) states.push_back(i);
  Estimate A = model.derivatives ? exact(model, at, states) : Estimate{};
  if (A.value.size() == 0 || !A.value.topRows(n).allFinite())
    A = difference(model, at, states).jacobian;
  return {A.value.topRows(n), A.error.topRows(n)};
}

// A step over which the largest relative change of a variable is h.
double step_along(const Model& model, const OperatingPoint& at, const VectorXd& direction,
                  double h) {
  return h / direction.cwiseQuotient(sizes_at(model, at)).lpNorm<Eigen::Infinity>();
}

// Of A along a direction. Truncation and round-off are both small; Jacobians by finite differences
// carry noise that a short step would amplify.
double step_of_jacobians(const Model& model) { return model.derivatives ? 1e-5 : 5e-4; }

}  // namespace

double doubt(const Slopes<std::complex<double>>& s, double noise) {
  constexpr double uneven = 0.1;
  const double bend = std::max(std::abs(s.bend), 0.5 * std::abs(s.far_bend));
  const double apart = std::abs(s.near - s.far);
  if (!std::isfinite(bend) || !std::isfinite(apart)) return std::numeric_limits<double>::infinity();
  const bool even = std::abs(s.far_bend - 2.0 * s.bend) <= uneven * bend;
  return std::max(even || bend <= noise ? 0.0 : bend, apart <= noise ? 0.0 : apart);
}

Estimate SlopesAlong::sample(double t) const {
  try {
    return function(moved(at, t * direction));
  } catch (const CallerMistake&) {
    throw;
  } catch (...) {
    const MatrixXd none = MatrixXd::Constant(here.value.rows(), here.value.cols(), NAN);
    return {none, none};
  }
}

const SlopesAlong::Level& SlopesAlong::level(int i) {
  constexpr double safe = 64;  // times the error of one sample: 1024 roundings of an exact one
  for (double t = step * std::pow(shorter, std::ssize(levels)); std::ssize(levels) <= i;
       t *= shorter) {
    const Estimate ahead = sample(t), behind = sample(-t);
    const Estimate far_ahead = sample(2 * t), far_behind = sample(-2 * t);
    levels.push_back(
        {{(ahead.value - behind.value) / (2 * t), (far_ahead.value - far_behind.value) / (4 * t),
          (ahead.value - 2 * here.value + behind.value) / t,
          (far_ahead.value - 2 * here.value + far_behind.value) / (2 * t)},
         safe / t * here.error,
         (ahead.error + behind.error) / (2 * t) + (far_ahead.error + far_behind.error) / (4 * t)});
  }
  return levels[std::size_t(i)];
}

VectorXd sizes_at(const Model& model, const OperatingPoint& at) {
  VectorXd values(at.x.size() + at.u.size() + at.p.size()), sizes = values;
  values << at.x, at.u, at.p;
  sizes << nominals(model.states), nominals(model.inputs), nominals(model.parameters);
  return values.cwiseAbs().cwiseMax(sizes);
}

SlopesAlong jacobians_along(const Model& model, const OperatingPoint& at,
                            const VectorXd& direction) {
  const auto A = [&model](const OperatingPoint& point) { return state_matrix(model, point); };
  return {at, direction, step_along(model, at, direction, step_of_jacobians(model)), A, A(at)};
}

Estimate jacobian_slope(const Model& model, const SlopesAlong::Level& level, int shortened) {
  const double h = step_of_jacobians(model) * std::pow(SlopesAlong::shorter, shortened);
  const Slopes<MatrixXd>& s = level.slopes;
  return {s.near,
          (s.near - s.far).cwiseAbs() + level.rounding + last_digit / h * s.near.cwiseAbs()};
}

SlopesAlong rates_along(const Model& model, const OperatingPoint& at, const VectorXd& direction,
                        const VectorXd& terms) {
  constexpr double h = 1e-5, roundings = 16;
  const auto values = [&model, terms](const OperatingPoint& point) {
    const Evaluation e = evaluate(model, point);
    VectorXd y(e.rates.size() + e.outputs.size());
    y << e.rates, e.outputs;
    return Estimate{y, roundings * last_digit * (terms + y.cwiseAbs())};
  };
  return {at, direction, step_along(model, at, direction, h), values, values(at)};
}

bool row_settles(SlopesAlong& along, Index row, double size, bool equation) {
  const auto judge = [&](int i) -> Judged {
    const SlopesAlong::Level& l = along.level(i);
    const Slopes<MatrixXd>& s = l.slopes;
    const double noise = l.noise(row), slope = std::abs(s.near(row));
    const double of_row = doubt({s.near(row), s.far(row), s.bend(row), s.far_bend(row)}, noise);
    return {std::max(of_row, equation && slope > noise ? slope : 0.0), size};
  };
  return settled(judge).has_value();
}

}  // namespace tiltrim
