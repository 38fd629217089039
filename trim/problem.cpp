#include "trim/problem.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "model/among.hpp"
#include "model/differentiate.hpp"
#include "model/name_table.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::VectorXd;

std::string counted(int n, const std::string& what) {
  return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s");
}

std::string row_name(const Model& model, Index row) {
  const Index nx = std::ssize(model.states);
  return row < nx ? model.states[std::size_t(row)].name + "'"
                  : model.outputs[std::size_t(row - nx)].name;
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

// What a name in a spec may refer to: a variable (negative row) or an output.
struct Place {
  Index variable = -1;  // of the model
  Index row = -1;       // of [f; h]
};

Place place_of(const Model& model, const ModelNames& known, const std::string& name) {
  if (const Index j = known.variables.find(name); j >= 0) return {j, -1};
  if (const Index i = known.outputs.find(name); i >= 0) return {-1, std::ssize(model.states) + i};
  std::vector<std::string> all;
  for (const Signals* signals : {&model.states, &model.inputs, &model.parameters, &model.outputs})
    for (const Signal& s : *signals) all.push_back(s.name);
  const std::string near = nearest_name(name, all);
  throw std::invalid_argument(fmt::format("no signal '{}'{}; the model has: {}", name,
                                          near.empty() ? "" : fmt::format(" (nearest: '{}')", near),
                                          fmt::join(all, ", ")));
}

void check_range(const std::string& name, const Range& r) {
  if (std::isnan(r.lower) || std::isnan(r.upper))
    throw std::invalid_argument(fmt::format("bounds of '{}': not a number", name));
  if (r.lower > r.upper)
    throw std::invalid_argument(
        fmt::format("bounds of '{}' are reversed: [{}, {}]", name, r.lower, r.upper));
  if (r.lower == r.upper && std::isinf(r.lower))
    throw std::invalid_argument(fmt::format("bounds of '{}': both are {}", name, r.lower));
}

// There is room in `held` for all equations that a spec can have.
void add_equation(Problem& p, Index row, double value) {
  p.held[p.m()] = value;
  p.equations.push_back(row);
}

void add_unknowns(Problem& p, const ModelNames& known, const TrimSpec& spec) {
  std::vector<Index> seen;
  seen.reserve(spec.free.size());
  p.unknowns.reserve(spec.free.size());
  for (const std::string& name : spec.free) {
    Index j = known.variables.find(name);
    if (j < 0) j = variable(p.model, name);  // throws
    if (std::ranges::find(seen, j) != seen.end())
      throw std::invalid_argument(fmt::format("'{}' is listed twice as a free variable", name));
    seen.push_back(j);
    const auto bound = spec.bounds.find(name);
    if (bound != spec.bounds.end() && bound->second.lower == bound->second.upper)
      set_value(p.base, j, bound->second.lower);  // fixed: not an unknown
    else
      p.unknowns.push_back(j);
  }
  const Index n = p.n();
  p.nominal.resize(n);
  p.lower = VectorXd::Constant(n, -std::numeric_limits<double>::infinity());
  p.upper = -p.lower;
  for (Index k = 0; k < n; ++k)
    p.nominal[k] = signal_of(p.model, p.unknowns[std::size_t(k)]).nominal;
}

// If no steady states are listed, all states that no other list names.
std::vector<std::string> steady_states(const Model& model, const TrimSpec& spec) {
  if (!spec.steady.empty()) return spec.steady;
  std::vector<std::string> steady;
  for (const Signal& s : model.states)
    if (!spec.rates.contains(s.name) && !among(spec.implied, s.name) && !among(spec.moving, s.name))
      steady.push_back(s.name);
  return steady;
}

// The held rate of a state, or nothing.
const double* held_rate(const TrimSpec& spec, const std::vector<std::string>& steady,
                        const std::string& name) {
  static constexpr double zero = 0.0;
  if (const auto at = spec.rates.find(name); at != spec.rates.end()) return &at->second;
  return among(steady, name) ? &zero : nullptr;
}

// Throws for the first name, in alphabetical order, that is not a state.
void refuse_unknown_rates(const Model& model, const TrimSpec& spec) {
  std::vector<std::string> held = spec.steady;
  for (const auto& [name, rate] : spec.rates) held.push_back(name);
  std::ranges::sort(held);
  for (const std::string& name : held) (void)index_of(model.states, name, "state");
}

void add_rates(Problem& p, const TrimSpec& spec) {
  for (const std::string& name : spec.moving) {
    (void)index_of(p.model.states, name, "state");
    if (among(spec.steady, name) || spec.rates.contains(name) || among(spec.implied, name))
      throw std::invalid_argument(fmt::format("the rate of '{}' is both free and held", name));
  }
  const std::vector<std::string> others =
      spec.steady.empty() ? steady_states(p.model, spec) : std::vector<std::string>{};
  const std::vector<std::string>& steady = spec.steady.empty() ? others : spec.steady;
  for (auto name = steady.begin(); name != steady.end(); ++name)
    if (spec.rates.contains(*name) || std::find(steady.begin(), name, *name) != name)
      throw std::invalid_argument(fmt::format("the rate of '{}' is held twice", *name));
  const std::size_t held = spec.rates.size() + steady.size();
  p.held.resize(Index(held + spec.bounds.size()));
  p.equations.reserve(held + spec.bounds.size());
  for (Index i = 0; i < std::ssize(p.model.states); ++i) {
    const std::string& name = p.model.states[std::size_t(i)].name;
    const double* const rate = held_rate(spec, steady, name);
    if (!rate) continue;
    if (!std::isfinite(*rate))
      throw std::invalid_argument(fmt::format("the held rate of '{}' is not finite", name));
    add_equation(p, i, *rate);
  }
  if (p.equations.size() < held) refuse_unknown_rates(p.model, spec);
  p.implied.reserve(spec.implied.size());
  for (const std::string& name : spec.implied)
    p.implied.push_back(index_of(p.model.states, name, "state"));
}

void add_bounds(Problem& p, const ModelNames& known, const TrimSpec& spec) {
  std::vector<Range> limited;
  limited.reserve(spec.bounds.size());
  p.limited.reserve(spec.bounds.size());
  for (const auto& [name, range] : spec.bounds) {
    check_range(name, range);
    const Place at = place_of(p.model, known, name);
    if (at.row >= 0) {
      if (range.lower == range.upper) {
        add_equation(p, at.row, range.lower);
      } else {
        p.limited.push_back(at.row);
        limited.push_back(range);
      }
      continue;
    }
    const auto k = std::ranges::find(p.unknowns, at.variable) - p.unknowns.begin();
    if (k == p.n()) {
      if (range.lower == range.upper) set_value(p.base, at.variable, range.lower);  // fixed
      p.fixed_bounds.push_back({at.variable, range});
      continue;
    }
    p.lower[k] = range.lower / p.nominal[k];
    p.upper[k] = range.upper / p.nominal[k];
  }
  p.held.conservativeResize(p.m());
  p.limited_lower.resize(std::ssize(limited));
  p.limited_upper.resize(std::ssize(limited));
  for (std::size_t i = 0; i < limited.size(); ++i) {
    const double size = p.row_nominal[p.limited[i]];
    p.limited_lower[Index(i)] = limited[i].lower / size;
    p.limited_upper[Index(i)] = limited[i].upper / size;
  }
}

// If no effort is given, every unknown that is an input over its nominal size.
std::vector<CostTerm> input_effort(const Problem& p) {
  const Index nx = std::ssize(p.model.states), nu = std::ssize(p.model.inputs);
  std::vector<CostTerm> effort;
  for (const Index j : p.unknowns)
    if (j >= nx && j < nx + nu)
      effort.push_back({signal_of(p.model, j).name, signal_of(p.model, j).nominal, 0.0});
  return effort;
}

void add_effort(Problem& p, const ModelNames& known, const TrimSpec& spec) {
  const std::vector<CostTerm> inputs =
      spec.effort.empty() ? input_effort(p) : std::vector<CostTerm>{};
  const std::vector<CostTerm>& effort = spec.effort.empty() ? inputs : spec.effort;
  p.terms.reserve(effort.size());
  for (const CostTerm& e : effort) {
    if (!(e.scale > 0 && std::isfinite(e.scale) && std::isfinite(e.reference)))
      throw std::invalid_argument(fmt::format(
          "control effort of '{}': its scale must be positive and its reference finite", e.signal));
    const Place at = place_of(p.model, known, e.signal);
    const auto k = std::ranges::find(p.unknowns, at.variable) - p.unknowns.begin();
    if (at.row >= 0)
      p.terms.push_back({-1, at.row, e.scale, e.reference});
    else if (k < p.n())
      p.terms.push_back({k, -1, e.scale, e.reference});
    else
      p.fixed_effort += std::pow((value_of(p.base, at.variable) - e.reference) / e.scale, 2);
  }
}

void count(const Problem& p, const TrimSpec& spec) {
  if (p.m() == 0 && p.implied.empty() && spec.effort.empty())
    throw std::invalid_argument(
        "the trim has no conditions: every state may move and no output is held at a value");
  if (p.n() >= p.m()) return;
  std::vector<std::string> unknowns, held;
  for (const Index j : p.unknowns) unknowns.push_back(signal_of(p.model, j).name);
  for (const Index row : p.equations) held.push_back(row_name(p.model, row));
  throw std::invalid_argument(
      fmt::format("{} free variable{} ({}) cannot hold {} conditions ({}): free {} more", p.n(),
                  p.n() == 1 ? "" : "s", fmt::join(unknowns, ", "), p.m(), fmt::join(held, ", "),
                  p.m() - p.n()));
}

// The problem's functions for given rates and outputs y.
void set_values(const Problem& p, const VectorXd& z, const VectorXd& y, Values& v) {
  v.rates = y.head(std::ssize(p.model.states));
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
  v.finite = y.allFinite() && std::isfinite(v.effort);
}

// A point without violations has residual 0, as has a trim without equations.
void note_nearest(const Problem& p, const VectorXd& z, const Values& v) {
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
  p.at = p.base;
  for (Index k = 0; k < p.n(); ++k)
    set_value(p.at, p.unknowns[std::size_t(k)], z[k] * p.nominal[k]);
  return p.at;
}

// Checks the sizes of the model's results, if it can be evaluated at the guess.
void check_answers(const Problem& p) {
  VectorXd rates(std::ssize(p.model.states)), outputs(std::ssize(p.model.outputs));
  const OperatingPoint& at = p.base;
  const bool answered = guarded(p, [&] {
    if (p.in_place)
      return p.in_place->write(at.x.data(), at.u.data(), at.p.data(), rates.data(), outputs.data());
    rates = p.model.f(at.x, at.u, at.p);
    if (p.model.h) outputs = p.model.h(at.x, at.u, at.p);
  });
  check_rates(p.model, rates);
  check_outputs(p.model, outputs);
  if (!answered) return;
  p.y.resize(rates.size() + outputs.size());
  p.y << rates, outputs;
  const VectorXd z = unknowns_of(p, p.base);
  Values v;
  set_values(p, z, p.y, v);
  if (v.finite) note_nearest(p, z, v);
}

}  // namespace

