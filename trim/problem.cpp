#include "trim/problem.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "model/differentiate.hpp"
#include "model/lookup.hpp"
#include "model/time_limit.hpp"
#include "trim/check_answers.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::VectorXd;

void check_positive(const char* name, double value) {
  if (!(value > 0) || !std::isfinite(value))
    throw std::invalid_argument(fmt::format("a {} of {}; expected more than 0", name, value));
}

std::string counted(int n, const std::string& what) {
  return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s");
}

std::string row_unit(const Model& model, Index row) {
  const Index nx = std::ssize(model.states);
  if (row >= nx) return model.outputs[std::size_t(row - nx)].unit;
  const std::string& unit = model.states[std::size_t(row)].unit;
  return unit == "s" ? "" : unit.empty() ? "1/s" : unit.ends_with("/s") ? unit + "²" : unit + "/s";
}

// Runs `evaluate`, which may throw anything: a trial point at which the model throws counts as not
// finite, and the exception's message is kept.
template <class Evaluate>
static bool guarded(const Problem& p, const Evaluate& evaluate) {
  if (p.over()) return false;
  ++p.evaluations;
  try {
    evaluate();
    return true;
  } catch (const OutOfTime&) {
    --p.evaluations;  // no evaluation took place
  } catch (const std::exception& e) {
    if (p.thrown.empty()) p.thrown = e.what();
  } catch (...) {
    if (p.thrown.empty()) p.thrown = "an exception that is not a std::exception";
  }
  return false;
}

namespace {

// Any NaN or infinity makes the sum NaN.
bool all_finite(const auto& values) { return std::isfinite((0.0 * values).sum()); }

// The problem's functions for given rates and outputs.
void set_values(const Problem& p, const VectorXd& z, Values& v) {
  const VectorXd& y = v.y;
  v.residual.resize(p.m());
  for (Index i = 0; i < p.m(); ++i) {
    const Index row = p.equations[std::size_t(i)];
    v.residual[i] = (y[row] - p.held[i]) / p.row_nominal[row];
  }
  v.limited.resize(std::ssize(p.limited));
  for (Index i = 0; i < v.limited.size(); ++i)
    v.limited[i] = y[p.limited[std::size_t(i)]] / p.row_nominal[p.limited[std::size_t(i)]];
  v.effort = p.fixed_effort;
  for (const Problem::Term& t : p.terms) {
    const double value = t.row < 0 ? z[t.unknown] * p.nominal[t.unknown] : y[t.row];
    v.effort += std::pow((value - t.reference) / t.scale, 2);
  }
  v.finite = all_finite(y) && std::isfinite(v.effort);
}

// A point without violations has residual 0, as has a trim without equations.
void note_nearest(const Problem& p, const VectorXd& z, const Values& v) {
  if (!p.notes_nearest) return;
  const double residual = v.residual.size() > 0 ? v.residual.lpNorm<Eigen::Infinity>() : 0.0;
  if (!(residual < p.nearest.residual)) return;
  p.nearest.z = z;
  p.nearest.values = v;
  p.nearest.residual = residual;
}

// [f; h] at a point; without h zeros if no output is needed.
void rates_and_outputs(const Problem& p, const OperatingPoint& at, VectorXd& y) {
  const Index nx = std::ssize(p.model.states);
  y.resize(p.row_nominal.size());
  if (!p.needs_outputs) y.tail(y.size() - nx).setZero();
  if (p.in_place)
    return p.in_place->write(at.x.data(), at.u.data(), at.p.data(), y.data(),
                             p.needs_outputs ? y.data() + nx : nullptr);
  const VectorXd rates = p.model.f(at.x, at.u, at.p);
  check_rates(p.model, rates);
  y.head(nx) = rates;
  if (!p.needs_outputs) return;
  const VectorXd outputs = p.model.h(at.x, at.u, at.p);
  check_outputs(p.model, outputs);
  y.tail(y.size() - nx) = outputs;
}

// The point of z in the memory of the evaluations.
const OperatingPoint& placed(const Problem& p, const VectorXd& z) {
  OperatingPoint& at = p.memory.at;
  at = p.base;
  for (Index k = 0; k < p.n(); ++k) set_value(at, p.unknowns[std::size_t(k)], z[k] * p.nominal[k]);
  return at;
}

}  // namespace

// Checks the sizes of the model's results, if it can be evaluated at the guess.
void check_answers(const Problem& p) {
  if (p.in_place && !p.notes_nearest) return;  // of known sizes
  const OperatingPoint& at = p.base;
  const Index nx = std::ssize(p.model.states);
  VectorXd rates(nx), outputs(std::ssize(p.model.outputs));
  const bool answered = guarded(p, [&] {
    rates = p.model.f(at.x, at.u, at.p);
    if (p.model.h) outputs = p.model.h(at.x, at.u, at.p);
  });
  check_rates(p.model, rates);
  check_outputs(p.model, outputs);
  if (!answered) return;
  const VectorXd z = unknowns_of(p, p.base);
  Values v;
  v.y.resize(p.row_nominal.size());
  v.y << rates, outputs;
  set_values(p, z, v);
  if (v.finite) note_nearest(p, z, v);
}

