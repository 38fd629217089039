// From a spec with the model's names to a problem.
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "model/among.hpp"
#include "model/lookup.hpp"
#include "model/name_table.hpp"
#include "trim/check_answers.hpp"
#include "trim/problem.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::VectorXd;

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
  p.unknowns.reserve(spec.free.size());
  for (auto at = spec.free.begin(); at != spec.free.end(); ++at) {
    const std::string& name = *at;
    Index j = known.variables.find(name);
    if (j < 0) j = variable(p.model, name);  // throws
    if (std::find(spec.free.begin(), at, name) != at)
      throw std::invalid_argument(fmt::format("'{}' is listed twice as a free variable", name));
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

}  // namespace

std::vector<std::string> moving_states(const Model& model, const TrimSpec& spec) {
  const std::vector<std::string> steady = steady_states(model, spec);
  std::vector<std::string> moving;
  for (const Signal& s : model.states)
    if (!among(steady, s.name) && !among(spec.implied, s.name) && !spec.rates.contains(s.name))
      moving.push_back(s.name);
  return moving;
}

Problem make_problem(const Model& model, const TrimSpec& spec, const OperatingPoint& guess,
                     bool timed) {
  const ModelNames known = checked_names(model);
  check(model, guess);
  Problem p(model, guess);
  p.in_place = in_place(model);
  p.notes_nearest = timed;
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

}  // namespace tiltrim