std::vector<std::string> moving_states(const Model& model, const TrimSpec& spec) {
  const std::vector<std::string> steady = steady_states(model, spec);
  std::vector<std::string> moving;
  for (const Signal& s : model.states)
    if (!among(steady, s.name) && !among(spec.implied, s.name) && !spec.rates.contains(s.name))
      moving.push_back(s.name);
  return moving;
}

Problem make_problem(const Model& model, const TrimSpec& spec, const OperatingPoint& guess) {
  const ModelNames known = checked_names(model);
  check(model, guess);
  Problem p(model, guess);
  p.in_place = in_place(model);
  p.row_nominal.resize(std::ssize(model.states) + std::ssize(model.outputs));
  Index at = 0;
  for (const Signals* signals : {&model.states, &model.outputs})
    for (const Signal& s : *signals) p.row_nominal[at++] = s.nominal;
  add_unknowns(p, known, spec);
  add_rates(p, spec);
  add_bounds(p, known, spec);
  add_effort(p, known, spec);
  count(p, spec);
  check_answers(p);
  const Index nx = std::ssize(model.states);
  const auto is_output = [nx](Index row) { return row >= nx; };
  p.needs_outputs = !p.limited.empty() || std::ranges::any_of(p.equations, is_output) ||
                    std::ranges::any_of(p.terms, [](const auto& t) { return t.row >= 0; });
  return p;
}