VectorXd unknowns_of(const Problem& p, const OperatingPoint& point) {
  VectorXd z(p.n());
  for (Index k = 0; k < p.n(); ++k)
    z[k] = value_of(point, p.unknowns[std::size_t(k)]) / p.nominal[k];
  return z;
}

bool same_solution(const VectorXd& a, const VectorXd& b) {
  constexpr double apart = 1e-6;  // scaled
  const VectorXd size = b.cwiseAbs().cwiseMax(1.0);
  return (a - b).cwiseQuotient(size).lpNorm<Eigen::Infinity>() <= apart;
}

OperatingPoint point_of(const Problem& p, const VectorXd& z) {
  OperatingPoint point = p.base;
  for (Index k = 0; k < p.n(); ++k)
    set_value(point, p.unknowns[std::size_t(k)], z[k] * p.nominal[k]);
  return point;
}

Values values(const Problem& p, const VectorXd& z) {
  Values v;
  evaluate(p, z, v);
  return v;
}

void evaluate(const Problem& p, const VectorXd& z, Values& v) {
  if (!guarded(p, [&] { rates_and_outputs(p, placed(p, z), v.y); })) {
    v = Values{};
    return;
  }
  set_values(p, z, v);
  if (v.finite) note_nearest(p, z, v);
}

VectorXd rates_of(const Problem& p, const Values& v) {
  return v.y.head(std::min(v.y.size(), std::ssize(p.model.states)));
}

VectorXd outputs(const Problem& p, const OperatingPoint& at) {
  VectorXd y = VectorXd::Constant(std::ssize(p.model.outputs), NAN);
  if (p.model.h) guarded(p, [&] { y = p.model.h(at.x, at.u, at.p); });
  return y;
}

Jacobians jacobians(const Problem& p, const VectorXd& z) {
  Jacobians s;
  Values v;
  const bool answered = guarded(p, [&] {
    if (p.terms.empty() || !p.needs_outputs) return;
    const OperatingPoint& at = placed(p, z);
    const VectorXd outputs = p.model.h(at.x, at.u, at.p);
    check_outputs(p.model, outputs);
    v.y.resize(p.row_nominal.size());
    v.y.tail(outputs.size()) = outputs;
  });
  if (!answered) return s;
  --p.evaluations;
  differentiate(p, z, v, s);
  return s;
}

void differentiate(const Problem& p, const VectorXd& z, const Values& at, Jacobians& s) {
  Eigen::MatrixXd J;
  const OperatingPoint& point = placed(p, z);
  s.finite = false;
  const Wanted wanted = p.needs_outputs ? Wanted::rates_and_outputs : Wanted::rates;
  if (!guarded(p, [&] { J = jacobian(p.model, point, p.unknowns, nullptr, wanted); })) {
    s = Jacobians{};
    return;
  }
  const auto scaled = [&](const std::vector<Index>& rows, Eigen::MatrixXd& slopes) {
    slopes.resize(std::ssize(rows), p.n());
    for (Index k = 0; k < p.n(); ++k)
      for (Index i = 0; i < slopes.rows(); ++i) {
        const Index from = rows[std::size_t(i)];
        slopes(i, k) = J(from, k) * p.nominal[k] / p.row_nominal[from];
      }
  };
  scaled(p.equations, s.residual);
  scaled(p.limited, s.limited);
  s.effort.setZero(p.n());
  for (const Problem::Term& t : p.terms) {
    const double value = t.row < 0 ? z[t.unknown] * p.nominal[t.unknown] : at.y[t.row];
    const double slope = 2 * (value - t.reference) / (t.scale * t.scale);
    if (t.row < 0)
      s.effort[t.unknown] += slope * p.nominal[t.unknown];
    else
      for (Index k = 0; k < p.n(); ++k) s.effort[k] += slope * (J(t.row, k) * p.nominal[k]);
  }
  s.finite = all_finite(s.residual) && all_finite(s.limited) && all_finite(s.effort);
}

// Van der Corput: the digits of `index` in `base`, reversed after the radix point.  [7]
static double radical_inverse(int index, int base) {
  double value = 0.0;
  for (double digit = 1.0 / base; index > 0; index /= base, digit /= base)
    value += digit * (index % base);
  return value;
}

VectorXd start(const Problem& p, int index) {
  constexpr auto primes =
      std::to_array({2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53});
  constexpr double spread = 5.0;  // nominal sizes
  const VectorXd guess = unknowns_of(p, p.base);
  VectorXd z(p.n());
  for (Index k = 0; k < p.n(); ++k) {
    const bool below = std::isfinite(p.lower[k]);
    const bool above = std::isfinite(p.upper[k]);
    const double from =
        below ? p.lower[k] : (above ? std::min(p.upper[k], guess[k]) : guess[k]) - spread;
    const double to =
        above ? p.upper[k] : (below ? std::max(p.lower[k], guess[k]) : guess[k]) + spread;
    const auto base = primes[std::size_t(k) % primes.size()];
    z[k] = from + (to - from) * radical_inverse(index, base);
  }
  return z;
}

}  // namespace tiltrim