VectorXd unknowns_of(const Problem& p, const OperatingPoint& point) {
  VectorXd z(p.n());
  for (Index k = 0; k < p.n(); ++k)
    z[k] = value_of(point, p.unknowns[std::size_t(k)]) / p.nominal[k];
  return z;
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
  if (!guarded(p, [&] { rates_and_outputs(p, placed(p, z), p.y); })) {
    v = Values{};
    return;
  }
  set_values(p, z, p.y, v);
  if (v.finite) note_nearest(p, z, v);
}

VectorXd outputs(const Problem& p, const OperatingPoint& at) {
  VectorXd y = VectorXd::Constant(std::ssize(p.model.outputs), NAN);
  if (p.model.h) guarded(p, [&] { y = p.model.h(at.x, at.u, at.p); });
  return y;
}

Jacobians jacobians(const Problem& p, const VectorXd& z) {
  Jacobians s;
  differentiate(p, z, s);
  return s;
}

void differentiate(const Problem& p, const VectorXd& z, Jacobians& s) {
  const OperatingPoint& at = placed(p, z);
  Eigen::MatrixXd J;
  VectorXd outputs;
  s.finite = false;
  const bool answered = guarded(p, [&] {
    J = jacobian(p.model, at, p.unknowns);
    if (!p.terms.empty() && p.needs_outputs) outputs = p.model.h(at.x, at.u, at.p);
  });
  if (!answered) {
    s = Jacobians{};
    return;
  }
  const auto row = [&](Index i) { return J.row(i).cwiseProduct(p.nominal.transpose()); };
  s.residual.resize(p.m(), p.n());
  for (Index i = 0; i < p.m(); ++i)
    s.residual.row(i) =
        row(p.equations[std::size_t(i)]) / p.row_nominal[p.equations[std::size_t(i)]];
  s.limited.resize(std::ssize(p.limited), p.n());
  for (Index i = 0; i < s.limited.rows(); ++i)
    s.limited.row(i) = row(p.limited[std::size_t(i)]) / p.row_nominal[p.limited[std::size_t(i)]];
  s.effort = VectorXd::Zero(p.n());
  for (const Problem::Term& t : p.terms) {
    if (t.row < 0) {
      const double value = z[t.unknown] * p.nominal[t.unknown];
      s.effort[t.unknown] += 2 * (value - t.reference) / (t.scale * t.scale) * p.nominal[t.unknown];
    } else {
      const double value = outputs[t.row - std::ssize(p.model.states)];
      s.effort += 2 * (value - t.reference) / (t.scale * t.scale) * row(t.row).transpose();
    }
  }
  s.finite = s.residual.allFinite() && s.limited.allFinite() && s.effort.allFinite();
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
